"""What the plots are made of: a grid of axes, and marks with intervals on them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.report.palette import FAINT, GRID, INK, Look
from annotations.agreement.report.typesetting import line_width_in
from annotations.agreement.results import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface

WIDTH_IN = 7.2
"""As wide as a page's text."""
COLUMNS = 4
FONT = 8
ROW_IN = 0.19
HEAD_IN = 0.66
"""Height of a row of names, and of what stands above and below them."""
LEGEND_IN = 0.28
_LEAST_IN = 0.05
_LARGEST_HINTING = 1.05
"""By how much letters on a screen, which fit its pixels, may be wider than in print."""


@dataclass(frozen=True)
class Room:
    """What axes side by side leave free around them, in inches.

    Attributes
    ----------
    left_in : float
        Left of the first ones, for names or numbers.
    right_in : float
        Right of the last ones: half of the last number below them, where that is at their end.
    gap_in : float
        Between two columns: numbers below the ends of two axes, each half over the edge, do not touch.
    title_in, ticks_in : float
        Above and below each of the axes.
    legend_in : float
        Below all of them.
    """

    left_in: float = 0.5
    right_in: float = 0.14
    gap_in: float = 0.34
    title_in: float = 0.26
    ticks_in: float = 0.3
    legend_in: float = 0.0


@dataclass(frozen=True)
class Cell:
    """The place of axes in a figure, in inches from its lower left corner."""

    left_in: float
    bottom_in: float
    width_in: float
    height_in: float


def half_width_in(number: str) -> float:
    """Return how far a number below the end of axes stands out over it, in inches."""
    return _LARGEST_HINTING * line_width_in(number, FONT) / 2


def room_for(labels: Sequence[str], *, has_legend: bool = False) -> Room:
    """Return the room for names left of the first axes."""
    widest_in = max((line_width_in(label, FONT) for label in labels), default=0.0)
    return Room(left_in=_LARGEST_HINTING * widest_in + 0.2, legend_in=LEGEND_IN if has_legend else 0.0)


def cells_in(figure: "Surface", count: int, room: Room, columns: int = COLUMNS) -> list[Cell]:
    """Return the places of axes side by side, at most a number of them in a row, the first row on top.

    They follow from the room alone: asking each text for its size first, as matplotlib's layout engines do,
    takes three times as long.
    """
    columns = min(columns, max(1, count))
    rows = max(1, math.ceil(count / columns))
    width_in, height_in = size_in(figure)
    between_in = room.title_in + room.ticks_in
    across_in = max(
        _LEAST_IN, (width_in - room.left_in - room.right_in - room.gap_in * (columns - 1)) / columns
    )
    up_in = max(_LEAST_IN, (height_in - room.legend_in - between_in * rows) / rows)
    return [
        Cell(
            room.left_in + (number % columns) * (across_in + room.gap_in),
            height_in - room.title_in - up_in - (number // columns) * (up_in + between_in),
            across_in,
            up_in,
        )
        for number in range(count)
    ]


def size_in(figure: "Surface") -> tuple[float, float]:
    """Return the width and the height of a figure, or of a part of one, in inches."""
    return figure.bbox.width / figure.dpi, figure.bbox.height / figure.dpi


def grid(figure: "Surface", count: int, room: Room, columns: int = COLUMNS) -> list["Axes"]:
    """Return axes at the places of `cells_in`."""
    width_in, height_in = size_in(figure)
    return [
        figure.add_axes(
            (
                cell.left_in / width_in,
                cell.bottom_in / height_in,
                cell.width_in / width_in,
                cell.height_in / height_in,
            )
        )
        for cell in cells_in(figure, count, room, columns)
    ]


def offset(place: int, count: int) -> float:
    """Return how far one of several marks in the same row stands above or below its middle."""
    return 0.24 * (place - (count - 1) / 2)


def estimates(axes: "Axes", values: Sequence[Estimate], rows: NDArray[Any], look: Look) -> None:
    """Draw means as marks and their intervals as lines, one a row; nothing where there is none."""
    for value, row in zip(values, rows, strict=True):
        if value.mean is None:
            continue
        if value.ci95 is not None:
            axes.plot(value.ci95, (row, row), color=look.color, linewidth=1.3, solid_capstyle="butt")
        axes.plot(value.mean, row, look.marker, color=look.color, markersize=5, markeredgewidth=0)


def names(axes: "Axes", labels: Sequence[str], *, is_first: bool) -> None:
    """Name the rows from above, at the first axes of several side by side alone."""
    axes.set_yticks(np.arange(len(labels)), list(labels) if is_first else [""] * len(labels), fontsize=FONT)
    axes.set_ylim(len(labels) - 0.5, -0.5)


def dress(axes: "Axes", title: str) -> None:
    """Give axes their title, which has the unit of the numbers along them, and a grid to read them by."""
    # Nothing stands above the axes that a title with a place of its own could meet: matplotlib would measure
    # all their numbers to find out.
    axes.set_title(title, fontsize=FONT + 1, color=INK, y=1.0)
    axes.tick_params(labelsize=FONT, color=FAINT, length=2)
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.locator_params(axis="x", nbins=4)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)


def legend(figure: "Surface", looks: Sequence[Look], labels: Sequence[str], columns: int = 5) -> None:
    """Say below the axes what the marks and lines stand for, where there is more than one."""
    from matplotlib.lines import Line2D

    if len(looks) < 2:
        return
    handles = [
        Line2D([], [], color=look.color, marker=look.marker, linestyle=look.line, markersize=5)
        for look in looks
    ]
    figure.legend(
        handles,
        # A label that begins with an underscore would not be shown.
        [f"\u200a{label}" for label in labels],
        loc="lower center",
        bbox_to_anchor=(0.5, 0.0),
        borderaxespad=0.2,
        ncols=min(columns, len(looks)),
        fontsize=FONT,
        frameon=False,
    )
