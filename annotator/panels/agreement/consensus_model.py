"""The parts of the open consensus as a table: what each is now, how far apart the annotators are, and who."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QObject, Qt, Slot
from PySide6.QtGui import QColor, QGuiApplication

from annotations.agreement.consensus import PartConsensus, distance_um
from annotations.documents.annotation import Part
from annotator.looks import theme
from annotator.panels.widgets.table_model import RIGHT, Heading, Index, TableModel, bold_font
from annotator.session import Session
from annotator.session.viewing.view import View

_NOTHING = "–"
_COLUMNS = (
    Heading("", "Keypoint, or link of a box"),
    Heading("Now", "Where its place comes from"),
    Heading("Spread / µm", "Mean distance of those who are used from what is proposed"),
    Heading("Take", "One annotator's, as it is"),
    Heading(
        "Set aside", "Who is too far from the others to count, or has the hinge's axis in the other sense"
    ),
    Heading("Used", "Whose places are in the mean"),
)
_TURNED = (
    "{}'s box is turned by 180° about its own x: the same body, with the hinge's axis in the other sense. "
    "It is turned back for the mean"
)
NAME, NOW, SPREAD, TAKE, ASIDE, USED = range(len(_COLUMNS))


class ConsensusModel(TableModel):
    """A row for each keypoint or box of the open document, while it is a consensus."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._parts = self._look_up()
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        session.settling.changed.connect(self._on_settling_changed)

    def name(self, row: int) -> str:
        """Return the name of the part in a row."""
        return self._parts[row].name

    def row(self, name: str | None) -> int | None:
        """Return the row of a part, or None."""
        return next((row for row, part in enumerate(self._parts) if part.name == name), None)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        part, column = self._parts[index.row()], index.column()
        agreed = self._session.settling.part(part.name)
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return _text(part, agreed, column)
            case Qt.ItemDataRole.TextAlignmentRole if column == SPREAD:
                return RIGHT
            case Qt.ItemDataRole.ForegroundRole:
                return _color(part, column)
            case Qt.ItemDataRole.FontRole if column == NAME and part.name == self._session.view.active_part:
                return bold_font()
            case Qt.ItemDataRole.ToolTipRole:
                return self._tooltip(part, agreed, column)
        return None

    def _row_count(self) -> int:
        return len(self._parts)

    def _headings(self) -> Sequence[Heading]:
        return _COLUMNS

    def _tooltip(self, part: Part, agreed: PartConsensus | None, column: int) -> str | None:
        if agreed is None:
            return None
        if column == NOW:
            off_um = distance_um(part, agreed.proposed)
            return f"{off_um:,.0f} µm from what is proposed" if off_um is not None else None
        if column != ASIDE:
            return None
        opinions = self._session.settling.opinions_on(part.name)
        away_um = {name: distance_um(opinions[name], agreed.proposed) or 0.0 for name in agreed.set_aside}
        lines = [
            *(f"{name} is {um:,.0f} µm from what is proposed, and not in it" for name, um in away_um.items()),
            *(_TURNED.format(name) for name in agreed.turned),
        ]
        return "\n".join(lines) or None

    def _look_up(self) -> tuple[Part, ...]:
        document = self._session.document
        return document.parts if document is not None and self._session.settling.is_settling else ()

    def _follow(self) -> None:
        before, self._parts = self._parts, self._look_up()
        if [part.name for part in before] != [part.name for part in self._parts]:
            self.beginResetModel()
            self.endResetModel()
        else:
            self._redraw(range(len(self._parts)))

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._follow()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.active_part != after.active_part:
            self._follow()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._follow()

    @Slot()
    def _on_settling_changed(self) -> None:
        self._follow()


def words_of(part: Part) -> str:
    """Say where a part of a consensus has its place from."""
    if part.anchor_um is None:
        return "unplaced"
    if part.source == "consensus":
        return "proposed"
    if part.source == "adopted":
        return f"taken from {part.adopted_from}"
    if part.source == "fitted":
        return "filled in from the fit"
    return "moved by hand"


def _text(part: Part, agreed: PartConsensus | None, column: int) -> str:
    if column == NAME:
        return part.name
    if column == NOW:
        return f"{words_of(part)}{', locked' if part.locked else ''}"
    if agreed is None:
        return ""
    if column == SPREAD:
        return _NOTHING if agreed.spread_um is None else f"{agreed.spread_um:,.1f}"
    if column == ASIDE:
        marks = [f"✕ {annotator}" for annotator in agreed.set_aside]
        return ", ".join([*marks, *(f"↻ {annotator} turned" for annotator in agreed.turned)])
    return ", ".join(agreed.used) or "nobody" if column == USED else ""


def _color(part: Part, column: int) -> QColor | None:
    colors = theme.colors(QGuiApplication.palette())
    if column == ASIDE:
        return colors.warning
    if column == NOW:
        is_decided = part.source not in (None, "consensus", "fitted")
        return colors.success if is_decided else None if part.anchor_um is not None else colors.muted
    return None
