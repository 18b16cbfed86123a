import numpy as np
import pytest

from annotations.fitting.robust_sigma import robust_sigma


def test_normal_deviations_give_their_standard_deviation_though_some_are_gross() -> None:
    deviations = np.random.default_rng(0).normal(0, 3.0, 20_000)
    assert robust_sigma(deviations) == pytest.approx(3.0, rel=0.02)
    deviations[:200] = 1e6
    assert robust_sigma(deviations) == pytest.approx(3.0, rel=0.04)
