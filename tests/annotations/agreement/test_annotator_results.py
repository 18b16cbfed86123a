from collections.abc import Callable

import numpy as np
import pytest

from annotations.agreement.annotator_results import annotator_results
from annotations.agreement.compared import Compared
from annotations.agreement.components import component_values
from annotations.agreement.measured import measured_targets
from annotations.agreement.results import AnnotatorResult
from annotations.geometry.tool import ToolSpecification

MakeCompared = Callable[..., Compared]

STRAIGHT_UM = np.array(
    [[0.0, 0, 0], [11_000, 0, 0], [11_500, 0, 0], [16_500, 0, 0], [17_000, 0, 0], [23_000, 0, 0]]
)


def results(compared: Compared, tool: ToolSpecification) -> tuple[AnnotatorResult, ...]:
    measured = measured_targets(compared, tool)
    return annotator_results(compared, measured, component_values(measured.values()), {}, {}, resamples=200)


def shifted(volumes: int, annotators: int, *, noise_um: float, seed: int = 0) -> np.ndarray:
    """Return straight tools, each moved as a whole by noise."""
    moves = np.random.default_rng(seed).normal(0, noise_um, (volumes, annotators, 1, 3))
    return STRAIGHT_UM + moves


def test_case_worked_by_hand(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    positions_um = np.stack([STRAIGHT_UM + np.array([0, y_um, 0]) for y_um in (0.0, 10.0, 50.0)])[np.newaxis]
    positions_um = np.concatenate([positions_um, positions_um])
    positions_um[1, 2] = np.nan
    anna, ben, cleo = results(compared_of(positions_um), forceps)
    # In v0 from 30, 25 and 5; in v1, without cleo, from 10 and 0.
    assert anna.deviation["position_um"].mean == pytest.approx((30 + 10) / 2)
    assert ben.deviation["position_um"].mean == pytest.approx((15 + 10) / 2)
    assert (cleo.deviation["position_um"].mean, cleo.deviation["position_um"].n) == (pytest.approx(45.0), 1)
    assert anna.bias["position_y_um"].mean == pytest.approx(-20.0)
    assert ben.bias["position_y_um"].mean == pytest.approx((-15 + 10) / 2)
    assert ben.bias["position_y_um"].sd == pytest.approx(25 / np.sqrt(2))
    assert cleo.bias["position_x_um"].mean == pytest.approx(0.0)
    assert (anna.documents, anna.done, cleo.documents) == (2, 2, 1)
    assert anna.active_seconds.mean == 60.0


def test_volume_of_one_annotator_tells_nothing_but_time(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = np.stack([STRAIGHT_UM, np.full((6, 3), np.nan)])[np.newaxis]
    anna, ben = results(compared_of(positions_um), forceps)
    assert anna.deviation["position_um"].n == anna.bias["orientation_1_deg"].n == 0
    assert (anna.active_seconds.n, ben.active_seconds.n) == (1, 0)


def test_known_bias_is_found_within_its_interval(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = shifted(200, 3, noise_um=50.0)
    positions_um[:, 1] += (0.0, 0.0, 40.0)
    _, ben, _ = results(compared_of(positions_um), forceps)
    low, high = ben.bias["position_z_um"].ci95 or (0.0, 0.0)
    assert low < 40.0 < high
    # Noise of one against the mean of two.
    assert ben.bias["position_z_um"].sd == pytest.approx(50 * np.sqrt(1.5), rel=0.15)


def test_bias_of_direction_is_across_the_mean_direction(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    turn = np.radians(2.0)
    turned_um = STRAIGHT_UM @ np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    positions_um = np.stack([STRAIGHT_UM, turned_um])[np.newaxis]
    anna, ben = results(compared_of(positions_um), forceps)
    assert ben.bias["orientation_1_deg"].mean == pytest.approx(2.0)
    assert anna.bias["orientation_1_deg"].mean == pytest.approx(-2.0)
    assert ben.bias["orientation_2_deg"].mean == pytest.approx(0.0, abs=1e-9)


def test_gross_error_is_the_outlier_of_who_made_it_alone(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = shifted(60, 3, noise_um=50.0)
    positions_um[7, 1] += (3000.0, 0.0, 0.0)
    positions_um[9, 1] += (1000.0, 0.0, 0.0)
    anna, ben, cleo = results(compared_of(positions_um), forceps)
    assert [(each.volume, each.target) for each in ben.outliers] == [
        ("v7", "position_um"),
        ("v9", "position_um"),
    ]
    assert ben.outliers[0].value == pytest.approx(3000, abs=200)
    assert ben.outliers[1].value > ben.outliers[1].limit > 200
    assert (anna.outliers, cleo.outliers) == ((), ())


def test_two_who_are_off_in_the_same_volume_are_both_found(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    positions_um = shifted(60, 5, noise_um=50.0)
    positions_um[7, 1] += (3000.0, 0.0, 0.0)
    positions_um[7, 2] += (0.0, 5000.0, 0.0)
    found = results(compared_of(positions_um), forceps)
    assert [[each.volume for each in one.outliers] for one in found] == [[], ["v7"], ["v7"], [], []]


def test_of_two_alone_both_are_outliers(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    positions_um = shifted(60, 2, noise_um=50.0)
    positions_um[7, 1] += (3000.0, 0.0, 0.0)
    found = results(compared_of(positions_um), forceps)
    assert [[each.volume for each in one.outliers] for one in found] == [["v7"], ["v7"]]


def test_normal_errors_have_hardly_any_outlier(compared_of: MakeCompared, forceps: ToolSpecification) -> None:
    found = results(compared_of(shifted(2000, 3, noise_um=50.0)), forceps)
    assert sum(len(one.outliers) for one in found) <= 6


def test_annotators_who_agree_exactly_have_no_outlier(
    compared_of: MakeCompared, forceps: ToolSpecification
) -> None:
    found = results(compared_of(shifted(5, 3, noise_um=0.0)), forceps)
    assert all(one.outliers == () for one in found)
    assert found[0].deviation["position_um"].ci95 == (0.0, 0.0)
