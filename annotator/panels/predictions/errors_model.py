"""The table of errors: volumes as they are sorted and filtered, and the figures of those that are shown."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal

from PySide6.QtCore import QModelIndex, QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication

from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.errors.ranking import RankedVolume
from annotator.looks import theme
from annotator.panels.predictions.errors_columns import (
    RANK,
    ErrorColumn,
    ReviewedVolume,
    columns_of,
    explained,
)
from annotator.panels.widgets.table_model import RIGHT, Heading, Index, TableModel, bold_font
from annotator.session.predictions.judging import Judgement

Kind = Literal["all", "unjudged", "judged", "beyond", "missing", "out_of_view", "begun"]

KINDS: Mapping[Kind, str] = {
    "all": "All",
    "unjudged": "No verdict",
    "judged": "With a verdict",
    "beyond": "Worse than people",
    "missing": "Keypoints missing",
    "out_of_view": "Partly out of view",
    "begun": "Begun from a prediction",
}
"""Which volumes can be shown, and what that is called."""

_OF_SHOWN = (
    "Mean and standard deviation over the volumes that are shown above, without those whose annotation was "
    "begun from a prediction"
)
_OF_PEOPLE = (
    "How far the annotators of the same volumes are apart: of each volume the mean distance from the mean of "
    "all of them, and of these the mean ± standard deviation"
)


class ErrorsModel(TableModel):
    """A row for each volume that is shown, in the order in which it is.

    It sorts and filters by itself, rather than through a proxy: the rows' order is the one in which a
    reviewer walks, and volumes without a figure come last whichever way it is sorted.

    Signals
    -------
    shown_changed
        ``volumes`` changed, other ones or in another order, or what their figures are of.
    """

    shown_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._table: ErrorTable | None = None
        self._all: tuple[ReviewedVolume, ...] = ()
        self._shown: tuple[ReviewedVolume, ...] = ()
        self._columns: tuple[ErrorColumn, ...] = ()
        self._by_fit = False
        self._text = ""
        self._kind: Kind = "all"
        self._sorted_by = (RANK, Qt.SortOrder.DescendingOrder)
        self._open: str | None = None

    def show_errors(
        self,
        table: ErrorTable,
        ranking: Sequence[RankedVolume],
        label: Callable[[str], str],
        judgement: Callable[[str], Judgement],
    ) -> None:
        """List the volumes of a table."""
        self.beginResetModel()
        self._table = table
        by_volume = {row.volume: row for row in table.rows}
        self._all = tuple(
            ReviewedVolume(label(each.volume), by_volume[each.volume], each, place, judgement(each.volume))
            for place, each in enumerate(ranking)
        )
        self._columns = columns_of(table, by_fit=self._by_fit)
        self._shown = self._as_wanted()
        self.endResetModel()
        self.shown_changed.emit()

    def show_judgements(self, judgement: Callable[[str], Judgement]) -> None:
        """Show what reviewers say by now; rows stay where they are until something else is asked for."""
        judged = {each.volume: judgement(each.volume) for each in self._all}

        def with_judgement(volumes: Iterable[ReviewedVolume]) -> tuple[ReviewedVolume, ...]:
            return tuple(
                ReviewedVolume(each.label, each.errors, each.ranked, each.rank, judged[each.volume])
                for each in volumes
            )

        self._all, self._shown = with_judgement(self._all), with_judgement(self._shown)
        self._redraw(range(len(self._shown)))

    def show_by_fit(self, by_fit: bool) -> None:
        """Show the errors of the fitted pose, or those of the predicted keypoints."""
        self._by_fit = by_fit
        if self._table is not None:
            self._columns = columns_of(self._table, by_fit=by_fit)
            self._rearrange()
            self._redraw(range(len(self._shown)))
            self.shown_changed.emit()

    def show_text(self, text: str) -> None:
        """Show the volumes in whose name, verdict or note a text is; capitals do not count."""
        self._text = text.casefold()
        self._rearrange()

    def show_kind(self, kind: Kind) -> None:
        """Show the volumes of a kind."""
        self._kind = kind
        self._rearrange()

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        self._sorted_by = (column, order)
        self._rearrange()

    @property
    def columns(self) -> tuple[ErrorColumn, ...]:
        """What stands in the columns."""
        return self._columns

    @property
    def shown(self) -> tuple[ReviewedVolume, ...]:
        """The rows."""
        return self._shown

    @property
    def count(self) -> int:
        """How many volumes there are, shown or not."""
        return len(self._all)

    @property
    def volumes(self) -> tuple[str, ...]:
        """The ids of the volumes that are shown, in their order."""
        return tuple(each.volume for each in self._shown)

    def row_of(self, volume: str | None) -> int | None:
        """Return the row of a volume; None where it is not shown."""
        return next((row for row, each in enumerate(self._shown) if each.volume == volume), None)

    def mark_open(self, volume: str | None) -> None:
        """Write the open volume in bold."""
        if volume != self._open:
            rows = [self.row_of(self._open), self.row_of(volume)]
            self._open = volume
            self._redraw(row for row in rows if row is not None)

    def widest_text(self, column: int) -> str:
        """Return the longest text of a column, of all the volumes."""
        return max((self._columns[column].text(each) for each in self._all), key=len, default="")

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        volume, column = self._shown[index.row()], self._columns[index.column()]
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return column.text(volume)
            case Qt.ItemDataRole.TextAlignmentRole if column.is_number:
                return RIGHT
            case Qt.ItemDataRole.ForegroundRole if column.is_beyond(volume):
                return theme.colors(QGuiApplication.palette()).warning
            case Qt.ItemDataRole.ForegroundRole if volume.errors.begun_from:
                return theme.colors(QGuiApplication.palette()).muted
            case Qt.ItemDataRole.FontRole if volume.volume == self._open:
                return bold_font()
            case Qt.ItemDataRole.ToolTipRole:
                return explained(volume)
        return None

    def _as_wanted(self) -> tuple[ReviewedVolume, ...]:
        """Return the volumes that are wanted, sorted: equal ones as they are ranked."""
        wanted = [each for each in self._all if _is_of(each, self._kind) and self._text in _text_of(each)]
        place, order = self._sorted_by
        if not 0 <= place < len(self._columns):
            return tuple(wanted)
        by = {each.volume: self._columns[place].sort(each) for each in wanted}
        known = [each for each in wanted if by[each.volume] is not None]
        known.sort(key=lambda each: by[each.volume], reverse=order == Qt.SortOrder.DescendingOrder)
        return (*known, *(each for each in wanted if by[each.volume] is None))

    def _rearrange(self) -> None:
        wanted = self._as_wanted()
        if [each.volume for each in wanted] == list(self.volumes):
            return
        self.layoutAboutToBeChanged.emit()
        before = self.persistentIndexList()
        kept = [self._shown[index.row()].volume for index in before]
        self._shown = wanted
        rows = {each.volume: row for row, each in enumerate(wanted)}
        after = [
            self.index(rows[volume], index.column()) if volume in rows else QModelIndex()
            for volume, index in zip(kept, before, strict=True)
        ]
        self.changePersistentIndexList(before, after)
        self.layoutChanged.emit()
        self.shown_changed.emit()

    def _row_count(self) -> int:
        return len(self._shown)

    def _headings(self) -> Sequence[Heading]:
        return self._columns


class SummaryModel(TableModel):
    """The figures below a table of errors: of the volumes that are shown, and of people."""

    def __init__(self, errors: ErrorsModel, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._errors = errors
        self._rows: Sequence[Sequence[str]] = ()
        self._columns: tuple[ErrorColumn, ...] = ()
        errors.shown_changed.connect(self._on_errors_shown_changed)

    def widest_text(self, column: int) -> str:
        """Return the longest text of a column."""
        return max((row[column] for row in self._rows), key=len, default="")

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self._rows[index.row()][index.column()]
            case Qt.ItemDataRole.TextAlignmentRole if self._columns[index.column()].is_number:
                return RIGHT
            case Qt.ItemDataRole.ToolTipRole:
                return (_OF_SHOWN, _OF_PEOPLE)[index.row()]
        return None

    def _row_count(self) -> int:
        return len(self._rows)

    def _headings(self) -> Sequence[Heading]:
        return self._columns

    def _on_errors_shown_changed(self) -> None:
        columns = self._errors.columns
        counted = [each for each in self._errors.shown if not each.errors.begun_from]
        rows = [[column.summary(counted) for column in columns]]
        people = [column.people for column in columns]
        if any(people):
            rows.append(people)
        self.beginResetModel()
        self._rows, self._columns = rows, columns
        self.endResetModel()


def _is_of(volume: ReviewedVolume, kind: Kind) -> bool:
    match kind:
        case "unjudged":
            return volume.judgement.own is None
        case "judged":
            return volume.judgement.own is not None or bool(volume.judgement.others)
        case "beyond":
            return volume.ranked.ratio is not None and volume.ranked.ratio > 1
        case "missing":
            return bool(volume.errors.missing)
        case "out_of_view":
            return bool(volume.errors.out_of_view)
        case "begun":
            return bool(volume.errors.begun_from)
        case _:
            return True


def _text_of(volume: ReviewedVolume) -> str:
    return "\n".join((volume.label, volume.errors.whose, *volume.judgement.lines)).casefold()
