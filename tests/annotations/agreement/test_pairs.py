import numpy as np
import pytest

from annotations.agreement.pairs import bland_altman, pair_results
from annotations.agreement.results import BlandAltman

# J. M. Bland and D. G. Altman, Lancet 327 (1986), table 1: peak flow in l/min, first readings.
WRIGHT = np.array([494.0, 395, 516, 434, 476, 557, 413, 442, 650, 433, 417, 656, 267, 478, 178, 423, 427])
MINI_WRIGHT = np.array(
    [512.0, 430, 520, 428, 500, 600, 364, 380, 658, 445, 432, 626, 260, 477, 259, 350, 451]
)


def test_published_example_of_bland_and_altman_is_reproduced() -> None:
    """Lancet 1986: bias −2.1, sd 38.8, limits −79.7 and 75.5 (two sd), intervals as printed there."""
    found = bland_altman(WRIGHT - MINI_WRIGHT, (WRIGHT + MINI_WRIGHT) / 2)
    assert found.bias is not None
    assert found.sd is not None
    assert found.limits is not None
    assert found.low_ci95 is not None
    assert found.high_ci95 is not None
    assert found.n == 17
    assert found.bias == pytest.approx(-2.1, abs=0.05)
    assert found.sd == pytest.approx(38.8, abs=0.05)
    # The paper rounds before it multiplies, and takes 2 where this takes 1.96.
    assert found.limits[0] + (1.96 - 2) * found.sd == pytest.approx(-79.7, abs=0.1)
    assert found.limits[1] - (1.96 - 2) * found.sd == pytest.approx(75.5, abs=0.1)
    assert found.bias_ci95 == pytest.approx((-22.0, 17.8), abs=0.1)
    assert np.add(found.low_ci95, (1.96 - 2) * found.sd) == pytest.approx([-114.3, -45.1], abs=0.2)
    assert np.subtract(found.high_ci95, (1.96 - 2) * found.sd) == pytest.approx([40.9, 110.1], abs=0.2)


def test_one_common_volume_has_a_bias_and_nothing_else() -> None:
    assert bland_altman(np.array([3.0, np.nan]), np.array([1.0, np.nan])) == BlandAltman(
        bias=3.0, n=1, points=((1.0, 3.0),)
    )
    assert bland_altman(np.array([np.nan]), np.array([np.nan])) == BlandAltman()


def test_two_who_always_agree_have_limits_without_width() -> None:
    found = bland_altman(np.zeros(5), np.arange(5.0))
    assert found.limits == found.bias_ci95 == found.low_ci95 == (0.0, 0.0)


def test_points_that_are_kept_include_both_extremes() -> None:
    differences = np.random.default_rng(0).normal(size=1000)
    kept = [difference for _, difference in bland_altman(differences, differences, most_points=50).points]
    assert len(kept) == 50
    assert (min(kept), max(kept)) == (differences.min(), differences.max())
    assert np.median(kept) == pytest.approx(np.median(differences), abs=0.1)


def test_pairs_are_of_those_with_common_volumes_the_first_minus_the_second() -> None:
    values = np.array([[1.0, 3.0, np.nan], [2.0, 5.0, np.nan], [np.nan, np.nan, 7.0]])
    (pair,) = pair_results(("anna", "ben", "cleo"), {"theta1_deg": values}, {"theta1_deg": values + 10})
    assert (pair.first, pair.second) == ("anna", "ben")
    assert pair.components["theta1_deg"].bias == -2.5
    assert set(pair.components["theta1_deg"].points) == {(12.0, -2.0), (13.5, -3.0)}


def test_many_pairs_keep_few_points_each() -> None:
    values = np.random.default_rng(1).normal(size=(600, 20))
    pairs = pair_results([f"a{number}" for number in range(20)], {"x": values}, {"x": values})
    assert sum(len(pair.components["x"].points) for pair in pairs) <= 10_000
