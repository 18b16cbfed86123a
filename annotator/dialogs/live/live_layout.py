"""Where the three projections of a live view lie: at one scale, so that all proportions are true."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF

from annotations.geometry.frames import Vector

AXIS_NAMES = ("x", "y", "z")


@dataclass(frozen=True)
class Pane:
    """A projection along one axis, and where it is drawn.

    Depth runs downwards, as in a B-scan; seen along the depth, the later axis does.

    Attributes
    ----------
    axis : int
        The array axis along which is looked.
    horizontal, vertical : int
        The array axes that run to the right and downwards.
    area : QRectF
        Of what the network sees, in pixels.
    low_um : (float, float)
        Position of its left and upper edge.
    scale : float
        Pixels per µm.
    """

    axis: int
    horizontal: int
    vertical: int
    area: QRectF
    low_um: tuple[float, float]
    scale: float

    def pixel(self, position_um: Vector) -> QPointF:
        """Return where a position in µm is drawn."""
        [[x, y]] = self.pixels(np.array([[position_um[self.horizontal], position_um[self.vertical]]]))
        return QPointF(x, y)

    def pixels(self, places_um: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where places along the horizontal and the vertical axis are drawn, shape (n, 2) each."""
        corner_px = np.array([self.area.left(), self.area.top()])
        return np.asarray(corner_px + (places_um - np.array(self.low_um)) * self.scale)


def lie(axis: int, depth_axis: int) -> tuple[int, int]:
    """Return the axes that run to the right and downwards where one looks along an axis."""
    first, second = (other for other in range(3) if other != axis)
    vertical = first if first == depth_axis else second
    return (second if vertical == first else first), vertical


def panes(
    low_um: Vector, extent_um: Vector, depth_axis: int, room: QRectF, gap_px: float
) -> tuple[Pane, Pane, Pane]:
    """Return the three panes, along axes 0, 1 and 2, as large as a room allows.

    What the scanner sees, along the depth, is at the left; beside it the two B-scans, one above the other.

    Parameters
    ----------
    low_um : (float, float, float)
        Lower corner of what is shown.
    extent_um : (float, float, float)
        Its size.
    depth_axis : int
    room : QRectF
        In pixels.
    gap_px : float
        Between the panes.
    """
    lying = [lie(axis, depth_axis) for axis in range(3)]
    widths_um = [extent_um[horizontal] for horizontal, _ in lying]
    heights_um = [extent_um[vertical] for _, vertical in lying]
    upper, lower = (axis for axis in (1, 0, 2) if axis != depth_axis)
    width_um = widths_um[depth_axis] + max(widths_um[upper], widths_um[lower])
    stacked_um = heights_um[upper] + heights_um[lower]
    scale = max(
        min(
            (room.width() - gap_px) / width_um,
            room.height() / heights_um[depth_axis],
            (room.height() - gap_px) / stacked_um,
        ),
        1e-9,
    )
    left = room.left() + (room.width() - gap_px - width_um * scale) / 2
    used_px = max(heights_um[depth_axis] * scale, stacked_um * scale + gap_px)
    top = room.top() + (room.height() - used_px) / 2
    right = left + widths_um[depth_axis] * scale + gap_px
    corners = {
        depth_axis: (left, top),
        upper: (right, top),
        lower: (right, top + heights_um[upper] * scale + gap_px),
    }
    made = [
        Pane(
            axis,
            *lying[axis],
            QRectF(*corners[axis], widths_um[axis] * scale, heights_um[axis] * scale),
            (low_um[lying[axis][0]], low_um[lying[axis][1]]),
            scale,
        )
        for axis in range(3)
    ]
    return made[0], made[1], made[2]
