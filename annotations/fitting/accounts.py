"""Accounts of how an annotation came about, soundly or by one mistake, and how probable each makes the data.

The probability of the data under an account is integrated over all poses by P.-S. Laplace's method, so that
an account that could explain anything gains nothing by it (D. MacKay, *Bayesian interpolation*, Neural
Computation 4, 1992). Nominal lengths are taken to be exact or, as probably, to deviate by a tolerance.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal

import numpy as np

from annotations.fitting.chain import Array, Chain
from annotations.fitting.chain_solver import ON_A_LIMIT_RAD, ChainSolver, Solution
from annotations.fitting.evidence import BodyPoint
from annotations.geometry.frames import vector

Fault = Literal[
    "swapped",
    "reversed",
    "turned_over",
    "rolled",
    "displaced",
    "beyond_limits",
    "length",
    "relabelled",
]
Kind = Literal["sound"] | Fault

_PRIORS: dict[Kind, float] = {
    "sound": 1.0,
    "swapped": 0.25,
    "reversed": 0.25,
    "turned_over": 0.2,
    "rolled": 0.2,
    "displaced": 0.4,
    "beyond_limits": 0.02,
    "length": 0.002,  # what a specification may be wrong by is in the tolerance already
    "relabelled": 0.1,
}
"""How frequent each kind is taken to be among mistakes; all of a kind are equally so."""

_WHEREVER_UM3 = 1e12
"""A displaced point may be anywhere within a cubic centimetre."""
_POSITION_SPREAD_UM = 1e4
_ANGLE_SPREAD_RAD = 1.0
_UNLIMITED_SPREAD_RAD = 2.0
_LENGTH_SPREAD = 0.3
"""A link whose length is a mistake may deviate by this share of it."""
_NO_LENGTH_MENDS = 5000.0
_ALIKE = 0.1
_LEAST_TOLD = 1e-3
_TOLD = 20.0
"""Of a direction that the data determine: by how much they narrow its variance."""


@dataclass(frozen=True, eq=False)
class Account:
    """What may have happened, and the points as they would be without the mistake.

    Attributes
    ----------
    parts : tuple of str
        Keypoints, links or joints that the mistake is about.
    points : tuple of BodyPoint
        Without those that tell nothing under this account.
    room_um3 : float
        In how large a space each point that was left out may lie, all of them multiplied.
    long_link : int or None
        The link that may be far from nominal.
    """

    kind: Kind
    parts: tuple[str, ...]
    points: tuple[BodyPoint, ...]
    room_um3: float = 1.0
    long_link: int | None = None

    @property
    def is_limited(self) -> bool:
        """Whether the joints' limits hold."""
        return self.kind != "beyond_limits"


@dataclass(frozen=True, eq=False)
class Verdict:
    """How an account fares against the data.

    Attributes
    ----------
    chi_square : float
        Of the fit in which lengths deviate as far as the tolerance.
    degrees_of_freedom : int
    surprise : float
        −2 ln of the probability of the data, but for what all accounts share.
    solution : Solution
        With lengths free, where that was tried.
    stretch_sigmas : ndarray, shape (K,)
        By how many standard deviations each link is longer than nominal.
    """

    account: Account
    chi_square: float
    degrees_of_freedom: int
    surprise: float
    solution: Solution
    stretch_sigmas: Array


def single_mistakes(points: Sequence[BodyPoint], chain: Chain) -> Iterator[Account]:
    """Return an account for each mistake in one or two keypoints of a document of keypoints."""
    points = tuple(points)
    for (first, one), (second, other) in combinations(enumerate(points), 2):
        changed = list(points)
        changed[first], changed[second] = _at(one, other), _at(other, one)
        if one.link == other.link:
            yield Account("reversed", (one.link,), tuple(changed))
        else:
            yield Account("swapped", (one.keypoint, other.keypoint), tuple(changed))
    if len(points) > 2:
        for index, point in enumerate(points):
            rest = points[:index] + points[index + 1 :]
            yield Account("displaced", (point.keypoint,), rest, room_um3=_WHEREVER_UM3)
    yield from tool_mistakes(points, chain)


def single_box_mistakes(points: Sequence[BodyPoint], chain: Chain) -> Iterator[Account]:
    """Return an account for each mistake in one or two boxes, given by three points each."""
    boxes = {link: tuple(point for point in points if point.link == link) for link in chain.links}
    boxes = {link: box for link, box in boxes.items() if box}

    def others(*links: str) -> tuple[BodyPoint, ...]:
        return tuple(point for link, box in boxes.items() if link not in links for point in box)

    for link, (base, tip, beside) in boxes.items():
        over = replace(beside, position_um=_opposite(base, tip, beside))
        yield Account("turned_over", (link,), (*others(link), base, tip, over))
        for side in (beside, over):
            yield Account("reversed", (link,), (*others(link), _at(base, tip), _at(tip, base), side))
        if len(boxes) > 1:
            yield Account("displaced", (link,), others(link), room_um3=_WHEREVER_UM3**3)
    if len(boxes) > 1:
        # One alone, or all that followed its roll, or all: a box begins with the hinge of its parent's.
        sizes = sorted({1, len(boxes) - 1, len(boxes)})
        for links in (links for size in sizes for links in combinations(boxes, size)):
            sides = [boxes[link][2] for link in links]
            rest = tuple(point for point in points if point not in sides)
            room_um3 = math.prod(_anywhere_around_um3(side) for side in sides)
            yield Account("rolled", links, rest, room_um3=room_um3)
    for one, other in combinations(boxes, 2):
        exchanged = (*_box_at(boxes[one], boxes[other]), *_box_at(boxes[other], boxes[one]))
        yield Account("swapped", (one, other), (*others(one, other), *exchanged))
    yield from tool_mistakes(tuple(points), chain)


def tool_mistakes(points: tuple[BodyPoint, ...], chain: Chain) -> Iterator[Account]:
    """Return an account for joints beyond their limits, and for each link that is far from nominal."""
    if chain.joints:
        yield Account("beyond_limits", (), points)
    for index, link in enumerate(chain.links):
        if len({point.local_um for point in points if point.link == link}) > 1:
            yield Account("length", (link,), points, long_link=index)


def judge(
    account: Account, chain: Chain, tolerance: float, *, starts: int = 2, best: float = math.inf
) -> Verdict | None:
    """Return how an account fares; None where its points fit nothing.

    Parameters
    ----------
    tolerance : float
        Standard deviation of links' lengths as a share of nominal.
    starts : int
        In how many places of the grid to begin.
    best : float
        χ² of the best account so far: lengths are not tried where they cannot make up for what is missing.
    """
    if len({point.position_um for point in account.points}) < 2:
        return None
    spreads = tolerance * chain.lengths_um
    if account.long_link is not None:
        spreads[account.long_link] = _LENGTH_SPREAD * chain.lengths_um[account.long_link]
    exact = ChainSolver(chain, account.points, is_limited=account.is_limited)
    solution, *others = exact.solutions(most=starts)
    if not account.is_limited:
        # Turned half about the shaft, the same tool bends the other way: that which keeps to the limits best.
        alike = [other for other in others if other.chi_square < solution.chi_square + _ALIKE]
        solution = min([solution, *alike], key=lambda each: float(_beyond_rad(each, chain).sum()))
    surprise = math.inf
    if account.long_link is None:
        surprise = _surprise(account, exact, solution, np.zeros(len(spreads)))
    stretch_sigmas = np.zeros(len(spreads))
    if solution.chi_square < best + _NO_LENGTH_MENDS:
        free = ChainSolver(chain, account.points, spreads, is_limited=account.is_limited)
        solution = free.next_to(solution)
        deviating = _surprise(account, free, solution, spreads)
        stretch_sigmas = _stretch_sigmas(free, solution, spreads)
        # −2 ln of the mean of the two probabilities.
        surprise = float(-2 * np.logaddexp(-surprise / 2, -deviating / 2)) + 2 * math.log(2)
    moves = exact.jacobian(solution) * _spreads(account, exact, spreads)
    moves = moves[:, : 6 + len(exact.joints)]
    rank = int(np.sum(np.linalg.eigvalsh(moves.T @ moves) > _TOLD))
    freedom = 3 * len(account.points) - rank + len(solution.on_limits)
    return Verdict(account, solution.chi_square, freedom, surprise, solution, stretch_sigmas)


def beyond_limits_deg(verdict: Verdict, chain: Chain) -> dict[str, float]:
    """Return the angle in degrees of each joint that a verdict puts beyond its limits."""
    beyond_rad = _beyond_rad(verdict.solution, chain)
    angles_deg = np.degrees(verdict.solution.angles_rad)
    return {name: float(angles_deg[joint]) for joint, name in enumerate(chain.joints) if beyond_rad[joint]}


def _beyond_rad(solution: Solution, chain: Chain) -> Array:
    low, high = np.radians(chain.limits_deg).T
    beyond_rad: Array = np.abs(solution.angles_rad - np.clip(solution.angles_rad, low, high))
    return np.where(beyond_rad > ON_A_LIMIT_RAD, beyond_rad, 0.0)


def prior_surprise(kind: Kind, number: int) -> float:
    """Return −2 ln of how frequent a mistake is taken to be that is one of a number of its kind."""
    return -2 * math.log(_PRIORS[kind] / number)


def _surprise(account: Account, solver: ChainSolver, solution: Solution, spreads_um: Array) -> float:
    jacobian = solver.jacobian(solution) * _spreads(account, solver, spreads_um)
    _, narrowing = np.linalg.slogdet(np.eye(jacobian.shape[1]) + jacobian.T @ jacobian)
    noise = sum(3 * math.log(2 * math.pi * point.sigma_um**2) for point in account.points)
    return solution.chi_square + float(narrowing) + noise + 2 * math.log(account.room_um3)


def _stretch_sigmas(solver: ChainSolver, solution: Solution, spreads_um: Array) -> Array:
    moves = solver.jacobian(solution)
    links = moves.shape[1] - len(spreads_um)
    # Its spread draws an estimate to nominal: the estimate's own variance is what is left of that spread.
    tiny = np.full(moves.shape[1], 1e-12)
    tiny[links:] = spreads_um**-2
    left = np.diag(np.linalg.inv(moves.T @ moves + np.diag(tiny)))[links:]
    told = np.maximum(spreads_um**2 - left, _LEAST_TOLD * spreads_um**2)
    return solution.stretch_um / np.sqrt(told)


def _spreads(account: Account, solver: ChainSolver, lengths_um: Array) -> Array:
    """Return how far each unknown may lie from anywhere, before the data are seen."""
    position_um, turn_rad = np.full(3, _POSITION_SPREAD_UM), np.full(3, _ANGLE_SPREAD_RAD)
    bend_rad = _ANGLE_SPREAD_RAD if account.is_limited else _UNLIMITED_SPREAD_RAD
    return np.concatenate([position_um, turn_rad, np.full(len(solver.joints), bend_rad), lengths_um])


def _at(point: BodyPoint, place: BodyPoint) -> BodyPoint:
    """Return a point seen where another one was: how sure a position is stays with the position."""
    return replace(point, position_um=place.position_um, sigma_um=place.sigma_um)


def _box_at(box: tuple[BodyPoint, ...], place: tuple[BodyPoint, ...]) -> tuple[BodyPoint, ...]:
    """Return a box's points seen where another link's box was: its own +y stays, whatever the width."""
    base, tip, beside = (_at(mine, theirs) for mine, theirs in zip(box, place, strict=True))
    middle_um = np.add(base.position_um, tip.position_um) / 2
    widening = box[2].local_um[1] / place[2].local_um[1]
    position_um = middle_um + (np.asarray(beside.position_um) - middle_um) * widening
    return base, tip, replace(beside, position_um=vector(position_um))


def _anywhere_around_um3(side: BodyPoint) -> float:
    """Return in how large a space a box's side may lie at any roll: a ring, as thick as its noise."""
    return 2 * math.pi * side.local_um[1] * 2 * math.pi * side.sigma_um**2


def _opposite(base: BodyPoint, tip: BodyPoint, beside: BodyPoint) -> tuple[float, float, float]:
    return vector(np.add(base.position_um, tip.position_um) - np.asarray(beside.position_um))
