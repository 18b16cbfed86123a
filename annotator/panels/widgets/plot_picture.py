"""A plot whose points are volumes: named under the mouse, opened by a click, the open one marked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

_NEAR_PX = 9.0
_RING_PX = 6.0
_UNDER = QColor("#d1495b")


@dataclass(frozen=True, eq=False)
class DrawnPlot:
    """A plot as pixels, and where its points are.

    Attributes
    ----------
    image : QImage
        With its device pixel ratio.
    points_px : ndarray of float64, shape (N, 2)
        Right and down from its upper left corner, in device-independent pixels.
    volumes : tuple of str
        The volume of each point; one can have several.
    values : tuple of str
        What each point says, in words.
    """

    image: QImage
    points_px: NDArray[np.float64]
    volumes: tuple[str, ...]
    values: tuple[str, ...]


class PlotPicture(QWidget):
    """Draws one plot, and asks for the volume whose point is clicked.

    Signals
    -------
    volume_requested : str
        The volume of the point that was clicked.
    """

    volume_requested = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._plot: DrawnPlot | None = None
        self._labels: tuple[str, ...] = ()
        self._open: str | None = None
        self._under: int | None = None
        self.setMouseTracking(True)

    def show_plot(self, plot: DrawnPlot | None, labels: tuple[str, ...] = ()) -> None:
        """Show another plot, or none; ``labels`` name the volumes of its points."""
        self._plot, self._labels, self._under = plot, labels, None
        self.setFixedSize(self.sizeHint())
        self.update()

    def mark_open(self, volume: str | None) -> None:
        """Draw a ring around the points of the open volume."""
        if volume != self._open:
            self._open = volume
            self.update()

    @property
    def plot(self) -> DrawnPlot | None:
        """What is shown."""
        return self._plot

    def point_at(self, position_px: QPointF) -> int | None:
        """Return the number of the point that is nearest to a position, if one is near."""
        if self._plot is None or not len(self._plot.points_px):
            return None
        away_px = np.hypot(*(self._plot.points_px - (position_px.x(), position_px.y())).T)
        nearest = int(np.argmin(away_px))
        return nearest if away_px[nearest] <= _NEAR_PX else None

    def _words_at(self, point: int) -> str:
        return "" if self._plot is None else f"{self._labels[point]}: {self._plot.values[point]}"

    def sizeHint(self) -> QSize:
        return QSize() if self._plot is None else self._plot.image.deviceIndependentSize().toSize()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._plot is None:
            return
        with QPainter(self) as painter:
            painter.drawImage(0, 0, self._plot.image)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            for number, volume in enumerate(self._plot.volumes):
                if volume == self._open or number == self._under:
                    painter.setPen(
                        QPen(_UNDER if number == self._under else self.palette().text().color(), 2)
                    )
                    painter.drawEllipse(QPointF(*self._plot.points_px[number]), _RING_PX, _RING_PX)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        under = self.point_at(event.position())
        if under == self._under:
            return
        self._under = under
        self.setCursor(Qt.CursorShape.ArrowCursor if under is None else Qt.CursorShape.PointingHandCursor)
        self.setToolTip("" if under is None else self._words_at(under))
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        at = self.point_at(event.position())
        if self._plot is not None and at is not None and event.button() == Qt.MouseButton.LeftButton:
            self.volume_requested.emit(self._plot.volumes[at])

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._under = None
        self.update()
