"""Draws what helps to find one's way on a slice: crosshair, scale bar, and which axis runs where."""

from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from annotations.geometry.frames import Vector
from annotator.looks.scale_bar import length_text, round_length_um
from annotator.slices.captions import paint_caption
from annotator.slices.projection import AXIS_NAMES, Plane
from annotator.slices.viewport import Viewport

INK = QColor("#f2f2f2")
# The middle stays free, so that the crosshair hides nothing of what it points at.
CROSSHAIR_GAP_PX = 9.0
MARGIN_PX = 10.0
LONGEST_BAR = 0.25
# A line of one pixel, wherever in the pixel it lies and however it is rounded.
_LINE_REACH_PX = 2.0

AxisColors = tuple[QColor, QColor, QColor]


def paint_crosshair(painter: QPainter, viewport: Viewport, crosshair_um: Vector, colors: AxisColors) -> None:
    """Draw where the two other slices cut this one, each line in the colour of its slice's axis."""
    x, y = viewport.pixel(crosshair_um)
    area, plane = viewport.area, viewport.plane
    right, lower = area.left + area.width, area.top + area.height
    vertical, horizontal = QColor(colors[plane.horizontal]), QColor(colors[plane.vertical])
    vertical.setAlphaF(0.8)
    horizontal.setAlphaF(0.8)
    painter.setPen(QPen(vertical, 1.0))
    painter.drawLine(QLineF(x, area.top, x, y - CROSSHAIR_GAP_PX))
    painter.drawLine(QLineF(x, y + CROSSHAIR_GAP_PX, x, lower))
    painter.setPen(QPen(horizontal, 1.0))
    painter.drawLine(QLineF(area.left, y, x - CROSSHAIR_GAP_PX, y))
    painter.drawLine(QLineF(x + CROSSHAIR_GAP_PX, y, right, y))


def crosshair_rects(viewport: Viewport, crosshair_um: Vector) -> tuple[QRect, QRect]:
    """Return what the crosshair's two lines cover, in pixels of the widget."""
    x, y = viewport.pixel(crosshair_um)
    area, reach = viewport.area, _LINE_REACH_PX
    return (
        QRectF(x - reach, area.top, 2 * reach, area.height).toAlignedRect(),
        QRectF(area.left, y - reach, area.width, 2 * reach).toAlignedRect(),
    )


def paint_scale_bar(painter: QPainter, viewport: Viewport) -> None:
    """Draw a bar of a round length in the lower right corner."""
    area = viewport.area
    length_um = round_length_um(area.width * LONGEST_BAR / viewport.scale)
    length_px = length_um * viewport.scale
    right, lower = area.left + area.width - MARGIN_PX, area.top + area.height - MARGIN_PX
    left = right - length_px
    for color, width in ((QColor(0, 0, 0, 170), 5.0), (INK, 2.0)):
        painter.setPen(QPen(color, width, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
        painter.drawLine(QLineF(left, lower, right, lower))
        painter.drawLine(QLineF(left, lower - 4, left, lower + 1))
        painter.drawLine(QLineF(right, lower - 4, right, lower + 1))
    middle = QPointF((left + right) / 2, lower - 6)
    paint_caption(
        painter,
        middle,
        length_text(length_um),
        INK,
        Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
    )


def paint_axis_names(painter: QPainter, viewport: Viewport, colors: AxisColors) -> None:
    """Name the axes that run to the right and downwards, at the right and the lower edge."""
    area, plane = viewport.area, viewport.plane
    paint_caption(
        painter,
        QPointF(area.left + area.width - MARGIN_PX / 2, area.top + area.height / 2),
        f"{_axis_name(plane, plane.horizontal)} →",
        colors[plane.horizontal],
        Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
    )
    paint_caption(
        painter,
        QPointF(area.left + area.width / 2, area.top + area.height - MARGIN_PX / 2),
        f"{_axis_name(plane, plane.vertical)} ↓",
        colors[plane.vertical],
        Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
    )


def _axis_name(plane: Plane, axis: int) -> str:
    return f"{AXIS_NAMES[axis]} (depth)" if axis == plane.depth_axis else AXIS_NAMES[axis]
