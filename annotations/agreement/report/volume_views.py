"""Small views of a volume along its axes, with points in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from annotations.agreement.report.marks import FONT
from annotations.agreement.report.palette import FAINT, GRID, Look
from annotations.geometry.frames import Vector
from annotations.volumes import Level, intensity_window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIDES = (2, 1, 0)
"""The axes along which a volume is looked at, in the order of the views."""

_AXES = "xyz"
_LEAST_AROUND_UM = 1500.0
_AROUND = 1.4
_UM_PER_MM = 1000.0


@dataclass(frozen=True)
class Window:
    """What of a volume is seen: a box along its axes, in µm and its frame."""

    low_um: Vector
    high_um: Vector

    @classmethod
    def whole(cls, size_um: Vector) -> "Window":
        """Return all of a volume."""
        return cls((0.0, 0.0, 0.0), size_um)

    @classmethod
    def around(cls, positions_um: Sequence[Vector]) -> "Window":
        """Return what is around some positions in µm, at least one."""
        low_um, high_um = np.min(positions_um, axis=0), np.max(positions_um, axis=0)
        half_um = max(_LEAST_AROUND_UM, _AROUND * float(np.max(high_um - low_um))) / 2
        x, y, z = ((low_um + high_um) / 2).tolist()
        return cls((x - half_um, y - half_um, z - half_um), (x + half_um, y + half_um, z + half_um))


def draw_side(axes: "Axes", axis: int, level: Level | None, window: Window, words: str = "") -> None:
    """Draw a volume as it is seen along an axis: the brightest voxels on the way.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    axis : int
        Along which.
    level : Level or None
        A coarse copy of the volume; None where it is not at hand, so that there is only a grid.
    window : Window
        What is seen.
    words : str
        Stand in the title, before the axis.
    """
    right, up = _seen(axis)
    if level is not None:
        _draw_brightest(axes, level, axis, window)
    else:
        axes.grid(color=GRID, linewidth=0.5)
    axes.set_xlim(window.low_um[right] / _UM_PER_MM, window.high_um[right] / _UM_PER_MM)
    axes.set_ylim(window.high_um[up] / _UM_PER_MM, window.low_um[up] / _UM_PER_MM)
    axes.set_aspect("equal")
    axes.set_title(f"{words}along {_AXES[axis]}", fontsize=FONT)
    axes.set_xlabel(f"{_AXES[right]} (mm)", fontsize=FONT - 1, labelpad=1)
    axes.set_ylabel(f"{_AXES[up]} (mm)", fontsize=FONT - 1, labelpad=1)
    axes.tick_params(labelsize=FONT - 1, color=FAINT, length=2)
    axes.locator_params(nbins=4)


def draw_points(axes: "Axes", axis: int, positions_um: Sequence[Vector], look: Look) -> None:
    """Draw positions in µm, joined by a line, as they are seen along an axis."""
    right, up = _seen(axis)
    is_alone = len(positions_um) == 1
    axes.plot(
        [position_um[right] / _UM_PER_MM for position_um in positions_um],
        [position_um[up] / _UM_PER_MM for position_um in positions_um],
        linestyle=look.line,
        linewidth=0.8,
        marker=look.marker,
        color=look.color,
        markersize=8 if is_alone else 4.5,
        markeredgecolor="white",
        markeredgewidth=0.7,
    )


def draw_pairs(axes: "Axes", axis: int, pairs_um: Sequence[tuple[Vector, Vector]], color: str) -> None:
    """Draw lines between pairs of positions in µm, as they are seen along an axis."""
    for pair_um in pairs_um:
        ends_mm = np.asarray(pair_um)[:, _seen(axis)] / _UM_PER_MM
        axes.plot(*ends_mm.T, color=color, linewidth=1.0, linestyle="-")


def _seen(axis: int) -> tuple[int, int]:
    """Return which axes of the volume go to the right and upwards where it is seen along one."""
    right, up = (other for other in range(3) if other != axis)
    return right, up


def _draw_brightest(axes: "Axes", level: Level, axis: int, window: Window) -> None:
    """Draw the brightest voxels along an axis, of those within the window's depth."""
    spacing_um, origin_um = np.asarray(level.spacing_um), np.asarray(level.origin_um)
    last = np.asarray(level.data.shape) - 1
    low = np.clip(np.floor((np.asarray(window.low_um) - origin_um) / spacing_um), 0, last).astype(int)
    high = np.clip(np.ceil((np.asarray(window.high_um) - origin_um) / spacing_um), low, last).astype(int)
    first, second, third = (slice(start, end + 1) for start, end in zip(low, high, strict=True))
    image = level.data[first, second, third].max(axis=axis)
    low_mm, high_mm = (
        ((origin_um + edge * spacing_um) / _UM_PER_MM).tolist() for edge in (low - 0.5, high + 0.5)
    )
    across, up = _seen(axis)
    black, white = intensity_window(level)
    axes.set_facecolor("black")
    axes.imshow(
        image.T,
        cmap="gray",
        vmin=black,
        vmax=white,
        extent=(low_mm[across], high_mm[across], high_mm[up], low_mm[up]),
        interpolation="bilinear",
    )
