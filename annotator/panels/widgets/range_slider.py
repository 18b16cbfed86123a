"""A slider with two handles: a part of a whole."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget


class RangeSlider(QWidget):
    """A part, between 0 and 1, of a whole; for the mouse alone: the boxes beside it take the keyboard.

    Signals
    -------
    range_requested : float, float
        Dragged by a person, never by `set_range`.
    """

    range_requested = Signal(float, float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._low, self._high = 0.0, 1.0
        self._drags_high: bool | None = None

    def sizeHint(self) -> QSize:
        return QSize(120, self._side() + 6)

    def minimumSizeHint(self) -> QSize:
        return QSize(40, self._side() + 6)

    def set_range(self, low: float, high: float) -> None:
        """Show a part of the whole."""
        if (low, high) != (self._low, self._high):
            self._low, self._high = low, high
            self.update()

    def x_of(self, fraction: float) -> float:
        """Return where a fraction's handle has its centre, in pixels from the left."""
        return self._side() / 2 + fraction * (self.width() - self._side())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            super().mousePressEvent(event)
            return
        x = event.position().x()
        to_low, to_high = abs(x - self.x_of(self._low)), abs(x - self.x_of(self._high))
        # Where both handles are at one place, the side of the press decides.
        self._drags_high = to_high < to_low or (to_high == to_low and x > self.x_of(self._high))
        self._drag(x)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._drags_high is not None:
            self._drag(event.position().x())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._drags_high = None

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, middle, side = self.palette(), self.height() / 2, self._side()
        accent = palette.highlight().color() if self.isEnabled() else palette.mid().color()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(palette.midlight() if palette.window().color().lightness() < 128 else palette.mid())
        painter.drawRoundedRect(QRectF(side / 2, middle - 2, self.width() - side, 4), 2, 2)
        low, high = self.x_of(self._low), self.x_of(self._high)
        painter.setBrush(accent)
        painter.drawRoundedRect(QRectF(low, middle - 2, high - low, 4), 2, 2)
        painter.setPen(QPen(accent, 1.5))
        painter.setBrush(palette.button())
        for x in (low, high):
            painter.drawEllipse(QPointF(x, middle), side / 2 - 1, side / 2 - 1)

    def _drag(self, x: float) -> None:
        fraction = (x - self._side() / 2) / max(self.width() - self._side(), 1)
        fraction = min(max(fraction, 0.0), 1.0)
        if self._drags_high:
            self.range_requested.emit(self._low, max(fraction, self._low))
        else:
            self.range_requested.emit(min(fraction, self._high), self._high)

    def _side(self) -> int:
        return self.fontMetrics().height()
