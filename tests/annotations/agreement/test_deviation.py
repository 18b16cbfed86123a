import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.agreement.deviation import (
    deviations,
    distances,
    distances_from_mean,
    distances_from_others,
    mean_of_all,
    means_of_others,
)
from annotations.agreement.measured import Measured, Metric
from annotations.geometry.angles import angle_deg

NOBODY = (math.nan,) * 3


def measured(metric: Metric, *volumes: list[tuple[float, ...]]) -> Measured:
    return Measured("any", metric, np.array(volumes, dtype=np.float64))


def level(yaw_deg: float) -> tuple[float, float, float]:
    return math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg)), 0.0


def test_positions_worked_by_hand() -> None:
    # An equilateral triangle of side 6: the mean is its centre, 6/√3 from each corner; the mean of two
    # corners is 6·√3/2 from the third; the corners are 6 apart.
    corners = [(0.0, 0.0, 5.0), (6.0, 0.0, 5.0), (3.0, 3 * math.sqrt(3), 5.0)]

    found = deviations(measured("distance", corners))

    assert found.published == pytest.approx([6 / math.sqrt(3)])
    assert found.leave_one_out == pytest.approx([3 * math.sqrt(3)])
    assert found.pairwise == pytest.approx([6.0])


def test_numbers_worked_by_hand() -> None:
    # 10, 20, 60: the mean is 30, so (20 + 10 + 30)/3 = 20; means of the others are 40, 35 and 15, so
    # (30 + 15 + 45)/3 = 30; pairs are 10, 50 and 40 apart, so 100/3.
    found = deviations(measured("difference", [(10.0,), (20.0,), (60.0,)]))

    assert found.published == pytest.approx([20.0])
    assert found.leave_one_out == pytest.approx([30.0])
    assert found.pairwise == pytest.approx([100 / 3])


def test_directions_worked_by_hand() -> None:
    # Symmetric about 30°: the mean is at 30°, so (30 + 0 + 30)/3 = 20; means of the others are at 45°, 30°
    # and 15°, so (45 + 0 + 45)/3 = 30; pairs are 30, 60 and 30 apart, so 40.
    found = deviations(measured("angle", [level(0.0), level(30.0), level(60.0)]))

    assert found.published == pytest.approx([20.0])
    assert found.leave_one_out == pytest.approx([30.0])
    assert found.pairwise == pytest.approx([40.0])


def test_two_annotators_are_half_of_their_distance_from_their_mean() -> None:
    found = deviations(measured("distance", [(0.0, 0.0, 0.0), (3.0, 4.0, 0.0)]))

    assert (found.published[0], found.leave_one_out[0], found.pairwise[0]) == pytest.approx((2.5, 5.0, 5.0))


@pytest.mark.parametrize("metric", ["distance", "angle", "difference"])
def test_two_annotators_have_one_number_as_leave_one_out_and_as_pairwise_deviation(metric: Metric) -> None:
    values = np.random.default_rng(3).normal(size=(50, 3, 1 if metric == "difference" else 3))
    if metric == "angle":
        values /= np.linalg.norm(values, axis=2, keepdims=True)
    values[:40, 1] = np.nan

    found = deviations(Measured("any", metric, values))

    assert (found.leave_one_out[:40] == found.pairwise[:40]).all()
    assert (found.leave_one_out[40:] != found.pairwise[40:]).any()


def test_each_volume_has_annotators_of_its_own() -> None:
    found = deviations(
        measured(
            "difference",
            [(1.0,), (3.0,), (math.nan,)],
            [(math.nan,), (10.0,), (20.0,)],
            [(7.0,), (math.nan,), (math.nan,)],
            [(math.nan,), (math.nan,), (math.nan,)],
        )
    )

    assert found.published == pytest.approx([1.0, 5.0, math.nan, math.nan], nan_ok=True)
    assert found.leave_one_out == pytest.approx([2.0, 10.0, math.nan, math.nan], nan_ok=True)
    assert found.pairwise == pytest.approx([2.0, 10.0, math.nan, math.nan], nan_ok=True)


def test_opposite_directions_have_no_mean_but_are_180_degrees_apart() -> None:
    found = deviations(measured("angle", [level(20.0), level(200.0)]))

    assert np.isnan(found.published[0])
    assert found.pairwise == pytest.approx([180.0])


def test_a_volume_where_the_others_cancel_has_no_leave_one_out_figure() -> None:
    found = deviations(measured("angle", [level(0.0), level(180.0), level(90.0)]))

    assert np.isnan(found.leave_one_out[0])
    # The mean of all three is at 90°.
    assert found.published == pytest.approx([60.0])


def test_one_who_has_no_value_still_has_others() -> None:
    target = measured("difference", [(1.0,), (3.0,), (math.nan,)])

    assert means_of_others(target)[0, :, 0] == pytest.approx([3.0, 1.0, 2.0])
    assert distances_from_others(target)[0] == pytest.approx([2.0, 2.0, math.nan], nan_ok=True)


def test_one_alone_is_at_no_distance_from_the_mean() -> None:
    target = measured("distance", [(1.0, 2.0, 3.0), NOBODY])

    assert distances_from_mean(target)[0] == pytest.approx([0.0, math.nan], nan_ok=True)
    assert mean_of_all(target)[0] == pytest.approx([1.0, 2.0, 3.0])


coordinates = st.floats(-20_000, 20_000)


@given(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=2, max_size=6), st.booleans())
def test_the_statistics_are_as_defined(values: list[tuple[float, float, float]], is_direction: bool) -> None:
    points = [np.array(value) for value in values]
    metric: Metric = "angle" if is_direction else "distance"
    if is_direction:
        points = [point / np.linalg.norm(point) for point in points if np.linalg.norm(point) > 1]
    sums = [sum(points), *(sum(points) - point for point in points)]
    if len(points) < 2 or (is_direction and min(np.linalg.norm(each) for each in sums) < 1e-3):
        return

    def apart(first: np.ndarray, second: np.ndarray) -> float:
        return angle_deg(first, second) if is_direction else float(np.linalg.norm(first - second))

    number = len(points)
    mean = sum(points) / number
    found = deviations(measured(metric, [tuple(point) for point in points]))

    assert found.published[0] == pytest.approx(np.mean([apart(each, mean) for each in points]), abs=1e-6)
    assert found.leave_one_out[0] == pytest.approx(
        np.mean([apart(each, (sum(points) - each) / (number - 1)) for each in points]), abs=1e-6
    )
    assert found.pairwise[0] == pytest.approx(
        np.mean([apart(first, second) for first, second in combinations(points, 2)]), abs=1e-6
    )


def test_distances_broadcast() -> None:
    assert distances(np.zeros((4, 2, 1)), np.ones((4, 1, 1)), "difference").shape == (4, 2)
