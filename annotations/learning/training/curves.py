"""How a training went, as a picture. Needs no torch."""

import io
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE_IN = (8.0, 9.0)
_SALT = "annotations"
_FLOOR = 1e-3
"""The smallest value that is drawn: the axes are logarithmic."""


def curves_svg(rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Return the losses and errors by epoch, as an SVG file; the same for the same rows.

    Parameters
    ----------
    rows : sequence of mapping
        Of the log: ``part``, ``epoch``, losses (``loss…``) and errors (``…_mm_mean``, ``…_deg_mean``).
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE_IN, layout="constrained")
    losses, distances, angles = figure.subplots(3, 1, sharex=True)
    _draw(losses, rows, lambda name: name.startswith("loss"), "loss")
    _draw(distances, rows, lambda name: name.endswith(("_mm_mean", "_mm_median")), "mm")
    _draw(angles, rows, lambda name: name.endswith(("_deg_mean", "_deg_median")), "degrees")
    angles.set_xlabel("epochs" if len({row["part"] for row in rows}) == 1 else "epochs of all parts")
    stream = io.BytesIO()
    # Names of parts come from random numbers otherwise.
    with rc_context({"svg.hashsalt": _SALT}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()


def _draw(
    axes: "Axes", rows: Sequence[Mapping[str, Any]], is_wanted: Callable[[str], bool], unit: str
) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row if is_wanted(name)))
    for name in names:
        values = [_drawn(row.get(name, math.nan)) for row in rows]
        is_median = name.endswith("_median")
        label = name.removesuffix("_mean").removesuffix("_median").replace("_", " ")
        colour = f"C{names.index(name.replace('_median', '_mean')) if is_median else names.index(name)}"
        axes.plot(
            range(1, len(rows) + 1),
            values,
            color=colour,
            linestyle=":" if is_median else "-",
            label=f"{label}, median" if is_median else label,
        )
    for place in range(1, len(rows)):
        if rows[place]["part"] != rows[place - 1]["part"]:
            axes.axvline(place + 0.5, color="0.6", linewidth=0.8)
    axes.set_ylabel(unit)
    axes.set_yscale("log")
    axes.grid(True, color="0.9")
    if names:
        axes.legend(fontsize="small", ncols=2)


def _drawn(value: float) -> float:
    return max(value, _FLOOR) if math.isfinite(value) else math.nan
