"""The volumes to annotate as a list: label, and status in words and as a mark."""

from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, QPointF, Qt, Slot
from PySide6.QtGui import QColor, QFont, QGuiApplication, QIcon, QPainter, QPen, QPixmap

from annotator.looks import theme
from annotator.session import Session
from annotator.session.worklist import ItemStatus

Index = QModelIndex | QPersistentModelIndex
_ROOT = QModelIndex()
_WORDS: dict[ItemStatus, str] = {"new": "new", "in_progress": "in progress", "done": "done"}


class WorklistModel(QAbstractTableModel):
    """The session's items: label, and status in words and as a mark."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._items = session.items
        self._current = session.current_index
        session.worklist_changed.connect(self._on_session_worklist_changed)

    def labels(self) -> tuple[str, ...]:
        """Return the names of all the volumes."""
        return tuple(item.label for item in self._items)

    def rowCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else len(self._items)

    def columnCount(self, parent: Index = _ROOT) -> int:
        return 0 if parent.isValid() else 2

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        if orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return ("Volume", "Status")[section]
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        item, status = self._items[index.row()], index.column() == 1
        is_current = index.row() == self._current
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return _WORDS[item.status] if status else item.label
            case Qt.ItemDataRole.AccessibleTextRole:
                return _WORDS[item.status] if status else f"{item.label}{', open' if is_current else ''}"
            case Qt.ItemDataRole.DecorationRole if not status:
                return _mark(item.status)
            case Qt.ItemDataRole.ForegroundRole if status:
                return _color(item.status)
            case Qt.ItemDataRole.FontRole if is_current:
                font = QFont()
                font.setBold(True)
                return font
            case Qt.ItemDataRole.ToolTipRole:
                return f"{item.label}\n{item.volume_path}\nAnnotation: {item.annotation_path}"
        return None

    @Slot()
    def _on_session_worklist_changed(self) -> None:
        before, was_current = self._items, self._current
        items, current = self._session.items, self._session.current_index
        if [item.volume_path for item in before] != [item.volume_path for item in items] or len(before) == 0:
            self.beginResetModel()
            self._items, self._current = items, current
            self.endResetModel()
            return
        self._items, self._current = items, current
        rows = {row for row, item in enumerate(items) if item != before[row]}
        if current != was_current:
            rows |= {row for row in (was_current, current) if row is not None}
        for row in sorted(rows):
            self.dataChanged.emit(self.index(row, 0), self.index(row, 1))


def _color(status: ItemStatus) -> QColor:
    colors = theme.colors(QGuiApplication.palette())
    return {"new": colors.muted, "in_progress": colors.warning, "done": colors.success}[status]


def _mark(status: ItemStatus) -> QIcon:
    """Return a ring, a half-filled ring or a ticked disc: told apart without colour."""
    palette = QGuiApplication.palette()
    icon = QIcon(_mark_pixmap(status, _color(status), palette.base().color()))
    selected = _mark_pixmap(status, palette.highlightedText().color(), palette.highlight().color())
    icon.addPixmap(selected, QIcon.Mode.Selected)
    return icon


def _mark_pixmap(status: ItemStatus, color: QColor, ground: QColor) -> QPixmap:
    side = 32
    pixmap = QPixmap(side, side)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(color, 3))
    if status == "done":
        painter.setBrush(color)
    painter.drawEllipse(4, 4, side - 8, side - 8)
    if status == "in_progress":
        painter.setBrush(color)
        painter.drawPie(4, 4, side - 8, side - 8, 90 * 16, -180 * 16)
    elif status == "done":
        painter.setPen(QPen(ground, 4, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawPolyline([QPointF(10, 16.5), QPointF(14.5, 21), QPointF(22.5, 12)])
    painter.end()
    return pixmap
