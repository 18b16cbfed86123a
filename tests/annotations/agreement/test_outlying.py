import numpy as np
import pytest

from annotations.agreement.outlying import outlying_limit


def test_limit_is_that_of_a_case_worked_by_hand() -> None:
    # Median 3; deviations 2, 1, 0, 1, 97, of which the median is 1.
    assert outlying_limit(np.array([1.0, 2, 3, 4, 100, np.nan])) == pytest.approx(3 + 5 * 1.4826)


def test_normal_errors_exceed_it_as_seldom_as_it_says() -> None:
    errors = np.random.default_rng(0).normal(size=(200_000, 3))
    angles, positions = np.abs(errors[:, 0]), np.linalg.norm(errors, axis=1)
    assert 1 / 6000 < np.mean(angles > outlying_limit(angles)) < 1 / 1500
    assert np.mean(positions > outlying_limit(positions)) < 1 / 10_000


def test_equal_distances_are_none_of_them_beyond_it() -> None:
    assert outlying_limit(np.full((2, 2), 3.0)) > 3.0
    assert outlying_limit(np.array([np.nan])) == np.inf
