import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from annotations.agreement.reliability import intraclass_correlation, reliability_of
from annotations.agreement.results import Reliability

# P. E. Shrout and J. L. Fleiss, Psychological Bulletin 86 (1979), table 2: six targets by four judges.
SHROUT_FLEISS = np.array(
    [[9.0, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
)


def test_published_example_of_shrout_and_fleiss_is_reproduced() -> None:
    """Their table 4: ICC(2,1) = .29; the interval is that of R's psych package for their data."""
    found = intraclass_correlation(SHROUT_FLEISS, "abcd")
    assert found.icc == pytest.approx(0.29, abs=0.005)
    assert found.ci95 == pytest.approx((0.019, 0.761), abs=0.0005)
    assert (found.n, found.annotators) == (6, ("a", "b", "c", "d"))


def test_correlation_is_that_of_variances_from_an_analysis_by_least_squares() -> None:
    """An independent analysis of variance: sums of squares of nested linear models with dummy variables."""
    table = np.random.default_rng(0).normal(size=(9, 3)) + 2 * np.arange(9.0)[:, np.newaxis]
    table += np.array([0.0, 0.7, -0.4])
    n, k = table.shape
    volumes = np.repeat(np.eye(n), k, axis=0)
    annotators = np.tile(np.eye(k), (n, 1))
    one = np.ones((n * k, 1))

    def left(*columns: np.ndarray) -> float:
        design = np.hstack([one, *columns])
        fitted = design @ np.linalg.lstsq(design, table.ravel())[0]
        return float(np.sum((table.ravel() - fitted) ** 2))

    mse = left(volumes, annotators) / ((n - 1) * (k - 1))
    between_volumes = ((left(annotators) - left(volumes, annotators)) / (n - 1) - mse) / k
    between_annotators = ((left(volumes) - left(volumes, annotators)) / (k - 1) - mse) / n
    expected = between_volumes / (between_volumes + between_annotators + mse)
    assert intraclass_correlation(table).icc == pytest.approx(expected)


def test_interval_covers_the_true_correlation_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    covered = 0
    for _ in range(400):
        table = 3 * rng.normal(size=(30, 1)) + 0.5 * rng.normal(size=(1, 3)) + rng.normal(size=(30, 3))
        low, high = intraclass_correlation(table).ci95 or (np.nan, np.nan)
        covered += low <= 9 / (9 + 0.25 + 1) <= high
    assert 0.90 <= covered / 400 <= 0.98


def test_a_constant_bias_lowers_the_correlation_because_agreement_is_absolute() -> None:
    table = np.random.default_rng(2).normal(size=(20, 1)) + np.array([0.0, 5.0])
    icc = intraclass_correlation(table).icc
    assert icc is not None
    assert icc < 0.2


@pytest.mark.parametrize("table", [np.zeros((0, 3)), np.ones((1, 3)), np.ones((5, 1)), np.full((5, 3), 0.1)])
def test_nothing_is_said_of_less_than_two_or_of_what_does_not_vary(table: np.ndarray) -> None:
    found = intraclass_correlation(table)
    assert (found.icc, found.ci95, found.n) == (None, None, len(table))


def test_annotators_who_agree_exactly_correlate_fully() -> None:
    found = intraclass_correlation(np.repeat(np.arange(4.0)[:, np.newaxis], 3, axis=1))
    assert (found.icc, found.ci95) == (1.0, (1.0, 1.0))


@given(
    arrays.arrays(np.float64, st.tuples(st.integers(2, 6), st.integers(2, 4)), elements=st.integers(-9, 9))
)
def test_no_table_gives_numbers_that_are_none(table: np.ndarray) -> None:
    found = intraclass_correlation(table)
    if found.icc is not None:
        assert np.isfinite(found.icc)
    if found.ci95 is not None:
        low, high = found.ci95
        assert np.isfinite([low, high]).all()
        assert low <= high


def test_volumes_that_all_did_count_and_who_did_none_is_not_compared() -> None:
    values = np.array([[1.0, 1.5, np.nan], [2.0, 2.0, np.nan], [3.0, np.nan, np.nan], [5.0, 5.5, np.nan]])
    found = reliability_of(("anna", "ben", "cleo"), {"theta1_deg": values})["theta1_deg"]
    assert found == intraclass_correlation(values[[0, 1, 3], :2], ("anna", "ben"))
    assert found.n == 3
    assert reliability_of(("anna",), {"x": np.full((2, 1), np.nan)}) == {"x": Reliability()}
