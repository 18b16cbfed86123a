"""What the plots are made of: a grid of axes, and marks with intervals on them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.report.labels import Unit
from annotations.agreement.report.palette import FAINT, GRID, INK, Look
from annotations.agreement.results import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

WIDTH_IN = 7.2
"""As wide as a page's text."""
COLUMNS = 4
FONT = 8
ROW_IN = 0.19
HEAD_IN = 0.85
"""Height of a row of names, and of what stands above and below them."""


def grid(figure: "FigureBase", count: int) -> list["Axes"]:
    """Return axes side by side, `COLUMNS` in a row."""
    columns = min(COLUMNS, max(1, count))
    cells = figure.subplots(max(1, math.ceil(count / columns)), columns, squeeze=False).ravel().tolist()
    for axes in cells[count:]:
        axes.set_visible(False)
    return cells[:count]


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


def dress(axes: "Axes", title: str, unit: Unit) -> None:
    """Give axes their title, with the unit of the numbers along them, and a grid to read them by."""
    axes.set_title(f"{title} ({unit})", fontsize=FONT + 1, color=INK)
    axes.tick_params(labelsize=FONT, color=FAINT, length=2)
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.locator_params(axis="x", nbins=4)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)


def legend(figure: "FigureBase", looks: Sequence[Look], labels: Sequence[str]) -> None:
    """Say below the axes what the marks and lines stand for, where there is more than one."""
    from matplotlib.lines import Line2D

    if len(looks) < 2:
        return
    handles = [
        Line2D([], [], color=look.color, marker=look.marker, linestyle=look.line, markersize=5)
        for look in looks
    ]
    figure.legend(
        handles, list(labels), loc="outside lower center", ncols=len(looks), fontsize=FONT, frameon=False
    )
