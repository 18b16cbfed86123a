"""Bland–Altman plots: how two annotators differ, over how large the value is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from annotations.agreement.report.contents import Plot
from annotations.agreement.report.labels import METHODS, drawable, with_unit
from annotations.agreement.report.marks import COLUMNS, FONT, WIDTH_IN, Room, dress, grid
from annotations.agreement.report.palette import INK, method_look
from annotations.agreement.results import Agreement, BlandAltman, MethodResult
from annotations.documents.record import Method

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface


@dataclass(frozen=True)
class _Compared:
    first: str
    second: str
    component: str
    limits: BlandAltman


def bland_altman_plot(agreement: Agreement, method: Method) -> Plot | None:
    """Return for each component the pair of annotators with the widest limits of agreement; None without."""
    shown = [_widest(agreement.methods[method], component) for component in agreement.components]
    return _plot([each for each in shown if each is not None], method)


def pair_plot(agreement: Agreement, method: Method, first: str, second: str) -> Plot | None:
    """Return all components of one pair of annotators; None where they have no volume in common."""
    return _plot(
        [
            _Compared(pair.first, pair.second, component, limits)
            for pair in agreement.methods[method].pairs
            if {pair.first, pair.second} == {first, second}
            for component, limits in pair.components.items()
            if limits.limits is not None
        ],
        method,
    )


def _widest(result: MethodResult, component: str) -> _Compared | None:
    candidates = [
        _Compared(pair.first, pair.second, component, limits)
        for pair in result.pairs
        if (limits := pair.components.get(component)) is not None and limits.limits is not None
    ]
    return max(candidates, key=lambda each: each.limits.sd or 0.0, default=None)


def _plot(shown: Sequence[_Compared], method: Method) -> Plot | None:
    if not shown:
        return None

    def draw(figure: "Surface") -> None:
        room = Room(gap_in=0.5, title_in=0.4, ticks_in=0.46)
        for axes, each in zip(grid(figure, len(shown), room), shown, strict=True):
            _draw(axes, each, method)

    return Plot(
        caption=f"{METHODS[method]}: Bland–Altman plots. Upwards the difference between two annotators, the "
        "first minus the second, to the right the mean of the two; a mark is a volume. The line is the "
        "bias, the dashed lines are the 95 % limits of agreement, the shaded bands their 95 % confidence "
        "intervals. Of each component the pair with the widest limits is shown; the next ones are in the "
        "table of pairs."
        if len({(each.first, each.second) for each in shown}) > 1 or len(shown) == 1
        else f"{METHODS[method]}: Bland–Altman plots of {shown[0].first} minus {shown[0].second}.",
        alternative="Scatter plots of differences over means for pairs of annotators, with bias and limits; "
        "bias and limits are in the table of pairs.",
        size_in=(WIDTH_IN, 2.26 * math.ceil(len(shown) / COLUMNS)),
        draw=draw,
    )


def _draw(axes: "Axes", each: _Compared, method: Method) -> None:
    limits, look = each.limits, method_look(method)
    if limits.points:
        across, upwards = zip(*limits.points, strict=True)
        axes.plot(across, upwards, look.marker, color=look.color, markersize=3, alpha=0.6, markeredgewidth=0)
    for ends in (limits.bias_ci95, limits.low_ci95, limits.high_ci95):
        if ends is not None:
            axes.axhspan(*ends, color=look.color, alpha=0.1, linewidth=0)
    if limits.bias is not None:
        axes.axhline(limits.bias, color=INK, linewidth=1)
    for end in limits.limits or ():
        axes.axhline(end, color=INK, linewidth=1, linestyle="--")
    dress(axes, with_unit(each.component))
    axes.set_title(
        f"{with_unit(each.component)}\n{_short(each.first)} − {_short(each.second)}", fontsize=FONT
    )
    axes.set_xlabel("mean of the two", fontsize=FONT, labelpad=1)
    axes.locator_params(axis="x", nbins=2)


def _short(name: str) -> str:
    return drawable(name if len(name) <= 11 else f"{name[:10]}…")
