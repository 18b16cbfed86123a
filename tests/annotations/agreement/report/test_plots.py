from itertools import pairwise
from typing import Any

import pytest

from annotations.agreement.report.bland_altman_plot import bland_altman_plot, pair_plot
from annotations.agreement.report.contents import Plot
from annotations.agreement.report.marks import WIDTH_IN, dress, grid, room_for
from annotations.agreement.report.pictures import picture_bytes
from annotations.agreement.report.plots import (
    bias_plot,
    deviation_plot,
    keypoints_plot,
    statistics_plot,
    volumes_plot,
)
from annotations.agreement.results import Agreement, MethodResult
from tests.annotations.agreement.report.conftest import HOSTILE


def axes_of(plot: Plot) -> list[Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=plot.size_in)
    plot.draw(figure)
    return [axes for axes in figure.axes if axes.get_visible()]


def test_every_target_has_axes_that_start_at_zero(agreement: Agreement) -> None:
    for plot in (statistics_plot(agreement), volumes_plot(agreement), deviation_plot(agreement, "boxes")):
        cells = axes_of(plot)
        titles = [axes.get_title() for axes in cells]
        assert titles == ["Position (µm)", "Orientation (°)", "θ1 (°)", "θ2 (°)"]
        assert all(axes.get_xlim()[0] == 0 for axes in cells)


def test_a_bias_is_seen_to_be_left_or_right_of_zero(agreement: Agreement) -> None:
    cells = axes_of(bias_plot(agreement, "keypoints"))

    assert len(cells) == len(agreement.components)
    for axes in cells:
        low, high = axes.get_xlim()
        assert low == -high


def test_annotators_are_named_in_their_order(agreement: Agreement) -> None:
    first = axes_of(deviation_plot(agreement, "keypoints"))[0]

    assert [label.get_text() for label in first.get_yticklabels()][0::2] == ["anna", "chiara"]
    low, high = first.get_ylim()
    assert low > high


def test_numbers_below_neighbouring_axes_do_not_touch() -> None:
    from matplotlib.figure import Figure

    for values in ((0.0, 200.0), (-1000.0, 1000.0), (0.25, 1.25)):
        figure = Figure(figsize=(WIDTH_IN, 1.5))
        cells = grid(figure, 4, room_for(["anna"]))
        for axes in cells:
            axes.set_xlim(*values)
            dress(axes, "Position (µm)")
        figure.draw_without_rendering()
        spans = [
            (box.x0, box.x1)
            for axes in cells
            for label, place in zip(axes.get_xticklabels(), axes.get_xticks(), strict=True)
            if values[0] <= place <= values[1]
            for box in [label.get_window_extent()]
        ]
        assert len(spans) >= 12
        assert all(left[1] < right[0] for left, right in pairwise(spans))


def test_keypoints_are_shown_whole_along_and_across(agreement: Agreement) -> None:
    titles = [axes.get_title() for axes in axes_of(keypoints_plot(agreement, "keypoints"))]

    assert titles == ["Distance (µm)", "Along the link (µm)", "Across the link (µm)"]


def test_of_each_component_the_widest_pair_is_shown(agreement: Agreement) -> None:
    plot = bland_altman_plot(agreement, "keypoints")

    assert plot is not None
    cells = axes_of(plot)
    assert len(cells) == len(agreement.components)
    widest = max(agreement.methods["keypoints"].pairs, key=lambda pair: pair.components["theta2_deg"].sd or 0)
    assert {axes.get_xlabel() for axes in cells} == {"mean of the two"}
    assert cells[-1].get_title().startswith("θ2 (°)\n")
    assert cells[-1].get_title().split("\n")[1].startswith(widest.first[:10].replace("$", r"\$"))


def test_a_pair_is_shown_in_all_components(agreement: Agreement) -> None:
    plot = pair_plot(agreement, "boxes", "chiara", "anna")

    assert plot is not None
    assert len(axes_of(plot)) == len(agreement.components)
    assert "anna minus chiara" in plot.caption
    assert pair_plot(agreement, "boxes", "anna", "nobody") is None


def test_without_pairs_there_is_nothing_to_plot(empty: Agreement) -> None:
    assert bland_altman_plot(empty, "keypoints") is None
    assert isinstance(empty.methods["keypoints"], MethodResult)


@pytest.mark.parametrize("name", [HOSTILE, "_hidden", "名前", "a" * 300, "$"])
def test_any_name_can_be_drawn(make: Any, name: str) -> None:
    agreement = make((name, "ben"), methods=("keypoints",), volumes=2)
    plot = deviation_plot(agreement, "keypoints")

    assert picture_bytes(plot.size_in, plot.draw, "svg").startswith(b"<?xml")


def test_pictures_are_of_the_size_that_was_asked_for() -> None:
    png = picture_bytes((2.0, 1.0), lambda _figure: None, "png")

    assert int.from_bytes(png[16:20]) == 2 * int.from_bytes(png[20:24]) == 260
