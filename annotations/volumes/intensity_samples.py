"""The intensities that occur in an array, counted: enough of them for statistics."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from annotations.volumes.volume import Array

_SAMPLES = 250_000
"""Enough: of the 99.8th percentile the rank is known within 0.02 %."""


@dataclass(frozen=True, eq=False)
class IntensitySamples:
    """Intensities in ascending order, and how often each of them occurs.

    Attributes
    ----------
    values : numpy.ndarray of float64, shape (n,)
        Finite.
    counts : numpy.ndarray of int, shape (n,)
    """

    values: NDArray[np.float64]
    counts: NDArray[np.intp]

    @property
    def size(self) -> int:
        """How many there are, equal ones included."""
        return int(self.counts.sum())

    def percentile(self, percent: float) -> float:
        """Return what NumPy's function of this name does: between two ranks, it interpolates."""
        place = percent / 100.0 * (self.size - 1)
        rank = math.floor(place)
        upto = np.cumsum(self.counts)
        below, above = self.values[np.searchsorted(upto, (rank, min(rank + 1, upto[-1] - 1)), side="right")]
        return float(below + (place - rank) * (above - below))

    def above(self, value: float) -> Self:
        """Return those that are greater."""
        first = int(np.searchsorted(self.values, value, side="right"))
        return type(self)(self.values[first:], self.counts[first:])

    def deviations_from(self, value: float) -> Self:
        """Return how far each is from a value."""
        deviations = np.abs(self.values - value)
        order = np.argsort(deviations)
        return type(self)(deviations[order], self.counts[order])


def evenly_sampled(data: Array, count: int) -> Array:
    """Return at least so many voxels of an array, evenly over all its axes; all where there are no more.

    They lie equally far apart in memory, by a number that has no factor in common with a row's or a plane's
    length: else of a volume of three planes they might all lie in one.

    Parameters
    ----------
    data : numpy.ndarray, shape (x, y, z)
        Best C- or Fortran-contiguous; else it is copied.
    count : int
    """
    step = max(1, data.size // count)
    fast, middle, _ = sorted(range(3), key=lambda axis: data.strides[axis])
    while math.gcd(step, data.shape[fast] * data.shape[middle]) > 1:
        step -= 1
    return data.ravel(order="K")[::step]


def intensity_samples(data: Array) -> IntensitySamples:
    """Return the finite intensities of an array, every so many voxels of a large one."""
    values = evenly_sampled(data, _SAMPLES)
    if values.dtype.kind in "iu":
        # Of the 8 and 16 bits that a level has, counting takes a tenth of the time of sorting.
        least = int(values.min())
        counts = np.bincount(values.astype(np.intp) - least)
        found = np.flatnonzero(counts)
        return IntensitySamples((found + least).astype(np.float64), counts[found])
    ordered = np.sort(values[np.isfinite(values)]).astype(np.float64)
    return IntensitySamples(ordered, np.ones(len(ordered), np.intp))
