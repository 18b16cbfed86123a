import numpy as np
import pytest

from annotations.geometry.body import Surface
from annotations.synthesis.grey_noise import GreyNoise
from annotations.synthesis.grid import Grid
from annotations.synthesis.scanner import Scanner

NOISES = [GreyNoise(2.0, 4.6), GreyNoise(1.0, 4.6, 5.0), GreyNoise(3.5, 4.6, 0.5), GreyNoise(2.0, 4.6, 12.0)]


@pytest.mark.parametrize("noise", NOISES)
def test_quantiles_are_those_of_speckle_and_gaussian_noise_added(noise: GreyNoise) -> None:
    rng = np.random.default_rng(1)
    power = rng.gamma(noise.looks, 1 / noise.looks, size=400_000)
    drawn = 10 * np.log10(power) * noise.grey_per_db + rng.normal(0, noise.sigma_grey, size=len(power))

    np.testing.assert_allclose(noise.quantiles(21), np.quantile(drawn, (np.arange(21) + 0.5) / 21), atol=0.35)


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("grey", [3.0, 24.125, 120.0, 240.0, 300.0])
def test_moments_are_those_of_grey_values_that_are_cut_to_whole_numbers(
    noise: GreyNoise, grey: float
) -> None:
    values = np.clip(np.floor(grey + noise.quantiles(400_000)), 0, 255)

    moments = noise.moments().of(np.array([grey], dtype=np.float32))

    centred = values - values.mean()
    assert moments.mean[0] == pytest.approx(values.mean(), abs=0.05)
    assert moments.variance[0] == pytest.approx(values.var(), rel=0.02, abs=0.02)
    if values.std() > 0.5:
        assert moments.skewness[0] == pytest.approx((centred**3).mean() / values.std() ** 3, abs=0.03)


def test_gaussian_noise_spreads_a_scanners_grey_values() -> None:
    nothing, grid = Surface(np.full(64, np.inf), np.zeros(64)), Grid((1, 1, 1024))
    bits = np.arange(65536, dtype=np.uint16).reshape(64, 1024)
    quiet = Scanner(medium_db=-100, noise_grey=120.0, looks=1e3)

    spread = {
        sigma: Scanner(medium_db=-100, noise_grey=120.0, looks=1e3, noise_sigma_grey=sigma)
        .image(nothing, grid, bits)
        .std()
        for sigma in (0.0, 8.0)
    }

    assert quiet.noise_sigma_grey == 0
    assert spread[8.0] ** 2 == pytest.approx(8**2 + spread[0.0] ** 2, rel=0.03)
