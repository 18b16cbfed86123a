"""Pairs of annotators: bias and limits of agreement of each component."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from annotations.agreement.results import BlandAltman, PairResult

_LIMIT_SDS = 1.96
_MOST_POINTS = 500
_MOST_POINTS_OF_ALL_PAIRS = 10_000
"""For each component: what is drawn must not outweigh the numbers in the file."""


def pair_results(
    annotators: Sequence[str],
    components: Mapping[str, NDArray[np.float64]],
    places: Mapping[str, NDArray[np.float64]],
) -> tuple[PairResult, ...]:
    """Return how each two annotators differ who have a volume in common.

    Parameters
    ----------
    annotators : sequence of str
    components : mapping of str to (V, A) array of float64
        Whose differences are taken: see `annotations.agreement.components.component_values`, in the frame of
        each volume.
    places : mapping of str to (V, A) array of float64
        The same in the common frame: what the differences are drawn over. In its own frame every volume
        would be drawn at zero.
    """
    pairs = list(combinations(enumerate(annotators), 2))
    most_points = min(_MOST_POINTS, _MOST_POINTS_OF_ALL_PAIRS // max(1, len(pairs)))
    results = []
    for (one, first), (other, second) in pairs:
        agreed = {
            name: bland_altman(
                values[:, one] - values[:, other],
                (places[name][:, one] + places[name][:, other]) / 2,
                most_points=most_points,
            )
            for name, values in components.items()
        }
        if any(figure.n for figure in agreed.values()):
            results.append(PairResult(first=first, second=second, components=agreed))
    return tuple(results)


def bland_altman(
    differences: NDArray[np.float64], means: NDArray[np.float64], *, most_points: int = _MOST_POINTS
) -> BlandAltman:
    """Return bias and limits of agreement of two series (J. M. Bland, D. G. Altman, *Lancet* 327, 1986).

    The limits are bias ∓ 1.96 sd. With t of n − 1 degrees of freedom, the bias has the interval
    ∓ t sd / √n and either limit ∓ t sd √(3/n), the paper's approximation of √(1/n + 1.96² / (2(n − 1))).

    Parameters
    ----------
    differences : (n,) array of float64
        First minus second; NaN where either is absent, which is not counted.
    means : (n,) array of float64
        Of the first and the second.
    most_points : int
        How many points to keep for drawing. Of more, those are kept that are evenly spread among the
        differences in their order, both extremes included: the picture keeps its shape.
    """
    from scipy.special import stdtrit

    known = ~np.isnan(differences)
    differences, means = differences[known], means[known]
    n = differences.size
    drawn = np.argsort(differences)[np.linspace(0, n - 1, min(n, most_points)).astype(int)]
    points = tuple(zip(means[drawn].tolist(), differences[drawn].tolist(), strict=True))
    if n < 2:
        return BlandAltman(bias=float(differences[0]) if n else None, n=n, points=points)
    bias, sd = float(differences.mean()), float(differences.std(ddof=1))
    t = float(stdtrit(n - 1, 0.975))
    low, high = bias - _LIMIT_SDS * sd, bias + _LIMIT_SDS * sd
    of_bias, of_limit = t * sd / math.sqrt(n), t * sd * math.sqrt(3 / n)
    return BlandAltman(
        bias=bias,
        sd=sd,
        limits=(low, high),
        bias_ci95=(bias - of_bias, bias + of_bias),
        low_ci95=(low - of_limit, low + of_limit),
        high_ci95=(high - of_limit, high + of_limit),
        n=n,
        points=points,
    )
