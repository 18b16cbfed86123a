"""The keypoints of the open document as a table that asks the session for every change."""

from enum import IntEnum
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt, Signal, Slot
from PySide6.QtGui import QColor, QFont, QGuiApplication, QIcon, QPainter, QPixmap

from annotations.documents.annotation import Annotation, KeypointAnnotation
from annotations.geometry.frames import Vector, is_inside, um_to_voxel
from annotator.looks import theme
from annotator.looks.icons import icon
from annotator.looks.typed_numbers import NotUnderstood, Unit, parse_length_um, split_triple
from annotator.session import Session
from annotator.session.view import View

Index = QModelIndex | QPersistentModelIndex
_ROOT = QModelIndex()
_KEYS = 9


class Column(IntEnum):
    """What a column shows."""

    KEYPOINT = 0
    X = 1
    Y = 2
    Z = 3
    STATE = 4
    SURE = 5
    LOCK = 6
    CLEAR = 7
    SOURCE = 8


COORDINATES = (Column.X, Column.Y, Column.Z)
_TITLES = ("Name", "x", "y", "z", "State", "Sure", "Lock", "", "Source")
_ICONS = {Column.SURE: "sure", Column.LOCK: "lock"}
_EXPLANATIONS = (
    "Name, and where on the tool it is; the number is the key that makes it active",
    "Position along x; type a value, or three at once",
    "Position along y; type a value, or three at once",
    "Position along z; type a value, or three at once",
    "How it is seen: placed, occluded, out of view, or unplaced (which removes its position)",
    "Whether you are sure of the position",
    "A locked keypoint refuses every change",
    "Remove the position",
    "How the position came about",
)
SHORT_STATES = {"occluded": "occl.", "out of view": "out", "unplaced": "–"}
"""Where there is no room for the words."""

STATES = ("placed", "occluded", "out_of_view", "unplaced")


class KeypointsModel(QAbstractTableModel):
    """One row a keypoint; positions in µm or voxels, a preview in place of the document's position.

    Signals
    -------
    not_understood : str
        Typed text was refused, and why; nothing has changed.
    """

    not_understood = Signal(str)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._unit: Unit = "um"
        self._document = session.document
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)

    @property
    def unit(self) -> Unit:
        """In what positions are shown, and what a bare typed number means."""
        return self._unit

    def set_unit(self, unit: Unit) -> None:
        """Show positions in µm or in voxels."""
        if unit != self._unit:
            self._unit = unit
            self._redraw(range(self.rowCount()))
            self.headerDataChanged.emit(Qt.Orientation.Horizontal, Column.X, Column.Z)

    def name(self, row: int) -> str:
        """Return the name of the keypoint in a row."""
        return self._keypoint(row).name

    def row(self, name: str | None) -> int | None:
        """Return the row of a keypoint, or None."""
        names = [keypoint.name for keypoint in self._keypoints()]
        return names.index(name) if name in names else None

    def rowCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(self._keypoints())

    def columnCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(Column)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation == Qt.Orientation.Vertical:
            if role == Qt.ItemDataRole.DisplayRole:
                return str(section + 1) if section < _KEYS else ""
            if role == Qt.ItemDataRole.ToolTipRole and section < _KEYS:
                return f"Key {section + 1} makes {self.name(section)} the active keypoint"
            return None
        column = Column(section)
        if role == Qt.ItemDataRole.DisplayRole:
            unit = {"um": "µm", "voxel": "vox"}[self._unit]
            if column in COORDINATES:
                return f"{_TITLES[column]} / {unit}"
            return "" if column in _ICONS else _TITLES[column]
        if role == Qt.ItemDataRole.DecorationRole and column in _ICONS:
            return icon(_ICONS[column], QGuiApplication.palette())
        if role == Qt.ItemDataRole.AccessibleTextRole:
            return "Clear" if column == Column.CLEAR else _TITLES[column]
        if role == Qt.ItemDataRole.ToolTipRole:
            return _EXPLANATIONS[column]
        if role == Qt.ItemDataRole.TextAlignmentRole:
            if column == Column.STATE or column in _ICONS:
                return Qt.AlignmentFlag.AlignCenter
            side = Qt.AlignmentFlag.AlignRight if column in COORDINATES else Qt.AlignmentFlag.AlignLeft
            return side | Qt.AlignmentFlag.AlignVCenter
        if role == Qt.ItemDataRole.ForegroundRole and column in COORDINATES:
            return theme.colors(QGuiApplication.palette()).axes[column - Column.X]
        return None

    def flags(self, index: Index) -> Qt.ItemFlag:
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        flags = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
        keypoint = self._keypoint(index.row())
        column = Column(index.column())
        if column == Column.LOCK:
            return flags | Qt.ItemFlag.ItemIsUserCheckable
        if keypoint.locked:
            return flags
        if column == Column.SURE:
            return flags | Qt.ItemFlag.ItemIsUserCheckable
        if column == Column.STATE or column in COORDINATES:
            return flags | Qt.ItemFlag.ItemIsEditable
        return flags

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        keypoint, column = self._keypoint(index.row()), Column(index.column())
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return self._text(keypoint, column)
            case Qt.ItemDataRole.EditRole:
                return self._edit_text(keypoint, column)
            case Qt.ItemDataRole.CheckStateRole if column in (Column.SURE, Column.LOCK):
                checked = keypoint.certainty == "sure" if column == Column.SURE else keypoint.locked
                return Qt.CheckState.Checked if checked else Qt.CheckState.Unchecked
            case Qt.ItemDataRole.DecorationRole if column == Column.KEYPOINT:
                return _swatch(self._color(keypoint.name), hollow=keypoint.state == "unplaced")
            case Qt.ItemDataRole.TextAlignmentRole if column in COORDINATES:
                return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            case Qt.ItemDataRole.TextAlignmentRole if column == Column.STATE:
                return Qt.AlignmentFlag.AlignCenter
            case Qt.ItemDataRole.ForegroundRole:
                return self._foreground(keypoint, column)
            case Qt.ItemDataRole.FontRole:
                return self._font(keypoint, column)
            case Qt.ItemDataRole.ToolTipRole:
                return self._tooltip(keypoint, column)
            case Qt.ItemDataRole.AccessibleTextRole:
                return self._accessible_text(keypoint, column)
        return None

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        if not index.isValid():
            return False
        keypoint, column = self._keypoint(index.row()), Column(index.column())
        if role == Qt.ItemDataRole.CheckStateRole:
            checked = Qt.CheckState(value) == Qt.CheckState.Checked
            if column == Column.SURE:
                self._session.set_certainty(keypoint.name, "sure" if checked else "unsure")
            elif column == Column.LOCK:
                self._session.set_locked(keypoint.name, checked)
            return column in (Column.SURE, Column.LOCK)
        if role != Qt.ItemDataRole.EditRole:
            return False
        if column == Column.STATE:
            if value != keypoint.state:
                self._session.set_state(keypoint.name, value)
            return True
        if column in COORDINATES:
            return self._type(keypoint, column, str(value))
        return False

    def refusal(self, row: int, column: int, text: str) -> str:
        """Say what is wrong with text typed into a coordinate's cell; empty if nothing is."""
        keypoint = self._keypoint(row)
        if text == self._edit_text(keypoint, Column(column)):
            return ""
        try:
            self._read(keypoint, Column(column), text)
        except NotUnderstood as error:
            return str(error)
        return ""

    def _type(self, keypoint: KeypointAnnotation, column: Column, text: str) -> bool:
        # What is shown is rounded; leaving it as it is must not round the position.
        if text == self._edit_text(keypoint, column):
            return True
        try:
            position_um = self._read(keypoint, column, text)
        except NotUnderstood as error:
            self.not_understood.emit(f"{keypoint.name}: {error}. Nothing was changed.")
            return False
        self._session.type_position(keypoint.name, position_um)
        return True

    def _read(self, keypoint: KeypointAnnotation, column: Column, text: str) -> Vector:
        spacing_um = self._session.spacing_um
        if spacing_um is None:
            raise NotUnderstood("No volume is open")
        triple = split_triple(text)
        if triple is not None:
            x, y, z = (
                parse_length_um(part, self._unit, step) for part, step in zip(triple, spacing_um, strict=True)
            )
            return (x, y, z)
        # An unplaced keypoint takes the coordinates that are not typed from where the slices meet.
        position_um = list(self._position_um(keypoint.name) or self._session.view.crosshair_um)
        axis = column - Column.X
        position_um[axis] = parse_length_um(text, self._unit, spacing_um[axis])
        return (position_um[0], position_um[1], position_um[2])

    def _text(self, keypoint: KeypointAnnotation, column: Column) -> str:
        if column == Column.KEYPOINT:
            label = self._label(keypoint.name)
            return f"{keypoint.name}  {label}" if label else keypoint.name
        if column == Column.STATE:
            return keypoint.state.replace("_", " ")
        if column == Column.SOURCE:
            preview = self._session.view.preview
            if preview is not None and preview.keypoint == keypoint.name:
                return f"{preview.source}…"
            return keypoint.source or ""
        if column in COORDINATES:
            return self._coordinate(keypoint, column, decimals=0 if self._unit == "um" else 1) or "—"
        return ""

    def _edit_text(self, keypoint: KeypointAnnotation, column: Column) -> str:
        if column == Column.STATE:
            return keypoint.state
        if column == Column.KEYPOINT:
            return keypoint.name
        return self._coordinate(keypoint, column, decimals=3) if column in COORDINATES else ""

    def _coordinate(self, keypoint: KeypointAnnotation, column: Column, decimals: int) -> str:
        position_um, spacing_um = self._position_um(keypoint.name), self._session.spacing_um
        if position_um is None or spacing_um is None:
            return ""
        shown = position_um if self._unit == "um" else um_to_voxel(position_um, spacing_um)
        # Adding zero turns −0.0 into 0.0.
        return f"{round(float(shown[column - Column.X]), decimals) + 0.0:.{decimals}f}"

    def _foreground(self, keypoint: KeypointAnnotation, column: Column) -> QColor | None:
        colors = theme.colors(QGuiApplication.palette())
        if column in COORDINATES and self._is_outside(keypoint.name):
            return colors.outside
        if column == Column.SOURCE or (column != Column.KEYPOINT and keypoint.state == "unplaced"):
            return colors.muted
        return None

    def _font(self, keypoint: KeypointAnnotation, column: Column) -> QFont | None:
        view = self._session.view
        font = QFont()
        font.setBold(column == Column.KEYPOINT and keypoint.name == view.active_part)
        font.setItalic(
            column in (*COORDINATES, Column.SOURCE)
            and view.preview is not None
            and view.preview.keypoint == keypoint.name
        )
        return font if font.bold() or font.italic() else None

    def _tooltip(self, keypoint: KeypointAnnotation, column: Column) -> str | None:
        if column == Column.LOCK:
            return "Unlock it to change it" if keypoint.locked else "Lock it against every change"
        if keypoint.locked:
            return f"{keypoint.name} is locked: unlock it to change it"
        if column in COORDINATES:
            if self._position_um(keypoint.name) is None:
                return "Not placed yet. A typed value takes the other two from the crosshair."
            if self._is_outside(keypoint.name):
                return "This position is outside the volume, which is allowed."
            unit = "µm" if self._unit == "um" else "voxels"
            came = f", {keypoint.source}" if keypoint.source else ""
            return f"{self._coordinate(keypoint, column, decimals=3)} {unit}{came}"
        if column == Column.KEYPOINT:
            return self._text(keypoint, column)
        return _EXPLANATIONS[column]

    def _accessible_text(self, keypoint: KeypointAnnotation, column: Column) -> str:
        if column == Column.CLEAR:
            return f"Clear {keypoint.name}"
        if column == Column.SURE:
            return keypoint.certainty
        if column == Column.LOCK:
            return "locked" if keypoint.locked else "not locked"
        return self._text(keypoint, column)

    def _keypoints(self) -> tuple[KeypointAnnotation, ...]:
        return () if self._document is None else self._document.keypoints

    def _keypoint(self, row: int) -> KeypointAnnotation:
        return self._keypoints()[row]

    def _position_um(self, name: str) -> Vector | None:
        return self._session.shown_positions_um().get(name)

    def _is_outside(self, name: str) -> bool:
        position_um, volume = self._position_um(name), self._session.volume
        spacing_um = self._session.spacing_um
        if position_um is None or volume is None or spacing_um is None:
            return False
        return not is_inside(position_um, volume.shape, spacing_um)

    def _label(self, name: str) -> str:
        tool = self._session.tool
        if tool is None:
            return ""
        return next((keypoint.label for keypoint in tool.keypoints if keypoint.name == name), "")

    def _color(self, name: str) -> QColor:
        link = self._session.tool.link_of(name) if self._session.tool is not None else None
        return QColor(link.color) if link is not None else theme.colors(QGuiApplication.palette()).muted

    @Slot(object, object)
    def _on_session_document_changed(self, before: Annotation | None, after: Annotation | None) -> None:
        if _names(before) != _names(after) or _names(self._document) != _names(after):
            self._reset()
            return
        known = self._keypoints()
        self._document = after
        self._redraw([row for row, keypoint in enumerate(self._keypoints()) if keypoint != known[row]])

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        touched: set[str | None] = set()
        if before.active_part != after.active_part:
            touched |= {before.active_part, after.active_part}
        if before.preview != after.preview:
            touched |= {
                preview.keypoint for preview in (before.preview, after.preview) if preview is not None
            }
        self._redraw(row for row in map(self.row, touched) if row is not None)

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._reset()

    def _reset(self) -> None:
        self.beginResetModel()
        self._document = self._session.document
        self.endResetModel()

    def _redraw(self, rows: Any) -> None:
        for row in rows:
            self.dataChanged.emit(self.index(row, 0), self.index(row, self.columnCount() - 1))


def _names(document: Annotation | None) -> tuple[str, ...]:
    return () if document is None else tuple(keypoint.name for keypoint in document.keypoints)


def _swatch(color: QColor, *, hollow: bool) -> QIcon:
    """Return a disc in a link's colour; a ring for a keypoint that is not placed."""
    side = 32
    pixmap = QPixmap(side, side)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    pen = painter.pen()
    pen.setColor(color)
    pen.setWidth(4)
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush if hollow else color)
    painter.drawEllipse(5, 5, side - 10, side - 10)
    painter.end()
    return QIcon(pixmap)
