"""How far the annotators of each volume are apart, by the published statistic and two others.

For one volume and one target, with the values a_1 … a_n of its n annotators:

- *published*: the mean over i of the distance between a_i and the mean of all n;
- *leave-one-out*: the mean over i of the distance between a_i and the mean of the other n − 1;
- *pairwise*: the mean over all pairs of the distance between the two.

For n equal annotators with isotropic noise, published is √((n−1)/n), leave-one-out √(n/(n−1)) and pairwise
√2 of the mean distance from the truth. The mean of directions is the direction of their sum. It is undefined
where they cancel, as two opposite ones do; a volume where a mean that is needed is undefined has no such
statistic.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.measured import Measured, Metric
from annotations.geometry.angles import angles_deg, lengths, unit_vectors

Array = NDArray[np.float64]

# A sum of unit vectors that is shorter is what rounding left of vectors that cancel.
_CANCELLED = 1e-9


@dataclass(frozen=True)
class Deviations:
    """The three statistics of one target, for each of V volumes.

    Attributes
    ----------
    published, leave_one_out, pairwise : (V,) array of float64
        In the target's unit; NaN for volumes with less than two annotators.
    """

    published: Array
    leave_one_out: Array
    pairwise: Array


def deviations(measured: Measured) -> Deviations:
    """Return the three statistics of each volume, over the annotators that the volume has."""
    is_there, _ = _summed(measured)
    pairwise = _pairwise(measured)
    leave_one_out = _mean_if_complete(distances_from_others(measured), measured)
    return Deviations(
        _mean_if_complete(distances_from_mean(measured), measured),
        # Of two annotators both are the distance between them: the same number, not one but for rounding.
        np.where(is_there.sum(axis=1) == 2, pairwise, leave_one_out),
        pairwise,
    )


def distances_from_mean(measured: Measured) -> Array:
    """Return how far each annotator is from the mean of all, (V, A); NaN for one who has no value.

    One who is alone with a volume is at no distance from the mean.
    """
    return distances(measured.values, mean_of_all(measured)[:, np.newaxis], measured.metric)


def distances_from_others(measured: Measured) -> Array:
    """Return how far each annotator is from the mean of the others, (V, A); NaN where either is missing."""
    return distances(measured.values, means_of_others(measured), measured.metric)


def mean_of_all(measured: Measured) -> Array:
    """Return the mean of each volume's annotators, (V, d); NaN where there is none."""
    is_there, total = _summed(measured)
    return _mean(total, is_there.sum(axis=1), measured.metric)


def means_of_others(measured: Measured) -> Array:
    """Return for each annotator the mean of the others, (V, A, d); NaN where there are no others.

    It is there for annotators without a value of their own, too.
    """
    is_there, total = _summed(measured)
    others = total[:, np.newaxis] - np.where(is_there[..., np.newaxis], measured.values, 0.0)
    return _mean(others, is_there.sum(axis=1, keepdims=True) - is_there, measured.metric)


def distances(first: Array, second: Array, metric: Metric) -> Array:
    """Return how far values of shapes (…, d) are apart, (…); in degrees for an ``angle``."""
    if metric == "angle":
        return angles_deg(first, second)
    if metric == "distance":
        return lengths(first - second)
    difference: Array = np.abs(first - second)
    return difference[..., 0]


def _summed(measured: Measured) -> tuple[NDArray[np.bool_], Array]:
    is_there = np.isfinite(measured.values[..., 0])
    return is_there, np.where(is_there[..., np.newaxis], measured.values, 0.0).sum(axis=1)


def _mean(total: Array, count: NDArray[np.intp], metric: Metric) -> Array:
    known = count[..., np.newaxis] > 0
    if metric == "angle":
        return unit_vectors(np.where(known & (lengths(total) > _CANCELLED)[..., np.newaxis], total, np.nan))
    return _per(total, known, count[..., np.newaxis])


def _mean_if_complete(apart: Array, measured: Measured) -> Array:
    """Return the mean over the annotators of a volume, (V,), of what each of them must have, (V, A)."""
    is_there, _ = _summed(measured)
    count = is_there.sum(axis=1)
    total = np.where(is_there, apart, 0.0).sum(axis=1)
    return _per(total, count > 1, count)


def _per(total: Array, known: NDArray[np.bool_], count: NDArray[np.intp]) -> Array:
    share: Array = np.where(known, total, np.nan) / np.maximum(count, 1)
    return share


def pairs(measured: Measured) -> Iterator[tuple[int, int, Array]]:
    """Yield the indices of each two annotators, and how far they are apart on each volume, (V,)."""
    for first, second in combinations(range(measured.values.shape[1]), 2):
        apart = distances(measured.values[:, first], measured.values[:, second], measured.metric)
        yield first, second, apart


def _pairwise(measured: Measured) -> Array:
    total = np.zeros(len(measured.values))
    count = np.zeros(len(measured.values), dtype=np.intp)
    for _, _, apart in pairs(measured):
        known = ~np.isnan(apart)
        total += np.where(known, apart, 0.0)
        count += known
    return _per(total, count > 0, count)
