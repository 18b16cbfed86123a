"""What the plots of errors have in common: how each checkpoint is drawn and named, and logarithmic axes."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from annotations.agreement.report.labels import drawable
from annotations.agreement.report.marks import FONT, LEGEND_IN, legend
from annotations.agreement.report.palette import Look, numbered_look
from annotations.agreement.report.typesetting import line_width_in
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.report.checkpoint_names import checkpoint_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface

_BESIDE_NAME_IN = 0.6
_ROOM_IN = {"x": 0.9, "y": 0.45}
"""How long a decade must be for three numbers beside it."""


def looks_of(tables: Sequence[ErrorTable]) -> tuple[Look, ...]:
    """Return how each checkpoint is drawn."""
    return tuple(numbered_look(place) for place in range(len(tables)))


def draw_legend(figure: "Surface", tables: Sequence[ErrorTable]) -> None:
    """Say below the axes which checkpoint is which, where there are several."""
    if len(tables) > 1:
        legend(figure, looks_of(tables), _labels(tables), _columns(_width_in(figure), tables))


def legend_in(figure: "Surface | float", tables: Sequence[ErrorTable]) -> float:
    """Return the height of the legend in inches, in a figure or in one of a width in inches."""
    width_in = figure if isinstance(figure, float) else _width_in(figure)
    return LEGEND_IN * math.ceil(len(tables) / _columns(width_in, tables)) if len(tables) > 1 else 0.0


def logarithmic(axes: "Axes", which: Literal["x", "y"]) -> None:
    """Make an axis logarithmic, with plain numbers along it."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

    if which == "x":
        axes.set_xscale("log")
    else:
        axes.set_yscale("log")
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axis.get_view_interval()
    length_px = axes.bbox.width if which == "x" else axes.bbox.height
    decade_in = length_px / axes.figure.dpi / math.log10(high / low)
    steps = (1.0, 2.0, 5.0) if decade_in > _ROOM_IN[which] else (1.0,)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def _width_in(figure: "Surface") -> float:
    return figure.bbox.width / figure.dpi


def _columns(width_in: float, tables: Sequence[ErrorTable]) -> int:
    widest_in = max(line_width_in(label, FONT) for label in _labels(tables))
    return max(1, min(len(tables), int(width_in / (widest_in + _BESIDE_NAME_IN))))


def _labels(tables: Sequence[ErrorTable]) -> tuple[str, ...]:
    return tuple(map(drawable, checkpoint_names(tables)))
