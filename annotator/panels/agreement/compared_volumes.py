"""The volumes of a comparison as a list: how far apart their annotators are, and why."""

from collections.abc import Callable, Sequence
from typing import Any

from PySide6.QtCore import QObject, Qt

from annotations.agreement.report.labels import NOTHING, label_of, number, unit_of
from annotations.agreement.results import VolumeResult
from annotator.panels.widgets.table_model import (
    RIGHT,
    SORT_ROLE,
    Column,
    Heading,
    Index,
    TableModel,
    bold_font,
)

WHY_COLUMN, RANK_COLUMN = 1, 2
_RATIO = (
    "How many times the median volume's deviation this one's is, in the target in which it is most: what the "
    "worst are found by"
)


class ComparedVolumes(TableModel):
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
        self._columns: tuple[Column[VolumeResult], ...] = ()
        self._open: str | None = None

    def show_volumes(self, volumes: Sequence[VolumeResult], targets: Sequence[str]) -> None:
        """List other volumes."""
        self.beginResetModel()
        self._volumes = tuple(volumes)
        self._columns = (
            Column(
                "Volume",
                "Enter or a double click opens it, with all annotators over it",
                lambda volume: self._label(volume.volume),
                lambda volume: self._label(volume.volume).casefold(),
                is_number=False,
            ),
            Column(
                "Why",
                "What explains it",
                lambda volume: "; ".join(volume.reasons),
                lambda volume: "; ".join(volume.reasons),
                is_number=False,
            ),
            Column(
                "× median",
                _RATIO,
                lambda volume: f"{volume.ratio_to_median:.1f}",
                lambda volume: volume.ratio_to_median,
            ),
            *(_target_column(target) for target in targets),
            Column(
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
        if volume == self._open:
            return
        before, self._open = self._open, volume
        self._redraw(row for row, each in enumerate(self._volumes) if each.volume in (before, volume))

    def widest_text(self, column: int) -> str:
        """Return the longest text of a column."""
        return max((self._columns[column].text(each) for each in self._volumes), key=len, default="")

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
                return RIGHT
            case Qt.ItemDataRole.FontRole if volume.volume == self._open:
                return bold_font()
            case Qt.ItemDataRole.ToolTipRole:
                why = "; ".join(volume.reasons) or "Nothing particular was recognised"
                return f"{self._label(volume.volume)}: {', '.join(volume.annotators)}\n{why}"
        return None

    def _row_count(self) -> int:
        return len(self._volumes)

    def _headings(self) -> Sequence[Heading]:
        return self._columns


def _target_column(target: str) -> Column[VolumeResult]:
    unit = unit_of(target)

    def text(volume: VolumeResult) -> str:
        return number(volume.targets.get(target), unit) if target in volume.targets else NOTHING

    return Column(
        f"{label_of(target)} / {unit}",
        f"{label_of(target)}: mean distance of the annotators from the mean of all of them, in {unit}",
        text,
        lambda volume: volume.targets.get(target, -1.0),
    )
