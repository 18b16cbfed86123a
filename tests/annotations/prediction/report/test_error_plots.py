"""The plots of errors."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from annotations.agreement.report.pictures import picture_bytes
from annotations.documents.record import changed
from annotations.prediction.errors.error_table import ErrorTable
from annotations.prediction.report.error_plots import (
    MEAN_KEYPOINT,
    ErrorPlot,
    PlottedPoints,
    error_plots,
    plot_targets,
)
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.report.conftest import TARGETS

Make = Callable[..., ErrorTable]
KEYS = [
    "against_presence",
    "against_spread",
    "against_theta1",
    "against_theta2",
    "against_depth",
    "against_visible",
    "cumulative",
    "by_keypoint",
]


def drawn(plot: ErrorPlot) -> tuple[tuple[PlottedPoints, ...], Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=plot.size_in)
    return plot.draw(figure), figure


def test_there_is_a_plot_of_everything_that_may_have_to_do_with_an_error(make: Make) -> None:
    plots = error_plots([make()], FORCEPS)

    assert [plot.key for plot in plots] == KEYS
    assert all(plot.title and plot.caption and plot.alternative for plot in plots)
    assert list(plot_targets([make()])) == [MEAN_KEYPOINT, *TARGETS]


@pytest.mark.parametrize("target", [MEAN_KEYPOINT, "theta2_deg"])
def test_each_point_knows_its_volume(make: Make, target: str) -> None:
    table = make()
    against = next(plot for plot in error_plots([table], FORCEPS, (target,)) if plot.key == "against_theta1")

    [points], _ = drawn(against)

    rows = {row.volume: row for row in table.rows}
    known = [row.volume for row in table.rows if target == MEAN_KEYPOINT or target in row.targets]
    assert list(points.volumes) == known
    for x, y, volume in zip(points.x, points.y, points.volumes, strict=True):
        row = rows[volume]
        assert x == row.true_angles_deg["theta1"]
        assert y == (row.mean_keypoint_um if target == MEAN_KEYPOINT else row.targets[target])


def test_what_cannot_be_drawn_is_counted_below(make: Make) -> None:
    by_key = {plot.key: plot for plot in error_plots([make()], FORCEPS, ("theta2_deg",))}

    assert "1 point not drawn" in by_key["against_depth"].caption


def test_several_checkpoints_are_told_apart_without_colour(make: Make) -> None:
    for plot in error_plots([make("A", 1), make("B", 2)], FORCEPS):
        points, figure = drawn(plot)
        markers = {line.get_marker() for axes in figure.axes for line in axes.lines} - {"None", "", "|"}
        assert len(markers) == 2
        [legend] = figure.legends
        assert [text.get_text().strip() for text in legend.get_texts()] == ["A", "B"]
        assert len(points) % 2 == 0


def test_a_keypoint_that_was_not_found_keeps_the_curve_below_all(make: Make) -> None:
    table = make(volumes=10)
    cumulative = next(plot for plot in error_plots([table], FORCEPS) if plot.key == "cumulative")

    [points], _ = drawn(cumulative)

    assert points.y[-1] == pytest.approx(100 * 59 / 60)
    assert np.all(np.diff(points.x) >= 0)
    distances_mm = sorted(value / 1000 for row in table.rows for value in row.keypoints_um.values())
    assert points.x == pytest.approx(distances_mm)


def test_how_far_people_are_apart_is_drawn_where_it_is_known(make: Make) -> None:
    with_people, without = (
        error_plots([make(people=people)], FORCEPS, ("theta1_deg", MEAN_KEYPOINT))[0]
        for people in (True, False)
    )

    assert "Dotted" in with_people.caption
    assert "Dotted" not in without.caption
    _, figure = drawn(with_people)
    first, second = figure.axes
    assert any(list(line.get_ydata()) == [0.54, 0.54] for line in first.lines)
    assert len(second.lines) == len(first.lines) - 1


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (0.9999925, 0.99999584), (0.99999925, 0.999999584)])
@pytest.mark.parametrize("width_in", [3.2, 5.0, 8.0])
def test_no_number_is_cut_off_at_the_edge(make: Make, low: float, high: float, width_in: float) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    table = make()
    shares = np.linspace(low, high, len(table.rows)).tolist()
    rows = tuple(changed(row, presence=share) for row, share in zip(table.rows, shares, strict=True))
    plot = error_plots([changed(table, rows=rows)], FORCEPS)[0]
    figure = Figure(figsize=(width_in, 0.6 * width_in), dpi=96)
    canvas = FigureCanvasAgg(figure)

    plot.draw(figure)
    canvas.draw()

    [axes] = figure.axes
    left, right = axes.get_xlim()
    numbers = [label for label in axes.get_xticklabels() if left <= label.get_position()[0] <= right]
    assert numbers
    for number in numbers:
        extent = number.get_window_extent()
        assert figure.bbox.x0 <= extent.x0 < extent.x1 <= figure.bbox.x1


@pytest.mark.parametrize("volumes", [0, 1, 2])
def test_few_volumes_are_drawn_too(make: Make, volumes: int) -> None:
    for plot in error_plots([make(volumes=volumes)], FORCEPS)[-3:]:
        assert picture_bytes(plot.size_in, plot.for_page().draw, "png").startswith(b"\x89PNG")


def test_an_error_of_nothing_is_drawn_at_the_edge(make: Make) -> None:
    table = make()
    exact = changed(table.rows[3], targets={"theta1_deg": 0.0})
    plot = error_plots([changed(table, rows=(*table.rows, exact))], FORCEPS, ("theta1_deg",))[0]

    [points], figure = drawn(plot)

    assert points.y[-1] > 0
    assert figure.axes[0].get_ylim()[0] > 0


def test_a_plot_is_drawn_without_measuring_its_numbers(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would take a third longer."""
    from matplotlib.axis import Axis

    measured: list[Axis] = []
    measure = Axis.get_tightbbox
    monkeypatch.setattr(
        Axis,
        "get_tightbbox",
        lambda axis, *given, **named: measured.append(axis) or measure(axis, *given, **named),
    )
    for plot in error_plots([make()], FORCEPS)[::7]:
        picture_bytes(plot.size_in, plot.for_page().draw, "svg")

    assert measured == []


def test_some_hundred_points_are_drawn_as_lines_are(make: Make) -> None:
    """Pixels of them would take longer and as many bytes."""
    against = error_plots([make(volumes=200)], FORCEPS)[0]

    assert b"<image" not in picture_bytes(against.size_in, against.for_page().draw, "svg")
