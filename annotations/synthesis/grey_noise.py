"""What is random in a grey value: speckle, and the noise of the electronics."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.special import gammainc, gammaincinv

GREATEST_GREY = 255

_FINENESS = 8
"""Points a grey value at which the distribution is worked out."""
_LOWEST = -400
"""The least that noise adds: single-look speckle is darker once in 10⁸ voxels."""
_LEAST_VARIANCE = 1e-4
"""Of a value that is nearly always cut to 255, so that its skewness is a number."""


@dataclass(frozen=True)
class GreyNoise:
    """The noise that is added to a voxel's grey value.

    Speckle multiplies the detected power by a gamma variate of mean 1 (fully developed, averaged over a
    number of looks: J. W. Goodman, *Speckle Phenomena in Optics*, 2007), so that after the logarithm it is
    added: alike on bright and dark, and negative on average. Gaussian noise comes after the logarithm.

    Attributes
    ----------
    looks : float
        Independent speckle patterns that are averaged.
    grey_per_db : float
        Grey values a decibel.
    sigma_grey : float
        Standard deviation of the Gaussian noise.
    """

    looks: float
    grey_per_db: float
    sigma_grey: float = 0.0

    def quantiles(self, count: int) -> NDArray[np.float64]:
        """Return what noise adds, from the lowest, of equal probability each; shape (count,)."""
        share = (np.arange(count) + 0.5) / count
        if self.sigma_grey == 0:
            return np.asarray(10 * np.log10(gammaincinv(self.looks, share) / self.looks) * self.grey_per_db)
        grey, below = self.distribution()
        return np.interp(share, below, grey)

    def moments(self) -> "MomentsByGrey":
        """Return the moments of the grey values that a voxel may have, by the value before the noise."""
        return _moments_by_grey(self)

    def distribution(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return grey values, shape (n,), and the probability of less noise than each."""
        grey = np.arange(_LOWEST * _FINENESS, GREATEST_GREY * _FINENESS + 1) / _FINENESS
        below = gammainc(self.looks, self.looks * 10 ** (grey / (10 * self.grey_per_db)))
        if self.sigma_grey > 0:
            reach = int(np.ceil(5 * self.sigma_grey * _FINENESS))
            bell = np.exp(np.square(np.arange(-reach, reach + 1) / (self.sigma_grey * _FINENESS)) / -2)
            # Beyond the ends the probabilities are 0 and 1.
            padded = np.pad(below, reach, constant_values=(0, 1))
            below = np.convolve(padded, bell / bell.sum(), mode="valid")
        return grey, np.maximum.accumulate(below)


@dataclass(frozen=True, eq=False)
class Moments:
    """Mean, variance and skewness of grey values, float32, shapes alike."""

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]
    skewness: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class MomentsByGrey:
    """Moments of whole grey values from 0 to 255, by the grey value before the noise.

    Attributes
    ----------
    table : Moments
        Of shape (n,); entry i is for the value i / 8, and above the last they change no more.
    """

    table: Moments

    def of(self, grey: NDArray[np.float32]) -> Moments:
        """Return the moments for grey values before the noise, any shape."""
        steps = grey * np.float32(_FINENESS)
        steps += np.float32(0.5)
        entry = np.clip(steps, 0, len(self.table.mean) - 1, out=steps).astype(np.int32)
        return Moments(self.table.mean[entry], self.table.variance[entry], self.table.skewness[entry])


@lru_cache(maxsize=256)
def _moments_by_grey(noise: GreyNoise) -> MomentsByGrey:
    """Work the moments out from E[Yⁿ] = Σ (kⁿ − (k − 1)ⁿ) P(Y ≥ k); Y ≥ k where noise is k − m or more."""
    _, below = noise.distribution()
    count = -_LOWEST * _FINENESS
    level = np.arange(GREATEST_GREY + 1.0)
    weights = np.stack([np.diff(level**power) for power in (1, 2, 3)], axis=1)
    # Row i: the chances for the value i / 8 to become at least 1, 2, … 255.
    rows = sliding_window_view(1 - below, (GREATEST_GREY - 1) * _FINENESS + 1)[:, ::_FINENESS]
    first, second, third = (rows[count + _FINENESS : _FINENESS : -1] @ weights).T
    variance = np.maximum(second - first**2, _LEAST_VARIANCE)
    skewness = (third - 3 * first * second + 2 * first**3) / variance**1.5
    return MomentsByGrey(Moments(*(moment.astype(np.float32) for moment in (first, variance, skewness))))
