"""A row that is laid out without the window around it."""

from PySide6.QtCore import QEvent, QSize
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QWidget


class LaidOutApart(QWidget):
    """Widgets in a row, whose changes lay nothing out but the row: the numbers under a cursor that moves.

    Of a label with another text Qt tells the layout around it, and that tells the next one, up to that of the
    window, which asks all its docks how small they can be. Only a widget without a layout ends it: this one.
    The window hears of it where the row would be cut off: where it needs more width than ever before. The row
    is as tall as the tallest of its widgets, shown or not.

    Attributes
    ----------
    row : QHBoxLayout
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._inside = QWidget(self)
        self._width_px = 0
        self.row = QHBoxLayout(self._inside)
        self.row.setContentsMargins(0, 0, 0, 0)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def widgets(self) -> list[QWidget]:
        """Return what is in the row, shown or not."""
        return [child for child in self._inside.children() if isinstance(child, QWidget)]

    def sizeHint(self) -> QSize:
        height_px = max((widget.sizeHint().height() for widget in self.widgets()), default=0)
        return QSize(self._width_px, height_px)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.LayoutRequest and self.row.minimumSize().width() > self._width_px:
            self._claim()
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._inside.setGeometry(self.rect())

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._claim()

    def _claim(self) -> None:
        self._width_px = self.row.minimumSize().width()
        self.updateGeometry()
