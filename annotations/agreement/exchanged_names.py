"""Keypoints that carry each other's names, found by comparing the annotators of a volume."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.fitting.chain import chain_of
from annotations.fitting.distances import SeenDistances
from annotations.fitting.evidence import BodyPoint
from annotations.fitting.mistakes import LENGTH_TOLERANCE
from annotations.geometry.angles import lengths
from annotations.geometry.tool import ToolSpecification

Array = NDArray[np.float64]
Cycle = tuple[int, ...]

_NEAR_ENOUGH = 2.0
"""Limits of a usual distance within which a renamed keypoint must lie."""
_NEARER = 0.5
"""By which share of its former distance a renamed keypoint must lie nearer."""


@dataclass(frozen=True)
class Names:
    """What the keypoints of a volume should be called.

    Attributes
    ----------
    orders : (A, K) array of int
        Of each annotator's keypoint the index of that which the others have there.
    is_told : bool
        Whether it is clear who is right; if not, the orders are relative to one of those who may be.
    """

    orders: NDArray[np.int64]
    is_told: bool = True

    def cycles(self, annotator: int) -> tuple[Cycle, ...]:
        """Return which keypoints of an annotator carry each other's names: two in a cycle are swapped."""
        return _cycles(self.orders[annotator])

    def corrected(self, positions_um: Array) -> Array:
        """Return positions of shape (A, K, 3) under the names that they should have."""
        corrected_um = np.empty_like(positions_um)
        np.put_along_axis(corrected_um, self.orders[..., np.newaxis], positions_um, axis=1)
        return corrected_um


class ExchangedNames:
    """Finds exchanged names, by what the tool and the limit of usual distances in µm allow.

    Annotators who call the same places by the same names are of one opinion. Opinions that the tool's lengths
    and joints rule out are wrong, then those of fewer people; where neither tells, nobody can.
    """

    def __init__(self, tool: ToolSpecification, limit_um: float) -> None:
        self._limit_um = limit_um
        self._seen, self._places = _seen_distances(tool)

    def find(self, positions_um: Array) -> Names:
        """Return the names for the annotators of a volume, from positions of shape (A, K, 3), NaN if none."""
        central = _by_centrality(positions_um)
        orders = self._orders(positions_um, _first_known(positions_um[central]))
        opinions: dict[tuple[int, ...], list[int]] = defaultdict(list)
        for who, order in enumerate(orders):
            if np.isfinite(positions_um[who]).any():
                opinions[tuple(order.tolist())].append(who)
        if len(opinions) < 2:
            return Names(orders)
        possible = [who for who in opinions.values() if self._is_possible(positions_um[who])]
        *_, best = sorted(possible or list(opinions.values()), key=len)
        is_told = sum(len(who) == len(best) for who in possible or opinions.values()) == 1
        if is_told and central[0] not in best:
            central.sort(key=lambda who: who not in best)
            orders = self._orders(positions_um, _first_known(positions_um[central]))
        return Names(orders, is_told)

    def _orders(self, positions_um: Array, reference_um: Array) -> NDArray[np.int64]:
        """Return what the keypoints of all should be called if those of shape (K, 3) have the right names."""
        from scipy.optimize import linear_sum_assignment

        orders = np.tile(np.arange(positions_um.shape[1]), (len(positions_um), 1))
        off_um = lengths(positions_um - reference_um)
        for who in np.flatnonzero((off_um > self._limit_um).any(axis=1)):
            both = np.flatnonzero(np.isfinite(off_um[who]))
            gaps_um = lengths(positions_um[who, both, np.newaxis] - reference_um[both])
            _, nearest = linear_sum_assignment(gaps_um)
            before_um, after_um = gaps_um.diagonal(), gaps_um[np.arange(both.size), nearest]
            is_explained = (after_um <= _NEAR_ENOUGH * self._limit_um) & (after_um < _NEARER * before_um)
            for cycle in _cycles(nearest):
                if is_explained[list(cycle)].all():
                    orders[who, both[list(cycle)]] = both[nearest[list(cycle)]]
        return orders

    def _is_possible(self, positions_um: Array) -> bool:
        """Say whether the tool can be as those see it whose positions of shape (a, K, 3) these are."""
        if self._seen is None:
            return True
        middle_um = middle_of_known(positions_um)[self._places]
        gaps_um = lengths(middle_um[:, np.newaxis] - middle_um)
        return not bool(np.any((gaps_um < self._seen.least_um) | (gaps_um > self._seen.most_um)))


def middle_of_known(positions_um: Array) -> Array:
    """Return the median along the first axis of what is not NaN; NaN where nothing is."""
    ordered = np.sort(positions_um, axis=0)  # NaN comes last
    number = np.isfinite(ordered).sum(axis=0, keepdims=True)
    upper = np.take_along_axis(ordered, np.minimum(number // 2, len(ordered) - 1), axis=0)
    lower = np.take_along_axis(ordered, np.maximum(number - 1, 0) // 2, axis=0)
    middle: Array = np.where(number > 0, (lower + upper) / 2, np.nan).squeeze(axis=0)
    return middle


def _by_centrality(positions_um: Array) -> list[int]:
    """Return the annotators, first to whom the others are nearest: by the median, over means of keypoints."""
    gaps_um = lengths(positions_um[:, np.newaxis] - positions_um)
    known = np.isfinite(gaps_um)
    number = known.sum(axis=2)
    mean_um = np.where(number > 0, np.where(known, gaps_um, 0.0).sum(axis=2) / np.maximum(number, 1), np.inf)
    return [int(who) for who in np.argsort(np.median(mean_um, axis=1), kind="stable")]


def _first_known(positions_um: Array) -> Array:
    """Return of each keypoint the position that the first has who has one: shape (A, K, 3) to (K, 3)."""
    first = np.isfinite(positions_um[..., 0]).argmax(axis=0)
    known_um: Array = positions_um[first, np.arange(positions_um.shape[1])]
    return known_um


def _cycles(order: Sequence[int] | NDArray[np.int64]) -> tuple[Cycle, ...]:
    """Return the cycles of a permutation that move something, each from its lowest member on."""
    found: list[Cycle] = []
    seen: set[int] = set()
    for start in range(len(order)):
        cycle = []
        place = start
        while place not in seen:
            seen.add(place)
            cycle.append(place)
            place = int(order[place])
        if len(cycle) > 1:
            found.append(tuple(cycle))
    return tuple(found)


def _seen_distances(tool: ToolSpecification) -> tuple[SeenDistances | None, list[int]]:
    """Return between which distances pairs of keypoints may be seen, and which keypoints those are of."""
    chain = chain_of(tool)
    points, places = [], []
    for place, name in enumerate(tool.keypoint_names):
        link = tool.link_of(name)
        if chain is not None and link is not None and link.name in chain.links:
            local_um = (0.0 if name == link.base else link.length_um, 0.0, 0.0)
            points.append(BodyPoint(link.name, local_um, (0.0, 0.0, 0.0), keypoint=name))
            places.append(place)
    if chain is None or len(points) < 2:
        return None, []
    return SeenDistances(points, chain, LENGTH_TOLERANCE), places
