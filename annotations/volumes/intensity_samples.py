"""The intensities that occur in an array, counted, for statistics over a million of them."""

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


def intensity_samples(data: Array) -> IntensitySamples:
    """Return the finite intensities of an array, every so many voxels of a large one."""
    values = data.ravel(order="K")
    values = values[:: max(1, values.size // _SAMPLES)]
    if values.dtype.kind in "iu":
        # Of the 8 and 16 bits that a level has, counting takes a tenth of the time of sorting.
        least = int(values.min())
        counts = np.bincount(values.astype(np.intp) - least)
        found = np.flatnonzero(counts)
        return IntensitySamples((found + least).astype(np.float64), counts[found])
    ordered = np.sort(values[np.isfinite(values)]).astype(np.float64)
    return IntensitySamples(ordered, np.ones(len(ordered), np.intp))
