import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from annotations.agreement.method_comparison import method_comparison, paired_test

# C. Darwin's maize, crossed less self-fertilised: the example of scipy's documentation of the test.
DARWIN = np.array([6.0, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75])


def test_published_example_of_darwins_maize_is_reproduced() -> None:
    """In scipy's documentation: T = 24 of negative ranks, p = 0.0413; the effect is then (96 − 24) / 120."""
    found = paired_test(DARWIN)
    assert found.p_value == pytest.approx(0.041259765625)
    assert found.effect == pytest.approx(0.6)
    assert found.difference.mean == pytest.approx(20.93, abs=0.005)
    assert found.difference.n == 15


@settings(max_examples=25)
@given(arrays.arrays(np.float64, st.integers(1, 30), elements=st.integers(-5, 5)))
def test_effect_is_that_of_pairs_of_differences(differences: np.ndarray) -> None:
    """Independently: ranks' sums are counts of Walsh averages (J. W. Tukey, 1949), ties counting half."""
    known = differences[differences != 0]
    row, column = np.triu_indices(known.size)
    sums = np.sign(known[row] + known[column])
    found = paired_test(differences, resamples=20)
    if known.size:
        assert found.effect == pytest.approx(sums.mean())
        assert found.p_value is not None
        assert 0 <= found.p_value <= 1
    else:
        assert (found.effect, found.p_value) == (None, None)


def test_sign_says_that_keypoints_are_further_apart() -> None:
    assert paired_test(np.array([1.0, 2, 3])).effect == 1
    assert paired_test(-np.array([1.0, 2, 3])).effect == -1


def test_only_volumes_and_targets_that_both_methods_have_are_compared() -> None:
    found = method_comparison(
        (["v1", "v2", "v3"], ["v3", "v4", "v1"]),
        (
            {"position_um": np.array([10.0, 20, 30]), "theta1_deg": np.array([1.0, 1, 1])},
            {"position_um": np.array([28.0, 1, 9])},
        ),
    )
    assert list(found) == ["position_um"]
    difference = found["position_um"].difference
    assert (difference.n, difference.mean) == (2, 1.5)


def test_volumes_without_a_figure_by_either_method_do_not_count() -> None:
    found = method_comparison(
        (["v1", "v2"], ["v1", "v2"]),
        ({"position_um": np.array([10.0, np.nan])}, {"position_um": np.array([9.0, 9.0])}),
    )
    assert found["position_um"].difference.n == 1


def test_what_rounding_left_is_no_difference() -> None:
    found = paired_test(np.array([1e-14, 3e-14, 2e-14, 1e-14, 5e-14, 2e-14]))
    assert (found.p_value, found.effect) == (None, None)
    assert found.difference.n == 6
