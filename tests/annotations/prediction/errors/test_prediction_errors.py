"""Errors of predictions by the published formulas."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from annotations.geometry.rotations import matrix, quaternion
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.errors.prediction_errors import (
    error_figures,
    far_share,
    positions_array_um,
    prediction_errors,
    summarise,
)
from tests.annotations.prediction.known_keypoints import FORCEPS
from tests.annotations.prediction.made_predictions import TRUE_UM

NEEDLE = shipped_tools()["needle"]
NAMES = FORCEPS.keypoint_names
TRUE = positions_array_um([TRUE_UM], FORCEPS)

turns = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda parts: math.hypot(*parts) > 0.1).map(quaternion)
shifts = st.tuples(*[st.floats(-2e4, 2e4)] * 3)
noises = st.lists(st.floats(-3e3, 3e3), min_size=18, max_size=18).map(
    lambda each: np.reshape(each, (1, 6, 3))
)


def straight(y_um: float = 0.0) -> dict[str, tuple[float, float, float]]:
    """Return a tool along x, beside the axis by some micrometres."""
    return {name: (1000.0 * place, y_um, 0.0) for place, name in enumerate(NAMES)}


def test_known_errors() -> None:
    found = straight() | {"k1": (1000.0, 1000.0, 0.0), "k5": (4000.0, 0.0, 2000.0)}

    errors = prediction_errors(
        positions_array_um([found], FORCEPS), positions_array_um([straight()], FORCEPS), FORCEPS
    )

    assert errors.targets["position_mm"] == pytest.approx([0.5])
    assert errors.targets["orientation_deg"] == pytest.approx([45.0])
    assert errors.targets["theta1_deg"] == pytest.approx([45.0])
    assert errors.targets["theta2_deg"] == pytest.approx([90.0])
    assert errors.keypoints_um[0] == pytest.approx([0, 1000, 0, 0, 0, math.hypot(1000, 2000)])


def test_the_published_angle_has_no_sign() -> None:
    up = straight() | {"k2": (2000.0, 0.0, 0.0), "k3": (3000.0, 1000.0, 0.0)}
    down = straight() | {"k2": (2000.0, 0.0, 0.0), "k3": (3000.0, -1000.0, 0.0)}

    errors = prediction_errors(
        positions_array_um([up], FORCEPS), positions_array_um([down], FORCEPS), FORCEPS
    )

    assert errors.targets["theta1_deg"] == pytest.approx([0.0])


@given(turns, shifts, noises)
def test_errors_are_the_same_however_the_scene_is_turned_and_moved(
    turn: tuple[float, float, float, float], shift_um: tuple[float, float, float], noise_um: np.ndarray
) -> None:
    found = TRUE + noise_um

    here = prediction_errors(found, TRUE, FORCEPS)
    there = prediction_errors(found @ matrix(turn).T + shift_um, TRUE @ matrix(turn).T + shift_um, FORCEPS)

    for name, values in here.targets.items():
        np.testing.assert_allclose(there.targets[name], values, atol=1e-4, err_msg=name)
    np.testing.assert_allclose(there.keypoints_um, here.keypoints_um, atol=1e-6)


@given(shifts)
def test_a_shift_is_a_position_error_and_nothing_else(shift_um: tuple[float, float, float]) -> None:
    errors = prediction_errors(TRUE + np.array(shift_um), TRUE, FORCEPS)

    assert errors.targets["position_mm"] == pytest.approx([math.hypot(*shift_um) / 1000], abs=1e-9)
    for name in ("orientation_deg", "theta1_deg", "theta2_deg"):
        assert errors.targets[name] == pytest.approx([0.0], abs=1e-6)


@given(noises)
@settings(max_examples=30)
def test_errors_are_differences_of_the_published_targets(noise_um: np.ndarray) -> None:
    found_um = {name: tuple(um) for name, um in zip(NAMES, (TRUE + noise_um)[0], strict=True)}
    found, true = pose_targets(found_um, FORCEPS), pose_targets(TRUE_UM, FORCEPS)

    errors = prediction_errors(TRUE + noise_um, TRUE, FORCEPS)

    assert found.position_um is not None
    assert true.position_um is not None
    expected_um = math.dist(found.position_um, true.position_um)
    assert errors.targets["position_mm"] == pytest.approx([expected_um / 1000])
    for name, angle_deg in true.angles_deg.items():
        assert errors.targets[f"{name}_deg"] == pytest.approx([abs(found.angles_deg[name] - angle_deg)])


def test_a_missing_keypoint_takes_its_targets_along_and_is_counted() -> None:
    found = positions_array_um([TRUE_UM, {name: TRUE_UM[name] for name in NAMES if name != "k4"}], FORCEPS)

    errors = prediction_errors(found, np.concatenate([TRUE, TRUE]), FORCEPS)
    overview = summarise(errors, FORCEPS)

    assert np.isnan(errors.targets["theta2_deg"]).tolist() == [False, True]
    assert overview.targets["theta2_deg"].n == 1
    assert overview.targets["theta2_deg"].missing == 1
    assert overview.targets["theta1_deg"].missing == 0
    assert overview.keypoints_um["k4"].missing == 1
    assert overview.all_keypoints_um.n == 11


def test_what_the_truth_lacks_is_not_held_against_the_network() -> None:
    truth = positions_array_um([{name: TRUE_UM[name] for name in ("k0", "k1")}], FORCEPS)

    overview = summarise(prediction_errors(TRUE, truth, FORCEPS), FORCEPS)

    assert overview.targets["position_mm"].n == 1
    assert overview.targets["theta1_deg"].n == overview.targets["theta1_deg"].missing == 0
    assert overview.all_keypoints_um.n == 2
    assert overview.all_keypoints_um.missing == 0


def test_keypoints_more_than_two_millimetres_off_are_far() -> None:
    noise_um = np.zeros((1, 6, 3))
    noise_um[0, 0, 0], noise_um[0, 1, 0], noise_um[0, 2, 1] = 2001.0, 1999.0, -5500.0

    assert summarise(prediction_errors(TRUE + noise_um, TRUE, FORCEPS), FORCEPS).far_share == 2 / 6


def test_a_keypoint_that_was_not_found_is_far() -> None:
    found = positions_array_um([{name: TRUE_UM[name] for name in NAMES[:4]}], FORCEPS)

    assert summarise(prediction_errors(found, TRUE, FORCEPS), FORCEPS).far_share == 2 / 6


def test_what_is_rightly_said_to_be_out_of_range_is_neither_missing_nor_far() -> None:
    found = positions_array_um([{name: TRUE_UM[name] for name in NAMES[:4]}], FORCEPS)
    found[0, 0] += 3000.0
    # The first one is seen all the same, and the last but one should have been.
    is_in_range = np.array([[False, True, True, True, True, False]])

    errors = prediction_errors(found, TRUE, FORCEPS, is_in_range)
    overview = summarise(errors, FORCEPS)

    assert errors.keypoints_missing[0].tolist() == [False] * 4 + [True, False]
    assert errors.keypoints_rightly_absent[0].tolist() == [False] * 5 + [True]
    assert overview.all_keypoints_um.missing == 1
    assert overview.far_share == 2 / 5
    assert overview.targets["theta2_deg"].missing == 1


def test_the_far_are_counted_among_those_that_count() -> None:
    assert far_share(np.array([[1999.0, 2001.0], [np.inf, np.nan]])) == 2 / 3
    assert far_share(np.full(3, np.nan)) is None


def test_figures_are_the_usual_ones() -> None:
    values = np.array([1.0, 2.0, np.nan, 3.0, 10.0])

    figures = error_figures(values, np.isnan(values))

    assert figures.mean == 4.0
    assert figures.sd == pytest.approx(np.std([1, 2, 3, 10], ddof=1))
    assert figures.median == 2.5
    assert figures.p95 == pytest.approx(np.percentile([1, 2, 3, 10], 95))
    assert (figures.n, figures.missing) == (4, 1)


@pytest.mark.parametrize("count", [0, 1])
def test_few_values_have_no_spread(count: int) -> None:
    figures = error_figures(np.ones(count), np.zeros(count, dtype=bool))

    assert figures.mean == (1.0 if count else None)
    assert figures.sd is None


def test_targets_that_a_tool_lacks_are_absent() -> None:
    points = positions_array_um([{"tip": (0.0, 0.0, 0.0), "shaft": (0.0, 0.0, 2000.0)}], NEEDLE)

    overview = summarise(prediction_errors(points, points, NEEDLE), NEEDLE)

    assert set(overview.targets) == {"position_mm", "orientation_deg"}
    assert set(overview.keypoints_um) == {"tip", "shaft"}


def test_no_volumes_have_no_errors() -> None:
    nothing = positions_array_um([], FORCEPS)

    overview = summarise(prediction_errors(nothing, nothing, FORCEPS), FORCEPS)

    assert overview.far_share is None
    assert overview.targets["position_mm"].mean is None
