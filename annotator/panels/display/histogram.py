"""How often each intensity occurs, drawn with the limits of the window to drag."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from annotations.volumes import evenly_sampled
from annotator.looks import theme

_BINS = 128
_SAMPLES = 500_000
_REACH_PX = 6

Grip = Literal["low", "high", "both", "threshold"]


@dataclass(frozen=True, eq=False)
class IntensityHistogram:
    """Counts in equal bins from ``low`` to ``high``, which differ.

    Attributes
    ----------
    counts : numpy.ndarray
        Shape (n,), of a sample of the finite intensities.
    low, high : float
        Range of the intensities: that of the type for 8 bits, else of the data.
    integral : bool
        Whether intensities are whole numbers.
    """

    counts: NDArray[np.int64]
    low: float
    high: float
    integral: bool

    @property
    def step(self) -> float:
        """A change of intensity that is worth making."""
        return 1.0 if self.integral else (self.high - self.low) / 500


EMPTY = IntensityHistogram(np.zeros(1, np.int64), 0.0, 255.0, True)


def intensity_histogram(data: NDArray[Any]) -> IntensityHistogram:
    """Count the finite intensities of an array, every so many voxels of a large one."""
    sample = evenly_sampled(data, _SAMPLES)
    if sample.dtype == np.uint8:
        # Counting bytes, and then the 256 values into bins, takes a tenth of the time.
        counts, _ = np.histogram(np.arange(256), _BINS, (0, 255), weights=np.bincount(sample, minlength=256))
        return IntensityHistogram(counts, 0.0, 255.0, True)
    # Doubles, because single precision cannot part a narrow range of large values into bins.
    finite = sample[np.isfinite(sample)].astype(np.float64)
    if not finite.size:
        return EMPTY
    integral = data.dtype.kind in "iu"
    if data.dtype.itemsize == 1:
        limits = np.iinfo(data.dtype)
        low, high = float(limits.min), float(limits.max)
    else:
        low, high = float(finite.min()), float(finite.max())
    if low == high:
        room = max(0.5, abs(low) * 1e-6)
        low, high = low - room, high + room
    counts, _ = np.histogram(finite, _BINS, (low, high))
    return IntensityHistogram(counts, low, high, integral)


class HistogramView(QWidget):
    """The histogram with both limits of the window; a limit, or the part between them, is dragged.

    Signals
    -------
    window_requested : float, float
    threshold_requested : float
    """

    window_requested = Signal(float, float)
    threshold_requested = Signal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("histogram")
        self.setAccessibleName("Histogram of the intensities")
        self.setToolTip(
            "How often each intensity occurs. Drag a limit of the window, the part between them, "
            "or the dotted opacity threshold"
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setMouseTracking(True)
        self._histogram = EMPTY
        self._window = (0.0, 255.0)
        self._threshold = 0.0
        self._grip: Grip | None = None
        self._pressed_at = 0.0
        self._pressed_window = self._window

    def sizeHint(self) -> QSize:
        return QSize(240, self.fontMetrics().height() * 4)

    def minimumSizeHint(self) -> QSize:
        return QSize(120, self.fontMetrics().height() * 4)

    def set_histogram(self, histogram: IntensityHistogram) -> None:
        """Draw another volume's intensities."""
        self._histogram = histogram
        self.update()

    def set_limits(self, window: tuple[float, float], threshold: float) -> None:
        """Draw the limits where the view has them."""
        if (window, threshold) != (self._window, self._threshold):
            self._window, self._threshold = window, threshold
            self.update()

    def x_of(self, intensity: float) -> float:
        """Return where an intensity is drawn, in pixels from the left; limits outside are at the edge."""
        fraction = (intensity - self._histogram.low) / (self._histogram.high - self._histogram.low)
        return _REACH_PX + min(max(fraction, 0.0), 1.0) * self._room()

    def intensity_at(self, x: float) -> float:
        """Return the intensity drawn at a number of pixels from the left."""
        fraction = (x - _REACH_PX) / self._room()
        return self._histogram.low + fraction * (self._histogram.high - self._histogram.low)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton:
            super().mousePressEvent(event)
            return
        self._grip = self._grip_at(event.position())
        self._pressed_at = self.intensity_at(event.position().x())
        self._pressed_window = self._window

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._grip is None:
            over = self._grip_at(event.position())
            shapes = {
                None: Qt.CursorShape.ArrowCursor,
                "both": Qt.CursorShape.OpenHandCursor,
            }
            self.setCursor(shapes.get(over, Qt.CursorShape.SizeHorCursor))
            return
        intensity = self.intensity_at(event.position().x())
        low, high = self._pressed_window
        step = self._histogram.step
        if self._grip == "threshold":
            self.threshold_requested.emit(intensity)
        elif self._grip == "low":
            self.window_requested.emit(min(intensity, high - step), high)
        elif self._grip == "high":
            self.window_requested.emit(low, max(intensity, low + step))
        else:
            moved = intensity - self._pressed_at
            self.window_requested.emit(low + moved, high + moved)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._grip = None

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette = self.palette()
        area = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.setPen(QPen(palette.mid().color()))
        painter.setBrush(palette.base())
        painter.drawRoundedRect(area, 3, 3)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colors(palette).muted)
        painter.drawPolygon(self._outline())
        low, high = (self.x_of(limit) for limit in self._window)
        veil = QColor(palette.highlight().color())
        veil.setAlpha(50)
        painter.fillRect(QRectF(low, 1, max(high - low, 1), self.height() - 2), veil)
        for x in (low, high):
            self._draw_limit(painter, x)
        threshold = self.x_of(self._threshold)
        painter.setPen(QPen(theme.colors(palette).warning, 1.5, Qt.PenStyle.DotLine))
        painter.drawLine(QPointF(threshold, 1), QPointF(threshold, self.height() - 1))

    def _draw_limit(self, painter: QPainter, x: float) -> None:
        accent = self.palette().highlight().color()
        painter.setPen(QPen(accent, 2))
        painter.drawLine(QPointF(x, 1), QPointF(x, self.height() - 1))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(accent)
        painter.drawRoundedRect(QRectF(x - 3.5, self.height() - 13, 7, 12), 2, 2)

    def _outline(self) -> QPolygonF:
        # Logarithmic: speckle and background outnumber the tool by far.
        heights = np.log1p(self._histogram.counts)
        top = max(float(heights.max(initial=0)), math.log(2))
        bottom, room = self.height() - 1.0, self.height() - 6.0
        width = self._room() / len(heights)
        points = [QPointF(_REACH_PX, bottom)]
        for index, height in enumerate(heights):
            y = bottom - room * float(height) / top
            points.append(QPointF(_REACH_PX + index * width, y))
            points.append(QPointF(_REACH_PX + (index + 1) * width, y))
        points.append(QPointF(_REACH_PX + self._room(), bottom))
        return QPolygonF(points)

    def _grip_at(self, position: QPointF) -> Grip | None:
        x = position.x()
        low, high = (self.x_of(limit) for limit in self._window)
        threshold = self.x_of(self._threshold)
        distances: list[tuple[float, Grip]] = [
            (abs(x - low), "low"),
            (abs(x - high), "high"),
            (abs(x - threshold), "threshold"),
        ]
        distance, nearest = min(distances, key=lambda pair: pair[0])
        if distance <= _REACH_PX:
            return nearest
        return "both" if low < x < high else None

    def _room(self) -> float:
        return max(self.width() - 2.0 * _REACH_PX, 1.0)
