"""The volumes of a comparison as a list: how far apart their annotators are, and why."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt
from PySide6.QtGui import QFont

from annotations.agreement.report.labels import NOTHING, label_of, number, unit_of
from annotations.agreement.results import VolumeResult

Index = QModelIndex | QPersistentModelIndex
SORT_ROLE = Qt.ItemDataRole.UserRole + 1
WHY_COLUMN, RANK_COLUMN = 1, 2
_ROOT = QModelIndex()
_RATIO = (
    "How many times the median volume's deviation this one's is, in the target in which it is most: what the "
    "worst are found by"
)


@dataclass(frozen=True)
class _Column:
    title: str
    tooltip: str
    text: Callable[[VolumeResult], str]
    sort: Callable[[VolumeResult], Any]
    is_number: bool = True


class ComparedVolumes(QAbstractTableModel):
    """Volumes by one method: name, reasons, ratio to the median, figures by target, annotators.

    Parameters
    ----------
    label : callable
        From a volume's name to what the person is shown of it.
    """

    def __init__(self, label: Callable[[str], str], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._label = label
        self._volumes: tuple[VolumeResult, ...] = ()
        self._columns: tuple[_Column, ...] = ()
        self._open: str | None = None

    def show_volumes(self, volumes: Sequence[VolumeResult], targets: Sequence[str]) -> None:
        """List other volumes."""
        self.beginResetModel()
        self._volumes = tuple(volumes)
        self._columns = (
            _Column(
                "Volume",
                "Enter or a double click opens it, with all annotators over it",
                lambda volume: self._label(volume.volume),
                lambda volume: self._label(volume.volume).casefold(),
                is_number=False,
            ),
            _Column(
                "Why",
                "What explains it",
                lambda volume: "; ".join(volume.reasons),
                lambda volume: "; ".join(volume.reasons),
                is_number=False,
            ),
            _Column(
                "× median",
                _RATIO,
                lambda volume: f"{volume.ratio_to_median:.1f}",
                lambda volume: volume.ratio_to_median,
            ),
            *(_target_column(target) for target in targets),
            _Column(
                "Annotators",
                "Who annotated it",
                lambda volume: ", ".join(volume.annotators),
                lambda volume: len(volume.annotators),
                is_number=False,
            ),
        )
        self.endResetModel()

    def volume(self, row: int) -> str:
        """Return the name, in the result, of the volume in a row."""
        return self._volumes[row].volume

    def mark_open(self, volume: str | None) -> None:
        """Write the open volume in bold."""
        if volume != self._open:
            self._open = volume
            if self._volumes:
                last = self.index(len(self._volumes) - 1, len(self._columns) - 1)
                self.dataChanged.emit(self.index(0, 0), last)

    def rowCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(self._volumes)

    def columnCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(self._columns)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation != Qt.Orientation.Horizontal or section >= len(self._columns):
            return None
        column = self._columns[section]
        return {
            Qt.ItemDataRole.DisplayRole: column.title,
            Qt.ItemDataRole.ToolTipRole: column.tooltip,
            # The worst first.
            Qt.ItemDataRole.InitialSortOrderRole: (
                Qt.SortOrder.DescendingOrder if column.is_number else Qt.SortOrder.AscendingOrder
            ),
        }.get(Qt.ItemDataRole(role))

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        volume, column = self._volumes[index.row()], self._columns[index.column()]
        if role == SORT_ROLE:
            return column.sort(volume)
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return column.text(volume)
            case Qt.ItemDataRole.TextAlignmentRole if column.is_number:
                return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            case Qt.ItemDataRole.FontRole if volume.volume == self._open:
                font = QFont()
                font.setBold(True)
                return font
            case Qt.ItemDataRole.ToolTipRole:
                why = "; ".join(volume.reasons) or "Nothing particular was recognised"
                return f"{self._label(volume.volume)}: {', '.join(volume.annotators)}\n{why}"
        return None


def _target_column(target: str) -> _Column:
    unit = unit_of(target)

    def text(volume: VolumeResult) -> str:
        return number(volume.targets.get(target), unit) if target in volume.targets else NOTHING

    return _Column(
        f"{label_of(target)} / {unit}",
        f"{label_of(target)}: mean distance of the annotators from the mean of all of them, in {unit}",
        text,
        lambda volume: volume.targets.get(target, -1.0),
    )
