"""What the tables of keypoints and of boxes have in common: a row a part, judged, locked, cleared alike."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from PySide6.QtCore import QObject, Qt, Signal, Slot
from PySide6.QtGui import QColor, QFont, QGuiApplication

from annotations.documents.annotation import Annotation, Part
from annotations.fitting.evidence import part_sigma_um
from annotations.fitting.plausibility import plausibility
from annotations.geometry.tool import Link
from annotator.looks import theme
from annotator.looks.icons import icon
from annotator.looks.redrawing import Redrawing
from annotator.looks.swatches import PartSwatches
from annotator.looks.typed_numbers import NotUnderstood
from annotator.panels.annotation.plausibility_color import plausibility_color
from annotator.panels.widgets.table_model import RIGHT, Index, TableModel, bold_font
from annotator.session import Session
from annotator.session.viewing.view import View

_KEYS = 9
# All that the columns show of a part besides its numbers.
_SAID = ("state", "certainty", "source", "adopted_from", "locked")
# Nobody has said of these that they are there.
_UNSEEN = ("fitted", "predicted")

SHORT_STATES = {"predicted": "pred.", "occluded": "occl.", "out of view": "out", "unplaced": "–"}
"""Where there is no room for the words."""

STATES = ("placed", "occluded", "out_of_view", "unplaced")

ColumnKind = Literal["name", "number", "residual", "state", "sure", "lock", "clear", "source"]
_ICONS: dict[ColumnKind, str] = {"sure": "sure", "lock": "lock"}

# Qt asks for them twice a cell each time that it paints, and Python takes its time to join flags.
_LOOKED_AT = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
_TICKED = _LOOKED_AT | Qt.ItemFlag.ItemIsUserCheckable
_TYPED = _LOOKED_AT | Qt.ItemFlag.ItemIsEditable

P = TypeVar("P", bound=Part)


@dataclass(frozen=True)
class PartColumn:
    """What a column shows: numbers are the model's own, the other kinds are the same for all parts."""

    kind: ColumnKind
    title: str
    explanation: str


class PartsModel(TableModel, Generic[P]):
    """One row a part of the open document, a part on its way in place of the document's own.

    A model of keypoints or of boxes says which columns there are and what their numbers are.

    Signals
    -------
    not_understood : str
        Typed text was refused, and why; nothing has changed.
    """

    not_understood = Signal(str)

    def __init__(
        self, session: Session, columns: tuple[PartColumn, ...], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._columns = columns
        self._shown, self._coming = self._look_up()
        self._residuals_um = [self._residual_um(part) for part in self._shown]
        self._around = self._look_around()
        # Rows that differ from what was announced last: whole, or in their numbers alone.
        self._rows_owed: set[int] = set()
        self._numbers_owed: set[int] = set()
        self._redrawing = Redrawing(self._announce, self)
        self._swatches = PartSwatches()
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)

    def name(self, row: int) -> str:
        """Return the name of the part in a row."""
        return self._part(row).name

    def row(self, name: str | None) -> int | None:
        """Return the row of a part, or None."""
        names = [part.name for part in self._shown]
        return names.index(name) if name in names else None

    def columns_of(self, *kinds: ColumnKind) -> tuple[int, ...]:
        """Return the columns of some kinds, from left to right."""
        return tuple(number for number, column in enumerate(self._columns) if column.kind in kinds)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation == Qt.Orientation.Vertical:
            if role == Qt.ItemDataRole.DisplayRole:
                return str(section + 1) if section < _KEYS else ""
            if role == Qt.ItemDataRole.ToolTipRole and section < _KEYS:
                return f"Key {section + 1} makes {self.name(section)} the active one"
            return None
        kind, title = self._columns[section].kind, self._columns[section].title
        match role:
            case Qt.ItemDataRole.DisplayRole if kind not in _ICONS and kind != "clear":
                return self._heading(section)
            case Qt.ItemDataRole.DecorationRole if kind in _ICONS:
                return icon(_ICONS[kind], QGuiApplication.palette())
            case Qt.ItemDataRole.AccessibleTextRole:
                return title
            case Qt.ItemDataRole.ToolTipRole:
                return self._columns[section].explanation
            case Qt.ItemDataRole.TextAlignmentRole:
                if kind == "state" or kind in _ICONS:
                    return Qt.AlignmentFlag.AlignCenter
                is_right = kind in ("number", "residual")
                side = Qt.AlignmentFlag.AlignRight if is_right else Qt.AlignmentFlag.AlignLeft
                return side | Qt.AlignmentFlag.AlignVCenter
            case Qt.ItemDataRole.ForegroundRole if kind == "number":
                return self._title_color(section)
        return None

    def flags(self, index: Index) -> Qt.ItemFlag:
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        part, kind = self._part(index.row()), self._columns[index.column()].kind
        if self._session.read_only_reason:
            return _LOOKED_AT
        if kind == "lock" or (kind == "sure" and not part.locked):
            return _TICKED
        is_typed = kind == "state" or (kind == "number" and self._takes_number(part, index.column()))
        return _TYPED if is_typed and not part.locked else _LOOKED_AT

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        part, column = self._part(index.row()), index.column()
        kind = self._columns[column].kind
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self._text(part, column)
            case Qt.ItemDataRole.EditRole:
                return self._edit_text(part, column)
            case Qt.ItemDataRole.CheckStateRole if kind in ("sure", "lock"):
                checked = part.certainty == "sure" if kind == "sure" else part.locked
                return Qt.CheckState.Checked if checked else Qt.CheckState.Unchecked
            case Qt.ItemDataRole.DecorationRole if kind == "name":
                link = self._link(part.name)
                color = QColor(link.color) if link else theme.colors(QGuiApplication.palette()).muted
                return self._swatches.icon(color, hollow=part.state == "unplaced")
            case Qt.ItemDataRole.TextAlignmentRole if kind in ("number", "residual"):
                return RIGHT
            case Qt.ItemDataRole.TextAlignmentRole if kind == "state":
                return Qt.AlignmentFlag.AlignCenter
            case Qt.ItemDataRole.ForegroundRole:
                return self._foreground(part, column)
            case Qt.ItemDataRole.FontRole:
                return self._font(part, column)
            case Qt.ItemDataRole.ToolTipRole:
                return self._tooltip(part, column)
            case Qt.ItemDataRole.AccessibleTextRole:
                return self._accessible_text(part, column)
        return None

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        if not index.isValid():
            return False
        part, kind = self._part(index.row()), self._columns[index.column()].kind
        if role == Qt.ItemDataRole.CheckStateRole:
            checked = Qt.CheckState(value) == Qt.CheckState.Checked
            if kind == "sure":
                self._session.set_certainty(part.name, "sure" if checked else "unsure")
            elif kind == "lock":
                self._session.set_locked(part.name, checked)
            return kind in ("sure", "lock")
        if role != Qt.ItemDataRole.EditRole:
            return False
        if kind == "state":
            if value != part.state:
                self._session.set_state(part.name, value)
            return True
        return kind == "number" and self._type(part, index.column(), str(value))

    def refusal(self, row: int, column: int, text: str) -> str:
        """Say what is wrong with text typed into a number's cell; empty if nothing is."""
        part = self._part(row)
        if text == self._edit_text(part, column):
            return ""
        try:
            self._wish(part, column, text)
        except NotUnderstood as error:
            return str(error)
        return ""

    # What keypoints and boxes say each in their own way

    def _parts_of(self, document: Annotation) -> tuple[P, ...]:
        """Return the parts of a document that have rows; none where it is of the other method."""
        raise NotImplementedError

    def _heading(self, column: int) -> str:
        """Return the heading of a column."""
        return self._columns[column].title

    def _title_color(self, column: int) -> QColor | None:
        """Return the colour of a number's heading."""
        return None

    def _label(self, part: P) -> str:
        """Return what a part is called besides its name."""
        raise NotImplementedError

    def _link(self, name: str) -> Link | None:
        """Return the link whose colour a part has."""
        raise NotImplementedError

    def _number(self, part: P, column: int, *, exact: bool) -> str:
        """Return a number as shown, or with the digits that a person edits; empty where there is none."""
        raise NotImplementedError

    def _takes_number(self, part: P, column: int) -> bool:
        """Say whether a number can be typed where the part is not locked."""
        return True

    def _wish(self, part: P, column: int, text: str) -> Callable[[], object]:
        """Return what asks the session for a number that was typed; NotUnderstood where it is none."""
        raise NotImplementedError

    def _number_tooltip(self, part: P, column: int) -> str:
        raise NotImplementedError

    def _number_color(self, part: P) -> QColor | None:
        """Return the colour of a part's numbers where they call for a look."""
        return None

    def _residual_um(self, part: P) -> float | None:
        """Return how far from a part the fitted tool has it, in µm; None where it was no evidence."""
        return None

    # The same for both

    def _row_count(self) -> int:
        return len(self._shown)

    def _column_count(self) -> int:
        return len(self._columns)

    def _type(self, part: P, column: int, text: str) -> bool:
        # What is shown is rounded; leaving it as it is must not round the number.
        if text == self._edit_text(part, column):
            return True
        try:
            wish = self._wish(part, column, text)
        except NotUnderstood as error:
            self.not_understood.emit(f"{part.name}: {error}. Nothing was changed.")
            return False
        wish()
        return True

    def _text(self, part: P, column: int) -> str:
        match self._columns[column].kind:
            case "name":
                label = self._label(part)
                return f"{part.name}  {label}" if label else part.name
            case "number":
                return self._number(part, column, exact=False) or "—"
            case "residual":
                residual_um = self._residual_um(part)
                return "—" if residual_um is None else _short(residual_um)
            case "state":
                # In a narrow window the source is out of sight, and this is what a person has to see of it.
                is_predicted = part.source == "predicted" and part.state == "placed"
                return "predicted" if is_predicted else part.state.replace("_", " ")
            case "source":
                return f"{part.source}…" if part.name in self._coming else part.source or ""
        return ""

    def _edit_text(self, part: P, column: int) -> str:
        match self._columns[column].kind:
            case "name":
                return part.name
            case "number":
                return self._number(part, column, exact=True)
            case "state":
                return part.state
        return ""

    def _foreground(self, part: P, column: int) -> QColor | None:
        kind, colors = self._columns[column].kind, theme.colors(QGuiApplication.palette())
        color = self._number_color(part) if kind == "number" else None
        if kind == "residual" and (residual_um := self._residual_um(part)) is not None:
            color = plausibility_color(plausibility(residual_um, part_sigma_um(part)))
        if color is not None:
            return color
        # What was filled in or predicted is no observation.
        is_empty = part.state == "unplaced" or (kind == "number" and part.source in _UNSEEN)
        return colors.muted if kind == "source" or (kind != "name" and is_empty) else None

    def _font(self, part: P, column: int) -> QFont | None:
        kind = self._columns[column].kind
        if kind == "name":
            return bold_font() if part.name == self._session.view.active_part else None
        is_observed = part.name not in self._coming and part.source not in _UNSEEN
        return _italic_font() if kind in ("number", "source") and not is_observed else None

    def _tooltip(self, part: P, column: int) -> str:
        kind = self._columns[column].kind
        if self._session.read_only_reason and kind in ("state", "sure", "lock", "clear"):
            return f"Read-only. {self._session.read_only_reason}"
        if kind == "lock":
            return "Unlock it to change it" if part.locked else "Lock it against every change"
        if part.locked:
            return f"{part.name} is locked: unlock it to change it"
        if kind == "source" and part.source == "predicted":
            return "Predicted: accept it (Ctrl+Enter for all, or mark it as placed), or move it"
        if kind == "source" and part.source in ("consensus", "adopted"):
            return f"Taken from {part.adopted_from}" if part.adopted_from else "Proposed from all annotators"
        if kind == "number":
            return self._number_tooltip(part, column)
        if kind == "residual" and (residual_um := self._residual_um(part)) is not None:
            return f"{residual_um:.1f} µm. {self._columns[column].explanation}"
        return self._text(part, column) if kind == "name" else self._columns[column].explanation

    def _accessible_text(self, part: P, column: int) -> str:
        match self._columns[column].kind:
            case "clear":
                return f"Clear {part.name}"
            case "sure":
                return part.certainty
            case "lock":
                return "locked" if part.locked else "not locked"
        return self._text(part, column)

    def _part(self, row: int) -> P:
        return self._shown[row]

    def _look_up(self) -> tuple[tuple[P, ...], frozenset[str]]:
        """Return the parts as shown, and the names of those that the document does not have like that yet."""
        document, shown = self._session.document, self._session.shown_document
        if document is None or shown is None:
            return (), frozenset()
        parts = self._parts_of(shown)
        if shown is document:
            return parts, frozenset()
        kept = self._parts_of(document)
        return parts, frozenset(part.name for part, old in zip(parts, kept, strict=True) if part != old)

    def _look_around(self) -> object:
        """Return what rows are drawn from besides the parts, the unit and what is active."""
        session = self._session
        shape = session.volume.shape if session.volume is not None else None
        return session.tool, session.spacing_um, shape, session.read_only_reason

    def _follow(self, ask: Callable[[], None] | None = None) -> None:
        """Hold what the session shows now; only what differs is drawn again, once the scene has been."""
        known, were_coming = self._shown, self._coming
        shown, coming = self._look_up()
        if [part.name for part in shown] != [part.name for part in known]:
            self._reset()
            return
        self._shown, self._coming = shown, coming
        if shown is not known or coming != were_coming:
            changed = coming ^ were_coming
            for row, (part, was) in enumerate(zip(shown, known, strict=True)):
                if part.name in changed or not _says_the_same(part, was):
                    self._rows_owed.add(row)
                elif part != was:
                    self._numbers_owed.add(row)
            (ask or self._redrawing.ask)()

    def _announce(self) -> None:
        """Announce what has changed since this was done last."""
        rows, numbers = self._rows_owed, self._numbers_owed - self._rows_owed
        self._rows_owed, self._numbers_owed = set(), set()
        self._redraw(sorted(rows))
        for row in sorted(numbers):
            self._redraw_cells(row, "number")
        self._follow_fit()

    def _follow_fit(self) -> None:
        """Show what the fit leaves now: one part that moves takes the residuals of all along."""
        known, self._residuals_um = self._residuals_um, [self._residual_um(part) for part in self._shown]
        for row, residual_um in enumerate(self._residuals_um):
            if residual_um != known[row]:
                self._redraw_cells(row, "residual")

    def _redraw_cells(self, row: int, kind: ColumnKind) -> None:
        # One by one: of a range, Qt also paints the row and the column that follow.
        for column in self.columns_of(kind):
            index = self.index(row, column)
            self.dataChanged.emit(index, index)

    def _reset(self) -> None:
        self._redrawing.drop()
        self._rows_owed, self._numbers_owed = set(), set()
        self.beginResetModel()
        self._shown, self._coming = self._look_up()
        self._residuals_um = [self._residual_um(part) for part in self._shown]
        self._around = self._look_around()
        self.endResetModel()

    @Slot(object, object)
    def _on_session_document_changed(self, before: object, after: object) -> None:
        self._follow()
        if before is after:
            # What can be changed in it is another thing now.
            self._around = self._look_around()
            self._redraw(range(len(self._shown)))

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        self._follow()
        if before.active_part != after.active_part:
            rows = map(self.row, (before.active_part, after.active_part))
            self._redraw(row for row in rows if row is not None)

    @Slot()
    def _on_session_volume_changed(self) -> None:
        # From one volume of a study to the next nothing but numbers differs, as a rule.
        if self._look_around() == self._around:
            self._follow(self._redrawing.ask_apart)
        else:
            self._reset()


def _says_the_same(part: Part, other: Part) -> bool:
    """Say whether two parts differ in no more than where they are."""
    return all(getattr(part, field) == getattr(other, field) for field in _SAID)


def _italic_font() -> QFont:
    font = QFont()
    font.setItalic(True)
    return font


def _short(residual_um: float) -> str:
    """Write a residual in four digits at most: what is farther off than a centimetre is wrong anyway."""
    return f"{residual_um:.0f}" if residual_um < 9999.5 else f"{residual_um / 1000:.0f}k"
