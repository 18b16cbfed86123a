import math
from collections.abc import Callable

import numpy as np
import pytest

from annotations.agreement.compared import Compared
from annotations.agreement.figures import figures, measured_keypoint
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool

NEEDLE = find_tool("needle")
SHAFT, TIP = NEEDLE.keypoint_names.index("shaft"), NEEDLE.keypoint_names.index("tip")


def needles(*volumes: list[tuple[tuple[float, float, float], tuple[float, float, float]]]) -> np.ndarray:
    """Return positions of shape (V, A, 2, 3) from the shafts and tips of each volume's annotators."""
    positions_um = np.empty((len(volumes), len(volumes[0]), 2, 3))
    for row, annotators in enumerate(volumes):
        for column, (shaft, tip) in enumerate(annotators):
            positions_um[row, column, SHAFT], positions_um[row, column, TIP] = shaft, tip
    return positions_um


NOT_PLACED = (math.nan,) * 3


def test_distances_are_split_along_and_across_the_axis_of_the_link(
    compared_of: Callable[..., Compared],
) -> None:
    # The mean needle lies along x. At the tip the two are (8, 6, 0) apart: 10 in all, 8 along and 6 across;
    # half of each from their mean.
    compared = compared_of(needles([((0, 3, 0), (2004, -3, 0)), ((0, -3, 0), (1996, 3, 0))]))

    tip = figures(compared, NEEDLE).keypoints["tip"]

    assert tip.along_um is not None
    assert tip.across_um is not None
    assert tip.distance_um.published.mean == pytest.approx(5.0)
    assert tip.distance_um.pairwise.mean == pytest.approx(10.0)
    assert (tip.along_um.published.mean, tip.across_um.published.mean) == pytest.approx((4.0, 3.0))
    assert (tip.along_um.leave_one_out.mean, tip.across_um.leave_one_out.mean) == pytest.approx((8.0, 6.0))


def test_the_axis_comes_from_everybody_who_has_an_end_of_the_link(
    compared_of: Callable[..., Compared],
) -> None:
    # One placed only the tip, the other both ends: the axis runs from (0, 0, 0) to the mean tip (1000, 0, 0).
    compared = compared_of(needles([((0, 0, 0), (1000, 10, 0)), (NOT_PLACED, (1000, -10, 0))]))

    tip = figures(compared, NEEDLE).keypoints["tip"]

    assert tip.across_um is not None
    assert tip.across_um.pairwise.mean == pytest.approx(20.0)


def test_without_the_other_end_there_is_a_distance_but_no_axis(compared_of: Callable[..., Compared]) -> None:
    compared = compared_of(needles([(NOT_PLACED, (0, 0, 0)), (NOT_PLACED, (0, 0, 7))]))

    tip = figures(compared, NEEDLE).keypoints["tip"]

    assert tip.along_um is not None
    assert tip.distance_um.pairwise.n == 1
    assert (tip.along_um.pairwise.n, tip.along_um.pairwise.mean) == (0, None)


def test_a_keypoint_that_ends_no_link_has_no_axis(compared_of: Callable[..., Compared]) -> None:
    marks = NEEDLE.model_copy(update={"links": ()})

    assert list(measured_keypoint(compared_of(np.zeros((1, 2, 2, 3))), marks, "tip")) == ["distance_um"]
    assert figures(compared_of(np.zeros((1, 2, 2, 3))), marks).keypoints["tip"].along_um is None


def test_a_study_s_figure_is_the_mean_over_its_volumes(compared_of: Callable[..., Compared]) -> None:
    # Tips 2, 4 and 12 apart: half of that from the mean, so 1, 2 and 6; mean 3, and sd √((4 + 1 + 9)/2) = √7.
    # A volume with one annotator does not count.
    shaft = (-2000.0, 0.0, 0.0)
    rows = [[(shaft, (0.0, 0.0, 0.0)), (shaft, (0.0, 0.0, apart))] for apart in (2.0, 4.0, 12.0)]
    alone = [(shaft, (0.0, 0.0, 0.0)), (NOT_PLACED, NOT_PLACED)]

    position = figures(compared_of(needles(*rows, alone)), NEEDLE).targets["position_um"].published

    assert (position.mean, position.sd, position.n) == (pytest.approx(3.0), pytest.approx(math.sqrt(7)), 3)


def test_points_of_doubt_can_be_taken_out(
    forceps: ToolSpecification, compared_of: Callable[..., Compared]
) -> None:
    compared = compared_of(np.random.default_rng(1).normal(size=(4, 2, 6, 3)))
    compared.doubtful[:2, 0, 5] = True

    without = figures(compared.without_doubtful(), forceps)

    assert without.keypoints["k5"].distance_um.published.n == 2
    assert without.targets["theta2_deg"].published.n == 2
    assert without.targets["theta1_deg"].published.n == 4


@pytest.mark.parametrize("annotators", [0, 1])
def test_what_needs_two_annotators_is_none_without_them(
    forceps: ToolSpecification, compared_of: Callable[..., Compared], annotators: int
) -> None:
    found = figures(compared_of(np.ones((3, annotators, 6, 3))), forceps)

    assert "NaN" not in found.model_dump_json()
    for statistics in found.targets.values():
        assert statistics.published.model_dump() == {"mean": None, "sd": None, "ci95": None, "n": 0}
