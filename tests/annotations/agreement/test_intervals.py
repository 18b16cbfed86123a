import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.stats import bootstrap, ttest_1samp

from annotations.agreement.intervals import estimate, mean_ci95

# B. Efron and R. Tibshirani, An Introduction to the Bootstrap, 1993, table 2.1: survival of treated mice.
TREATED_MICE_DAYS = np.array([94.0, 197, 16, 38, 99, 141, 23])


def test_mean_and_its_standard_error_are_the_published_ones_of_the_mouse_data() -> None:
    """Table 2.1 there: mean 86.86 days, standard error 25.24 by the formula."""
    treated = estimate(TREATED_MICE_DAYS)
    assert treated.mean == pytest.approx(86.86, abs=0.005)
    assert treated.sd is not None
    assert treated.sd / math.sqrt(7) == pytest.approx(25.24, abs=0.005)
    assert treated.n == 7


def test_interval_of_few_values_is_that_of_an_own_bias_corrected_and_accelerated_bootstrap() -> None:
    """Efron's formulas and Hesterberg's levels, written out here, with another stream of random numbers."""
    from scipy.special import ndtr
    from scipy.stats import norm, t

    values = TREATED_MICE_DAYS
    rng = np.random.default_rng(1)
    means = np.sort(values[rng.integers(0, 7, (200_000, 7))].mean(axis=1))
    correction = norm.ppf((np.mean(means < values.mean()) + np.mean(means <= values.mean())) / 2)
    left_out = (values.sum() - values) / 6
    pulls = left_out.mean() - left_out
    acceleration = np.sum(pulls**3) / (6 * np.sum(pulls**2) ** 1.5)
    shifted = correction + np.sqrt(7 / 6) * t(6).ppf([0.025, 0.975])
    levels = ndtr(correction + shifted / (1 - acceleration * shifted))
    assert mean_ci95(values, resamples=20_000) == pytest.approx(np.quantile(means, levels), abs=2.5)


def test_interval_of_many_values_is_what_scipy_comes_to_by_resampling() -> None:
    values = np.random.default_rng(2).exponential(100.0, 201)
    theirs = bootstrap(
        (values,), np.mean, n_resamples=20_000, batch=500, method="BCa", random_state=np.random.default_rng(3)
    ).confidence_interval
    low, high = mean_ci95(values) or (0.0, 0.0)
    width = theirs.high - theirs.low
    assert (low, high) == pytest.approx((theirs.low, theirs.high), abs=0.03 * width)
    assert high - values.mean() > 1.02 * (values.mean() - low)


def test_one_gross_value_among_many_is_met_as_by_resampling() -> None:
    values = np.random.default_rng(4).normal(100.0, 10.0, 1000)
    values[17] = 20_000.0
    theirs = bootstrap(
        (values,), np.mean, n_resamples=20_000, batch=500, method="BCa", random_state=np.random.default_rng(5)
    ).confidence_interval
    assert mean_ci95(values) == pytest.approx((theirs.low, theirs.high), rel=0.2)


def test_intervals_cover_the_mean_of_skewed_values_as_often_as_they_say() -> None:
    rng = np.random.default_rng(6)
    covered = 0
    for _ in range(300):
        # The length of isotropic normal errors: mean √(8/π).
        lengths = np.linalg.norm(rng.normal(size=(30, 3)), axis=1)
        low, high = mean_ci95(lengths, resamples=500) or (math.nan, math.nan)
        covered += low <= math.sqrt(8 / math.pi) <= high
    assert 0.90 <= covered / 300 <= 0.98


def test_nothing_is_said_of_no_value_and_no_interval_of_one() -> None:
    assert estimate(np.array([])).model_dump() == {"mean": None, "sd": None, "ci95": None, "n": 0}
    assert estimate(np.array([np.nan, 3.0])).model_dump() == {"mean": 3.0, "sd": None, "ci95": None, "n": 1}


@pytest.mark.parametrize("number", [5, 30, 10_000])
def test_equal_values_have_an_interval_without_width(number: int) -> None:
    assert mean_ci95(np.full(number, 0.1)) == pytest.approx((0.1, 0.1))


@pytest.mark.parametrize("number", [2, 3, 4])
def test_fewer_than_five_values_have_students_interval(number: int) -> None:
    values = TREATED_MICE_DAYS[:number]
    expected = ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert mean_ci95(values) == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize("number", [5, 8, 30, 300])
def test_values_that_differ_by_rounding_have_the_same_interval(number: int) -> None:
    rng = np.random.default_rng(number)
    # Whole numbers: many resamples have the mean of the values, and rounding must not tell on which side.
    values = rng.integers(1, 9, number).astype(float)
    rounded = values * (1 + rng.choice([-1, 1], number) * 2**-52)
    assert mean_ci95(rounded) == pytest.approx(mean_ci95(values), rel=1e-11)


def test_same_values_give_the_same_interval_whatever_came_before() -> None:
    first = mean_ci95(TREATED_MICE_DAYS, seed=7)
    mean_ci95(TREATED_MICE_DAYS[:5], seed=7)
    np.random.default_rng(7).normal(size=10)
    assert mean_ci95(TREATED_MICE_DAYS, seed=7) == first
    assert mean_ci95(TREATED_MICE_DAYS, seed=8) != first


@given(arrays.arrays(np.float64, st.integers(5, 40), elements=st.floats(-1e6, 1e6)))
@example(np.array([2.22507386e-313, 0.0, 0.0, 0.0, 0.0]))
def test_interval_is_finite_in_order_and_within_the_values(values: np.ndarray) -> None:
    low, high = mean_ci95(values, resamples=100) or (math.nan, math.nan)
    slack = 1e-9 * np.abs(values).max()
    assert values.min() - slack <= low <= high <= values.max() + slack


def test_most_values_that_are_resampled_take_little_memory() -> None:
    values = np.random.default_rng(8).exponential(size=200)
    mean_ci95(values, resamples=10)
    tracemalloc.start()
    mean_ci95(values)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40 * 2**20
