"""The volumes to annotate as a list: status as a mark, label, flag, and the time spent."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from PySide6.QtCore import QObject, QPointF, Qt, Slot
from PySide6.QtGui import QColor, QFontMetrics, QGuiApplication, QIcon, QPainter, QPen, QPixmap

from annotator.looks import theme
from annotator.looks.durations import duration
from annotator.panels.widgets.name_elision import shared_beginning
from annotator.panels.widgets.table_model import RIGHT, Heading, Index, TableModel, bold_font
from annotator.session import Session
from annotator.session.remembered import Remembered
from annotator.session.volumes.worklist import ItemStatus, WorkItem

_WORDS: dict[ItemStatus, str] = {"new": "to do", "in_progress": "in progress", "done": "done"}
_COLUMNS = (
    Heading("Volume", ""),
    Heading("", "Flag"),
    Heading("", "Predicted by the checkpoint in use"),
    Heading("Time", "Time spent at work, in minutes and seconds"),
)
VOLUME, FLAG, PREDICTED, TIME = range(len(_COLUMNS))


def status_words(status: ItemStatus) -> str:
    """Return what a status is called."""
    return _WORDS[status]


class WorklistModel(TableModel):
    """The session's items in their order; in blind work nothing tells which volume one is."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._items = session.items
        self._current = session.current_index
        self._shared: Remembered[str] = Remembered()
        self._icons: dict[object, QIcon] = {}
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.predicted_volumes.changed.connect(self._on_session_predicted_volumes_changed)

    def shared_beginning(self) -> str:
        """Return what the names of all the volumes begin with."""
        return self._shared.result(_shared_beginning, self._items)

    def widest_time(self, metrics: QFontMetrics) -> int:
        """Return the width in pixels of the longest time."""
        times = {_time(item) for item in self._items}
        return max((metrics.horizontalAdvance(time) for time in times), default=0)

    def item(self, row: int) -> WorkItem:
        """Return what a row is about."""
        return self._items[row]

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        # The headings of marks have no words, for there is no room for them.
        is_read_out = role == Qt.ItemDataRole.AccessibleTextRole and section in (FLAG, PREDICTED)
        return super().headerData(section, orientation, Qt.ItemDataRole.ToolTipRole if is_read_out else role)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        if not index.isValid():
            return None
        item, column = self._items[index.row()], index.column()
        is_current = index.row() == self._current
        match role:
            case Qt.ItemDataRole.DisplayRole:
                return (item.label, "", "", _time(item))[column]
            case Qt.ItemDataRole.AccessibleTextRole:
                named = f"{item.label}, {self._words(item)}{', open' if is_current else ''}"
                return (named, _flag_words(item), self._predicted_words(item), _time(item))[column]
            case Qt.ItemDataRole.DecorationRole if column == VOLUME:
                return self._icon(partial(_mark, item.status), item.status)
            case Qt.ItemDataRole.DecorationRole if column == FLAG and item.flag is not None:
                return self._icon(_flag, FLAG)
            case Qt.ItemDataRole.DecorationRole if column == PREDICTED:
                is_predicted = self._session.predicted_volumes.has(item)
                return self._icon(_predicted, PREDICTED) if is_predicted else None
            case Qt.ItemDataRole.TextAlignmentRole if column == TIME:
                return RIGHT
            case Qt.ItemDataRole.FontRole if is_current:
                return bold_font()
            case Qt.ItemDataRole.ToolTipRole:
                return self._tool_tip(item)
        return None

    def _row_count(self) -> int:
        return len(self._items)

    def _headings(self) -> Sequence[Heading]:
        return _COLUMNS

    def _words(self, item: WorkItem) -> str:
        # Nobody expects annotations of their own of whoever reviews.
        is_looked_at = item.status == "new" and self._session.worklist.is_review
        return "for review" if is_looked_at else _WORDS[item.status]

    def _tool_tip(self, item: WorkItem) -> str:
        lines = [f"{item.label}: {self._words(item)}"]
        if not self._session.is_blind:
            lines += [str(item.volume_path), f"Annotation: {item.annotation_path}"]
        if item.flag is not None:
            lines.append(_flag_words(item))
        if words := self._predicted_words(item):
            lines.append(words)
        if item.active_seconds:
            lines.append(f"{_time(item)} at work")
        return "\n".join(lines)

    def _predicted_words(self, item: WorkItem) -> str:
        predicted = self._session.predicted_volumes
        return f"Predicted by {predicted.checkpoint_name}" if predicted.has(item) else ""

    def _icon(self, make: Callable[[], QIcon], key: object) -> QIcon:
        # Each row that is drawn asks for some; another palette needs others.
        drawn_for = (key, QGuiApplication.palette().cacheKey())
        if drawn_for not in self._icons:
            self._icons[drawn_for] = make()
        return self._icons[drawn_for]

    @Slot()
    def _on_session_worklist_changed(self) -> None:
        before, was_current = self._items, self._current
        items, current = self._session.items, self._session.current_index
        if not before or not _are_same(before, items):
            self.beginResetModel()
            self._items, self._current = items, current
            self.endResetModel()
            return
        self._items, self._current = items, current
        pairs = zip(before, items, strict=True)
        rows = {row for row, (was, item) in enumerate(pairs) if item is not was and item != was}
        if current != was_current:
            rows |= {row for row in (was_current, current) if row is not None}
        self._redraw(sorted(rows))

    @Slot()
    def _on_session_predicted_volumes_changed(self) -> None:
        if self._items:
            self.dataChanged.emit(self.index(0, 0), self.index(len(self._items) - 1, PREDICTED))


def _are_same(before: Sequence[WorkItem], items: Sequence[WorkItem]) -> bool:
    """Say whether two lists are of the same volumes, under the same names."""
    # Nearly always nearly all are the very same ones.
    return len(before) == len(items) and all(
        was is item or (was.label, was.place) == (item.label, item.place)
        for was, item in zip(before, items, strict=True)
    )


def _shared_beginning(items: Sequence[WorkItem]) -> str:
    return shared_beginning([item.label for item in items])


def _time(item: WorkItem) -> str:
    return duration(item.active_seconds) if item.active_seconds >= 1 else ""


def _flag_words(item: WorkItem) -> str:
    return "" if item.flag is None else f"Flagged: {item.flag}"


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


def _flag() -> QIcon:
    return _two_colored(_flag_pixmap, theme.colors(QGuiApplication.palette()).warning)


def _predicted() -> QIcon:
    return _two_colored(_predicted_pixmap, theme.colors(QGuiApplication.palette()).muted)


def _two_colored(draw: Callable[[QColor], QPixmap], color: QColor) -> QIcon:
    """Return an icon that has a colour of its own, and that of the text where its row is selected."""
    icon = QIcon(draw(color))
    icon.addPixmap(draw(QGuiApplication.palette().highlightedText().color()), QIcon.Mode.Selected)
    return icon


def _predicted_pixmap(color: QColor) -> QPixmap:
    """Return a cross, as predictions are drawn over the images."""
    pixmap = QPixmap(32, 32)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(color, 4, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
    painter.drawLine(9, 9, 23, 23)
    painter.drawLine(9, 23, 23, 9)
    painter.end()
    return pixmap


def _flag_pixmap(color: QColor) -> QPixmap:
    pixmap = QPixmap(32, 32)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(color, 3, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin))
    painter.drawLine(8, 5, 8, 28)
    painter.setBrush(color)
    painter.drawPolygon([QPointF(8, 6), QPointF(25, 6), QPointF(20, 12), QPointF(25, 18), QPointF(8, 18)])
    painter.end()
    return pixmap


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
