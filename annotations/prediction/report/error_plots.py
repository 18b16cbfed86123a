"""The plots of errors: against what may cause them, how they are spread, and at which keypoint.

Each is drawn into a matplotlib figure that somebody else owns, and says where it put each volume, so that a
window can open the one that is clicked.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.report.contents import Plot
from annotations.agreement.report.labels import counted, drawable, label_of, listed
from annotations.agreement.report.marks import (
    FONT,
    HEAD_IN,
    ROW_IN,
    WIDTH_IN,
    Room,
    dress,
    grid,
    half_width_in,
    names,
    offset,
    room_for,
)
from annotations.agreement.report.palette import FAINT, Look
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.errors.error_table import ErrorsOfVolume, ErrorTable
from annotations.prediction.errors.error_text import column_title
from annotations.prediction.errors.prediction_errors import FAR_UM
from annotations.prediction.report.plot_parts import draw_legend, legend_in, logarithmic, looks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface

MEAN_KEYPOINT = "keypoints_um"
"""Stands for the mean distance of the keypoints where a target is named."""

_UM_PER_MM = 1000.0
_PER_CENT = 100.0
_COLUMNS = 3
_LEAST = 1e-3
_WIDEST_NUMBER = "99.99995"
"""Below the axes: where all confidences are nearly 100 %, they are told apart by their last digits."""
_BINS, _LEAST_IN_BIN = 6, 4
_SCATTER_IN = 2.1
_POINT_PT = 7
_MANY, _MANY_IN_STRIP = 500, 100
"""More points than this are pixels in a drawing of lines, which would be megabytes large.

As pixels they take longer, and there are as many bytes where they are spread over the axes.
"""


@dataclass(frozen=True, eq=False)
class PlottedPoints:
    """Points of a plot, each of which stands for a volume.

    Attributes
    ----------
    axes : matplotlib.axes.Axes
        In which they are drawn.
    x, y : ndarray of float64, shape (N,)
        In the axes' data coordinates.
    volumes : tuple of str
        The id of each point's volume; one may have several points.
    """

    axes: "Axes"
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    volumes: tuple[str, ...]


@dataclass(frozen=True)
class ErrorPlot:
    """A plot that can be drawn at any size.

    Attributes
    ----------
    key : str
        By which it is known, such as ``against_theta1_deg``.
    title, caption, alternative : str
        What it is called, how it is read, and what it shows for those who cannot see it.
    size_in : (float, float)
        Width and height in inches at which it fits on a page.
    draw : callable
        Draws it into an empty figure or part of one, and says where the points are.
    """

    key: str
    title: str
    caption: str
    alternative: str
    size_in: tuple[float, float]
    draw: "Callable[[Surface], tuple[PlottedPoints, ...]]"

    def for_page(self) -> Plot:
        """Return it as an item of a report."""

        def draw(figure: "Surface") -> None:
            self.draw(figure)

        return Plot(f"{self.title}. {self.caption}", self.alternative, self.size_in, draw)


@dataclass(frozen=True)
class _Condition:
    """What may have to do with an error.

    ``label`` has the unit, ``words`` say in a sentence what it is; ``value`` is None where it is unknown.
    """

    key: str
    title: str
    label: str
    words: str
    value: Callable[[ErrorsOfVolume], float | None]


def plot_targets(tables: Sequence[ErrorTable]) -> Mapping[str, str]:
    """Return of what the errors can be drawn: names, each with its title and unit."""
    targets = {name: column_title(name) for table in tables for name in table.by_formulas.targets}
    return {MEAN_KEYPOINT: "mean keypoint distance (µm)", **targets}


def error_plots(
    tables: Sequence[ErrorTable], tool: ToolSpecification, targets: Sequence[str] = (MEAN_KEYPOINT,)
) -> tuple[ErrorPlot, ...]:
    """Return all plots of the errors of checkpoints, of several side by side.

    Parameters
    ----------
    tables : sequence of ErrorTable
        One a checkpoint, of the same tool.
    tool : ToolSpecification
    targets : sequence of str
        Of what the errors are drawn against the conditions: names of `plot_targets`, each in axes of its own.
    """
    against = (_against(condition, tables, targets) for condition in _conditions(tool))
    return (*against, _cumulative(tables), _by_keypoint(tables, tool))


def _conditions(tool: ToolSpecification) -> tuple[_Condition, ...]:
    def angle(name: str) -> Callable[[ErrorsOfVolume], float | None]:
        return lambda row: row.true_angles_deg.get(name)

    return (
        _Condition(
            "presence",
            "Error against confidence",
            "confidence (%)",
            "Confidence is how sure the network is that the keypoint of which it is least sure is there.",
            lambda row: _PER_CENT * row.presence,
        ),
        _Condition(
            "spread",
            "Error against the width of the heatmaps",
            "width of the heatmaps (µm)",
            "The width is the standard deviation of the widest heatmap; where a network is sure, it is "
            "narrow.",
            lambda row: row.spread_um,
        ),
        *(
            _Condition(
                each.name,
                f"Error against {label_of(each.name)}",
                f"true {label_of(each.name)} (°)",
                "The angle is that of the annotation, without its sign.",
                angle(each.name),
            )
            for each in tool.targets.angles
        ),
        _Condition(
            "depth",
            "Error against depth",
            "mean depth (mm)",
            "The depth is that of the true keypoints, their mean.",
            lambda row: None if row.depth_um is None else row.depth_um / _UM_PER_MM,
        ),
        _Condition(
            "visible",
            "Error against the visible share",
            "share of the tool in view (%)",
            "The share is that of the length of the tool's axes which lies in the volume.",
            lambda row: None if row.visible_share is None else _PER_CENT * row.visible_share,
        ),
    )


def _against(condition: _Condition, tables: Sequence[ErrorTable], targets: Sequence[str]) -> ErrorPlot:
    titles = plot_targets(tables)
    looks = looks_of(tables)

    def draw(figure: "Surface") -> tuple[PlottedPoints, ...]:
        plotted = []
        room = Room(
            left_in=0.45,
            right_in=half_width_in(_WIDEST_NUMBER),
            gap_in=0.5,
            title_in=0.28,
            ticks_in=0.44,
            legend_in=legend_in(figure, tables),
        )
        for axes, target in zip(grid(figure, len(targets), room, _COLUMNS), targets, strict=True):
            for table, look in zip(tables, looks, strict=True):
                plotted.append(_scatter(axes, condition, table, target, look))
            if (floor := _floor(tables, target)) is not None:
                axes.axhline(floor, color=FAINT, linewidth=1.0, linestyle=(0, (1, 1)))
            _dress(axes, titles[target], condition.label)
            # As the numbers are, not as what they have more than another one.
            axes.ticklabel_format(axis="x", useOffset=False)
            logarithmic(axes, "y")
        draw_legend(figure, tables)
        return tuple(plotted)

    rows = math.ceil(len(targets) / _COLUMNS)
    return ErrorPlot(
        f"against_{condition.key}",
        condition.title,
        _scatter_caption(condition, tables, targets),
        f"Points, one a volume: {listed([titles[name] for name in targets])} upwards, {condition.label} to "
        "the right; the numbers are in the table of volumes.",
        (WIDTH_IN, _SCATTER_IN * rows + legend_in(WIDTH_IN, tables)),
        draw,
    )


def _scatter(
    axes: "Axes", condition: _Condition, table: ErrorTable, target: str, look: Look
) -> PlottedPoints:
    known = [
        (at, max(error, _LEAST), row.volume)
        for row in table.independent_rows
        if (at := condition.value(row)) is not None and (error := _error(row, target)) is not None
    ]
    x, y = np.array([each[:2] for each in known], dtype=np.float64).reshape(-1, 2).T
    axes.plot(
        x,
        y,
        look.marker,
        color=look.color,
        markersize=_POINT_PT,
        markeredgewidth=0,
        alpha=0.7,
        linestyle="none",
        rasterized=x.size > _MANY,
    )
    if x.size >= _BINS * _LEAST_IN_BIN:
        parts = np.array_split(np.argsort(x, kind="stable"), _BINS)
        medians = [[np.median(of_points[part]) for part in parts] for of_points in (x, y)]
        # Seen over its own points and those of other checkpoints.
        axes.plot(*medians, color="white", linewidth=3.4, zorder=3)
        axes.plot(*medians, color=look.color, linestyle=look.line, linewidth=1.6, zorder=4)
    return PlottedPoints(axes, x, y, tuple(each[2] for each in known))


def _scatter_caption(condition: _Condition, tables: Sequence[ErrorTable], targets: Sequence[str]) -> str:
    said = [f"Each point is a volume, the error on a logarithmic scale. {condition.words}"]
    if any(len(table.independent_rows) >= _BINS * _LEAST_IN_BIN for table in tables):
        said.append("The line joins the medians of six parts with equally many volumes.")
    if any(_floor(tables, target) is not None for target in targets):
        said.append("Dotted: how far the annotators are from the mean of all.")
    absent = sum(
        condition.value(row) is None or _error(row, target) is None
        for table in tables
        for row in table.independent_rows
        for target in targets
    )
    if absent:
        said.append(f"{counted(absent, 'point')} not drawn: what was not found, or is unknown.")
    return " ".join(said)


def _cumulative(tables: Sequence[ErrorTable]) -> ErrorPlot:
    def draw(figure: "Surface") -> tuple[PlottedPoints, ...]:
        room = Room(left_in=0.5, ticks_in=0.44, legend_in=legend_in(figure, tables))
        (axes,) = grid(figure, 1, room)
        plotted = [_cumulate(axes, table, look) for table, look in zip(tables, looks_of(tables), strict=True)]
        axes.axvline(FAR_UM / _UM_PER_MM, color=FAINT, linewidth=1.0, linestyle=(0, (1, 1)))
        _dress(axes, "keypoints within that distance (%)", "distance from the true place (mm)")
        logarithmic(axes, "x")
        axes.set_ylim(0, 103)
        draw_legend(figure, tables)
        return tuple(plotted)

    return ErrorPlot(
        "cumulative",
        "How the distances are spread",
        "The share of keypoints (upwards) that are no further from their true place than the distance below, "
        "on a logarithmic scale. A keypoint that was not found is in no distance, so a curve may end below "
        f"100 %. Dotted: {FAR_UM / _UM_PER_MM:g} mm, beyond which a keypoint is not near its place at all.",
        "Cumulative distribution of the keypoints' distances, a curve a checkpoint.",
        (WIDTH_IN, 2.8 + legend_in(WIDTH_IN, tables)),
        draw,
    )


def _cumulate(axes: "Axes", table: ErrorTable, look: Look) -> PlottedPoints:
    found = sorted(
        (max(distance_um / _UM_PER_MM, _LEAST), row.volume)
        for row in table.independent_rows
        for distance_um in row.keypoints_um.values()
    )
    count = len(found) + sum(len(row.missing) for row in table.independent_rows)
    x_mm = np.array([distance_mm for distance_mm, _ in found], dtype=np.float64)
    shares = _PER_CENT * np.arange(1, x_mm.size + 1) / max(count, 1)
    axes.step(x_mm, shares, where="post", color=look.color, linestyle=look.line, linewidth=1.6)
    few = np.unique(np.linspace(0, max(x_mm.size - 1, 0), 9).round().astype(int))[: x_mm.size]
    axes.plot(x_mm[few], shares[few], look.marker, color=look.color, markersize=5, clip_on=False)
    return PlottedPoints(axes, x_mm, shares, tuple(volume for _, volume in found))


def _by_keypoint(tables: Sequence[ErrorTable], tool: ToolSpecification) -> ErrorPlot:
    labels = [drawable(name) for name in tool.keypoint_names]

    def draw(figure: "Surface") -> tuple[PlottedPoints, ...]:
        left_in = room_for(labels).left_in
        room = Room(left_in=left_in, ticks_in=0.44, legend_in=legend_in(figure, tables))
        (axes,) = grid(figure, 1, room)
        plotted = []
        for place, (table, look) in enumerate(zip(tables, looks_of(tables), strict=True)):
            for row, name in enumerate(tool.keypoint_names):
                plotted.append(_strip(axes, table, name, row + _offset(place, len(tables)), look))
        names(axes, labels, is_first=True)
        _dress(axes, "distance of each keypoint", "distance from the true place (mm)")
        logarithmic(axes, "x")
        draw_legend(figure, tables)
        return tuple(plotted)

    rows = len(labels) * max(2, len(tables))
    return ErrorPlot(
        "by_keypoint",
        "Distance of each keypoint",
        "Each small point is a volume, on a logarithmic scale. The thick line holds the middle half of them, "
        "the thin one the middle 90 %, and the mark is the median. Keypoints that were not found are not "
        "drawn.",
        "For each keypoint the median distance, the middle half and the middle 90 % of the volumes; the "
        "numbers are in the table of keypoints.",
        (WIDTH_IN, HEAD_IN + ROW_IN * rows + legend_in(WIDTH_IN, tables)),
        draw,
    )


def _strip(axes: "Axes", table: ErrorTable, name: str, height: float, look: Look) -> PlottedPoints:
    found = [
        (max(row.keypoints_um[name] / _UM_PER_MM, _LEAST), row.volume)
        for row in table.independent_rows
        if name in row.keypoints_um
    ]
    x_mm = np.array([distance_mm for distance_mm, _ in found], dtype=np.float64)
    heights = np.full(x_mm.size, height)
    if not found:
        return PlottedPoints(axes, x_mm, heights, ())
    axes.plot(
        x_mm,
        heights,
        "|",
        color=look.color,
        markersize=5,
        markeredgewidth=0.6,
        alpha=0.5,
        rasterized=x_mm.size > _MANY_IN_STRIP,
    )
    low, first, middle, third, high = np.percentile(x_mm, (5, 25, 50, 75, 95))
    axes.plot((low, high), (height, height), color=look.color, linewidth=1.2, solid_capstyle="butt")
    axes.plot((first, third), (height, height), color=look.color, linewidth=4.0, solid_capstyle="butt")
    axes.plot(
        middle,
        height,
        look.marker,
        color=look.color,
        markersize=6,
        markeredgecolor="white",
        markeredgewidth=0.8,
    )
    return PlottedPoints(axes, x_mm, heights, tuple(volume for _, volume in found))


def _error(row: ErrorsOfVolume, target: str) -> float | None:
    return row.mean_keypoint_um if target == MEAN_KEYPOINT else row.targets.get(target)


def _floor(tables: Sequence[ErrorTable], target: str) -> float | None:
    """Return how far people are apart in a target, on the volumes of the first checkpoint that knows it."""
    for table in tables:
        if table.human is not None and target in table.human.targets:
            return table.human.targets[target].mean
    return None


def _offset(place: int, count: int) -> float:
    """Return where in a row of height 1 one of several stands, as `offset` does, but never outside of it."""
    return offset(place, count) * min(1.0, 3.0 / count)


def _dress(axes: "Axes", upwards: str, right: str) -> None:
    dress(axes, upwards)
    axes.set_xlabel(right, fontsize=FONT, labelpad=2)
