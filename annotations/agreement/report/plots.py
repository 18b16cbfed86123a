"""The plots of an agreement: annotators, keypoints, volumes, and the statistics beside each other.

Each is drawn into a matplotlib figure that somebody else owns: a page, a picture or a widget.
"""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from annotations.agreement.report.contents import Plot
from annotations.agreement.report.labels import METHODS, STATISTICS, drawable, methods_of, with_unit
from annotations.agreement.report.marks import (
    COLUMNS,
    FONT,
    HEAD_IN,
    LEGEND_IN,
    ROW_IN,
    WIDTH_IN,
    Room,
    dress,
    estimates,
    grid,
    legend,
    names,
    offset,
    room_for,
)
from annotations.agreement.report.palette import INK, method_look, numbered_look
from annotations.agreement.results import (
    Agreement,
    AnnotatorResult,
    Estimate,
    MethodResult,
    Statistics,
)
from annotations.documents.record import Method

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from annotations.agreement.report.contents import Surface

_PARTS = (("distance_um", "Distance"), ("along_um", "Along the link"), ("across_um", "Across the link"))


def statistics_plot(agreement: Agreement) -> Plot:
    """Return the three statistics of each target, with their intervals, by method."""
    methods = methods_of(agreement)
    rows_named = ["of all", "leave-one-out", "pairwise"]

    def draw(figure: "Surface") -> None:
        room = room_for(rows_named, has_legend=len(methods) > 1)
        for axes, target in zip(grid(figure, len(agreement.targets), room), agreement.targets, strict=True):
            for place, method in enumerate(methods):
                statistics = agreement.methods[method].targets.get(target, Statistics())
                values = [getattr(statistics, name) for name in STATISTICS]
                rows = np.arange(len(values)) + offset(place, len(methods))
                look = method_look(method)
                estimates(axes, values, rows, look)
            names(axes, rows_named, is_first=target == agreement.targets[0])
            dress(axes, with_unit(target))
            axes.set_xlim(left=0)
        legend(figure, [method_look(method) for method in methods], [METHODS[method] for method in methods])

    return Plot(
        caption="The three statistics beside each other. Each mark is the mean over the volumes, the line "
        "through it the 95 % confidence interval.",
        alternative="Dot plot of the deviation by target, statistic and method; the numbers are in the "
        "tables.",
        size_in=(WIDTH_IN, 1.9 * math.ceil(len(agreement.targets) / COLUMNS) + 0.3),
        draw=draw,
    )


def deviation_plot(agreement: Agreement, method: Method) -> Plot:
    """Return how far each annotator is from the mean of the others, by target."""

    def value(annotator: AnnotatorResult, target: str) -> Estimate:
        return annotator.deviation.get(target, Estimate())

    return _by_annotator(
        agreement.methods[method],
        agreement.annotators,
        agreement.targets,
        value,
        is_signed=False,
        caption=f"{METHODS[method]}: distance of each annotator from the mean of the others, mean over the "
        "volumes with its 95 % confidence interval. Further left is closer to the others.",
        alternative="Dot plot of each annotator's leave-one-out deviation by target; the numbers are in the "
        "table of annotators.",
    )


def bias_plot(agreement: Agreement, method: Method) -> Plot:
    """Return the signed mean difference of each annotator from the mean of the others, by component."""

    def value(annotator: AnnotatorResult, component: str) -> Estimate:
        return annotator.bias.get(component, Estimate())

    return _by_annotator(
        agreement.methods[method],
        agreement.annotators,
        agreement.components,
        value,
        is_signed=True,
        caption=f"{METHODS[method]}: bias of each annotator, the signed mean difference from the mean of the "
        "others, with its 95 % confidence interval. An interval that does not touch the line at zero speaks "
        "for a systematic difference; one in twenty does so by chance alone.",
        alternative="Dot plot of each annotator's bias by component; the numbers are in the table of biases.",
    )


def keypoints_plot(agreement: Agreement, method: Method) -> Plot:
    """Return the published statistic at each keypoint, whole and along and across the link's axis."""
    keypoints = agreement.methods[method].keypoints

    def draw(figure: "Surface") -> None:
        room = room_for(list(map(drawable, keypoints)))
        cells = grid(figure, len(_PARTS), room)
        for number, (axes, (part, label)) in enumerate(zip(cells, _PARTS, strict=True)):
            values = [_published(getattr(keypoint, part)) for keypoint in keypoints.values()]
            estimates(axes, values, np.arange(len(values)), method_look(method))
            names(axes, [drawable(name) for name in keypoints], is_first=number == 0)
            dress(axes, f"{label} (µm)")
            axes.set_xlim(left=0)

    return Plot(
        caption=f"{METHODS[method]}: deviation from the mean of all annotators at each keypoint, in µm, mean "
        "over the volumes with its 95 % confidence interval; and the parts of the same differences along "
        "and across the axis of the keypoint's link.",
        alternative="Dot plot of the deviation at each keypoint; the numbers are in the table of keypoints.",
        size_in=(WIDTH_IN, HEAD_IN + ROW_IN * max(3, len(keypoints))),
        draw=draw,
    )


def volumes_plot(agreement: Agreement) -> Plot:
    """Return how the deviation is spread over the volumes, by target and method."""
    methods = methods_of(agreement)

    def draw(figure: "Surface") -> None:
        room = Room(left_in=0.55, gap_in=0.42, legend_in=LEGEND_IN if len(methods) > 1 else 0.0)
        for axes, target in zip(grid(figure, len(agreement.targets), room), agreement.targets, strict=True):
            for method in methods:
                _cumulate(axes, agreement.methods[method], target, method)
            dress(axes, with_unit(target))
            axes.set_xlim(left=0)
            axes.set_ylim(0, 103)
            if target == agreement.targets[0]:
                axes.set_ylabel("volumes below (%)", fontsize=FONT)
        legend(figure, [method_look(method) for method in methods], [METHODS[method] for method in methods])

    return Plot(
        caption="How the deviation is spread over the volumes: the share of volumes (upwards) whose "
        "deviation from the mean of all annotators is no larger than the value on the axis below. A long "
        "flat end on the right stands for a few volumes that are far worse than the rest.",
        alternative="Cumulative distribution of the deviation over the volumes, by target and method.",
        size_in=(WIDTH_IN, 2.0 * math.ceil(len(agreement.targets) / COLUMNS) + 0.3),
        draw=draw,
    )


def _cumulate(axes: "Axes", result: MethodResult, target: str, method: Method) -> None:
    values = np.sort([volume.targets[target] for volume in result.volumes if target in volume.targets])
    if not values.size:
        return
    look = method_look(method)
    shares = 100 * np.arange(1, values.size + 1) / values.size
    # A thousand steps draw like ten thousand, and make no huge file.
    shown = np.unique(np.linspace(0, values.size - 1, 1000).round().astype(int))
    axes.step(
        values[shown], shares[shown], where="post", color=look.color, linestyle=look.line, linewidth=1.4
    )
    few = np.unique(np.linspace(0, values.size - 1, 7).round().astype(int))
    axes.plot(values[few], shares[few], look.marker, color=look.color, markersize=4, clip_on=False)


def _by_annotator(
    result: MethodResult,
    everybody: Sequence[str],
    quantities: Sequence[str],
    value_of: Callable[[AnnotatorResult, str], Estimate],
    *,
    is_signed: bool,
    caption: str,
    alternative: str,
) -> Plot:
    annotators = result.annotators
    height_in = math.ceil(len(quantities) / COLUMNS) * (HEAD_IN + ROW_IN * max(2, len(annotators)))

    labels = [drawable(annotator.annotator) for annotator in annotators]

    def draw(figure: "Surface") -> None:
        cells = grid(figure, len(quantities), room_for(labels))
        for number, (axes, name) in enumerate(zip(cells, quantities, strict=True)):
            for row, annotator in enumerate(annotators):
                look = numbered_look(everybody.index(annotator.annotator))
                rows = np.array([float(row)])
                estimates(axes, [value_of(annotator, name)], rows, look)
            names(axes, labels, is_first=number % COLUMNS == 0)
            dress(axes, with_unit(name))
            if is_signed:
                axes.axvline(0, color=INK, linewidth=0.8)
                # Symmetric, so that left and right are compared at a glance.
                reach = max(map(abs, axes.get_xlim()))
                axes.set_xlim(-reach, reach)
            else:
                axes.set_xlim(left=0)

    return Plot(caption, alternative, (WIDTH_IN, height_in), draw)


def _published(statistics: Statistics | None) -> Estimate:
    return Estimate() if statistics is None else statistics.published
