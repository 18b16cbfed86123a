"""The volumes of a study as a reviewer meets them: those that need a reviewer most come first."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QColor, QGuiApplication

from annotations.agreement.triage import Settled, TriageEntry
from annotator.looks import theme
from annotator.panels.widgets.table_model import (
    RIGHT,
    SORT_ROLE,
    Column,
    Heading,
    Index,
    TableModel,
    bold_font,
)

_NOTHING = "–"
_FLAGGED = " ⚑"
_SETTLED: dict[Settled, str] = {"no": "no", "in_progress": "in progress", "stale": "stale", "done": "done"}
_ORDER: tuple[Settled, ...] = ("no", "in_progress", "stale", "done")
# Of what is usual in the study: from here on a volume stands out.
_STANDS_OUT = 3.0


_COLUMNS = (
    Column[TriageEntry](
        "Volume",
        "Enter or a double click opens its consensus",
        lambda entry: f"{entry.volume}{_FLAGGED if entry.flags else ''}",
        lambda entry: entry.volume.casefold(),
        is_number=False,
    ),
    Column[TriageEntry](
        "Apart",
        "How far the annotators are apart, as a multiple of what is usual in this study",
        lambda entry: f"× {entry.disagreement:.1f}" if entry.disagreement else _NOTHING,
        lambda entry: entry.disagreement,
    ),
    Column[TriageEntry](
        "Residual",
        "By how much the tool, fitted to the annotation that it fits worst, misses what is placed",
        lambda entry: _NOTHING if entry.residual_um is None else f"{entry.residual_um:,.0f} µm",
        lambda entry: -1.0 if entry.residual_um is None else entry.residual_um,
    ),
    Column[TriageEntry](
        "Settled",
        "How far the consensus is; stale where an annotation was changed after it had been settled",
        lambda entry: _SETTLED[entry.settled],
        lambda entry: _ORDER.index(entry.settled),
        is_number=False,
    ),
    Column[TriageEntry](
        "Flags",
        "Why annotators say that somebody should look at it",
        lambda entry: _flags(entry, "; "),
        lambda entry: (-len(entry.flags), _flags(entry, "; ")),
        is_number=False,
    ),
    Column[TriageEntry](
        "Why",
        "What explains the disagreement",
        lambda entry: "; ".join(entry.reasons),
        lambda entry: "; ".join(entry.reasons),
        is_number=False,
    ),
)
VOLUME, APART, RESIDUAL, SETTLED, FLAGS, WHY = range(len(_COLUMNS))


class TriageModel(TableModel):
    """A row for each volume of a triage, in its order."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._entries: tuple[TriageEntry, ...] = ()
        self._open: str | None = None

    def show_entries(self, entries: Sequence[TriageEntry]) -> None:
        """List the volumes of a triage; what has changed of the same ones is drawn in place."""
        before, self._entries = self._entries, tuple(entries)
        if [each.volume for each in before] == [each.volume for each in self._entries]:
            self._redraw(row for row, entry in enumerate(self._entries) if entry != before[row])
            return
        self.beginResetModel()
        self.endResetModel()

    def volume_id(self, row: int) -> str:
        """Return the id of the volume in a row."""
        return self._entries[row].volume

    def mark_open(self, volume_id: str | None) -> None:
        """Write the open volume in bold."""
        if volume_id == self._open:
            return
        before, self._open = self._open, volume_id
        self._redraw(row for row, entry in enumerate(self._entries) if entry.volume in (before, volume_id))

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        entry, column = self._entries[index.row()], _COLUMNS[index.column()]
        if role == SORT_ROLE:
            return column.sort(entry)
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return column.text(entry)
            case Qt.ItemDataRole.TextAlignmentRole if column.is_number:
                return RIGHT
            case Qt.ItemDataRole.ForegroundRole:
                return _color(entry, index.column())
            case Qt.ItemDataRole.FontRole if entry.volume == self._open:
                return bold_font()
            case Qt.ItemDataRole.ToolTipRole:
                return _explained(entry)
        return None

    def _row_count(self) -> int:
        return len(self._entries)

    def _headings(self) -> Sequence[Heading]:
        return _COLUMNS


def _flags(entry: TriageEntry, between: str) -> str:
    return between.join(f"{flag.annotator}: {flag.words}" for flag in entry.flags)


def _color(entry: TriageEntry, column: int) -> QColor | None:
    colors = theme.colors(QGuiApplication.palette())
    if column == SETTLED:
        return {
            "no": colors.muted,
            "in_progress": colors.warning,
            "stale": colors.warning,
            "done": colors.success,
        }[entry.settled]
    stands_out = {
        APART: entry.disagreement >= _STANDS_OUT,
        RESIDUAL: entry.strangeness >= _STANDS_OUT,
        FLAGS: True,
    }
    return colors.warning if stands_out.get(column) and entry.settled != "done" else None


def _explained(entry: TriageEntry) -> str:
    lines = [entry.volume, *(f"Flagged by {flag.annotator}: {flag.words}" for flag in entry.flags)]
    if entry.strangeness:
        lines.append(f"The tool misses it by {entry.strangeness:.1f} times what is usual here")
    return "\n".join([*lines, *entry.reasons])
