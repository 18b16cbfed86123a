"""Keypoints → boxes: the hinges carry a tool's roll from link to link, and a bend may show it.

Keypoints give each box its axis and length, the tool its cross-section. What is left is one roll for all
links that hang together by hinges. A clear bend shows the hinge's line and so leaves two rolls, in which the
hinge has opposite senses; a joint whose limits allow only one of them decides. Anything else is for a person
to say.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.geometry import rotations
from annotations.geometry.angles import angle_deg, signed_angle_deg
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.frames import Vector
from annotations.geometry.tool import Joint, ToolSpecification

Array = NDArray[np.float64]

CLICK_NOISE_UM = 50.0
"""Standard deviation of a click along each axis. The published deviation of the orientation, 0.36° between
three annotators on a link of 11 mm, comes to 48 µm."""

# The bend of a straight joint reads as the length of a two-dimensional normal error (Rayleigh): it exceeds
# four standard deviations once in 3,000 times, and three of them once in 90.
_CLEAR_DEVIATIONS = 4.0
# A hinge that is nearer to a link's axis, or to another hinge, than this runs along it; in radians.
_PARALLEL = 1e-6


class RollUnknown(UserError):  # noqa: N818 - named for what is missing
    """The keypoints leave the roll of a link's box open.

    Attributes
    ----------
    link : str
        The first link, from the base, of those that hang together.
    candidates_deg : tuple of float
        The two rolls in question where a bend shows the hinge's line and not its sense; empty where
        nothing shows the roll.
    """

    def __init__(self, link: str, candidates_deg: tuple[float, ...]) -> None:
        self.link = link
        self.candidates_deg = candidates_deg
        if candidates_deg:
            reason = "the bend shows the line of its hinge, but not the sense"
            remedy = f"Say which roll it is: {' or '.join(f'{roll:z.1f}°' for roll in candidates_deg)}"
        else:
            reason = "no clear bend shows it"
            remedy = "Say the roll in degrees"
        super().__init__(f"the roll of {link} about its own axis is not known: {reason}", remedy=remedy)


@dataclass(frozen=True)
class RollEvidence:
    """What keypoints say of the roll of links that hang together.

    Attributes
    ----------
    link : str
        The first of these links from the base; the roll is that of its box.
    candidates_deg : tuple of float
        One where bend and limits show it, two where the hinge's sense is open, none where nothing is clear.
    tolerance_deg : float
        How far off the click noise may put a candidate.
    """

    link: str
    candidates_deg: tuple[float, ...] = ()
    tolerance_deg: float = 180.0

    def contradiction_deg(self, roll_deg: float) -> float | None:
        """Return how far a roll is from the nearest candidate, where click noise does not explain it."""
        distances = [abs(math.remainder(roll_deg - candidate, 360.0)) for candidate in self.candidates_deg]
        return min(distances) if distances and min(distances) > self.tolerance_deg else None


def boxes_from_keypoints(
    positions_um: Mapping[str, Vector], tool: ToolSpecification, *, roll_deg: float | None = None
) -> dict[str, Box]:
    """Return the box of each link whose two keypoints have a position, in the tool's order.

    Its x faces are centred on the keypoints, and its cross-section is the tool's. A child takes its parent's
    frame along by the smallest turn that leaves the hinge as near to where it was as the child's own
    direction allows, so that noisy keypoints have boxes too. Over a link without a box the frame is carried
    where the hinges at its ends are parallel.

    Parameters
    ----------
    positions_um : mapping of str to (3,)
        Keypoint positions in µm, by name. A link whose ends are at one place has no box.
    tool : ToolSpecification
    roll_deg : float, optional
        Roll (of yaw-pitch-roll) of the first of the links that hang together, and, where they do not all hang
        together, of the first link of each such group. It is taken literally, whatever the bend says.

    Raises
    ------
    RollUnknown
        No roll is given, and the keypoints do not show it.
    """
    directions = _directions(positions_um, tool)
    axes: dict[str, Array] = {}
    for root, hinges in _groups(tool, directions):
        roll = roll_deg
        if roll is None:
            evidence = _evidence(root, hinges, directions)
            if len(evidence.candidates_deg) != 1:
                raise RollUnknown(root, evidence.candidates_deg)
            (roll,) = evidence.candidates_deg
        axes |= _rolled(root, roll, hinges, directions)
    return {
        link.name: box_between(
            positions_um[link.base], positions_um[link.tip], link.cross_section_um, axes[link.name][:, 1]
        )
        for link in tool.links
        if link.name in axes
    }


def roll_evidence(positions_um: Mapping[str, Vector], tool: ToolSpecification) -> tuple[RollEvidence, ...]:
    """Return what keypoint positions in µm say of the roll, for each group of links that hang together."""
    directions = _directions(positions_um, tool)
    return tuple(_evidence(root, hinges, directions) for root, hinges in _groups(tool, directions))


@dataclass(frozen=True, eq=False)
class _Direction:
    """A link's unit vector towards its tip, shape (3,), and its standard deviation each way, in radians."""

    along: Array
    noise: float


@dataclass(frozen=True, eq=False)
class _Hinge:
    """A hinge between two links with directions; its axis, shape (3,), is the same in either's own frame."""

    parent: str
    child: str
    axis: Array
    limits_deg: tuple[float, float]


_Directions = Mapping[str, _Direction]


def _directions(positions_um: Mapping[str, Vector], tool: ToolSpecification) -> dict[str, _Direction]:
    directions = {}
    for link in tool.links:
        if link.base in positions_um and link.tip in positions_um:
            way_um = np.subtract(positions_um[link.tip], positions_um[link.base])
            length_um = math.hypot(*way_um)
            if length_um:
                directions[link.name] = _Direction(
                    way_um / length_um, math.sqrt(2) * CLICK_NOISE_UM / length_um
                )
    return directions


def _groups(tool: ToolSpecification, directions: _Directions) -> Iterator[tuple[str, list[_Hinge]]]:
    """Yield the first link of those that hang together, and their hinges from there outwards."""
    hinges = list(_hinges(tool, directions))
    children = {hinge.child for hinge in hinges}
    for name in directions:
        if name not in children:
            yield name, list(_outwards(name, hinges))


def _outwards(link: str, hinges: list[_Hinge]) -> Iterator[_Hinge]:
    for hinge in hinges:
        if hinge.parent == link:
            yield hinge
            yield from _outwards(hinge.child, hinges)


def _hinges(tool: ToolSpecification, directions: _Directions) -> Iterator[_Hinge]:
    """Yield the hinges that carry a roll; one along its link does not, since its turn is not to be seen."""
    joint_of = {joint.child: joint for joint in tool.joints}
    for joint in tool.joints:
        hinge: _Hinge | None = _Hinge(
            joint.parent, joint.child, np.asarray(joint.hinge_axis), joint.limits_deg
        )
        while hinge is not None and hinge.parent not in directions:
            hinge = _over(joint_of.get(hinge.parent), hinge)
        if hinge is not None and hinge.child in directions and math.hypot(*hinge.axis[1:]) > _PARALLEL:
            yield hinge


def _over(upper: Joint | None, lower: _Hinge) -> _Hinge | None:
    """Return the hinge that two make over the link between them; None unless they are parallel."""
    if upper is None:
        return None
    axis = np.asarray(upper.hinge_axis)
    if math.hypot(*np.cross(axis, lower.axis)) > _PARALLEL:
        return None
    low, high = lower.limits_deg
    if axis @ lower.axis < 0:
        low, high = -high, -low
    limits_deg = (upper.limits_deg[0] + low, upper.limits_deg[1] + high)
    return replace(lower, parent=upper.parent, axis=axis, limits_deg=limits_deg)


def _rolled(root: str, roll_deg: float, hinges: list[_Hinge], directions: _Directions) -> dict[str, Array]:
    """Return the (3, 3) own axes, as columns, of each link of a group whose first one has this roll."""
    axes = {root: rotations.matrix(rotations.along(directions[root].along, roll_deg))}
    for hinge in hinges:
        axes[hinge.child] = _carried(axes[hinge.parent], hinge.axis, directions[hinge.child].along)
    return axes


def _carried(axes: Array, hinge_axis: Array, along: Array) -> Array:
    """Return a link's own axes from another one's: the hinge stays as near as the link's direction allows."""
    hinge = axes @ hinge_axis
    across = hinge - (hinge @ along) * along
    if math.hypot(*across) <= _PARALLEL:
        # No joint brings a link there; the smallest turn from the other link's direction is as good as any.
        turn = rotations.about_axis(np.cross(axes[:, 0], along), angle_deg(axes[:, 0], along))
        return rotations.matrix(turn) @ axes
    return _framed(along, hinge_axis, across)


def _framed(along: Array, hinge_axis: Array, hinge: Array) -> Array:
    """Return own axes with +x along a unit vector and a hinge, given in them, turned towards a vector."""
    own_x = np.array([1.0, 0.0, 0.0])
    return _frame(along, hinge) @ _frame(own_x, hinge_axis).T


def _frame(along: Array, towards: Array) -> Array:
    across = towards - (towards @ along) * along
    across = across / math.hypot(*across)
    return np.column_stack([along, across, np.cross(along, across)])


def _evidence(root: str, hinges: list[_Hinge], directions: _Directions) -> RollEvidence:
    clear = [hinge for hinge in hinges if _clearness(hinge, directions) > _CLEAR_DEVIATIONS]
    if not clear:
        return RollEvidence(root)
    best = max(clear, key=lambda hinge: _clearness(hinge, directions))
    first, second = (
        _root_roll_deg(root, best, hinge, hinges, directions) for hinge in _possible_hinges(best, directions)
    )
    turned = [
        _beyond_limits_deg(_rolled(root, roll, hinges, directions), clear, directions)
        for roll in (first, second)
    ]
    # A joint decides if one of the two senses would put it beyond its limits by more than clicks explain.
    votes = {
        first if one < other else second
        for hinge, one, other in zip(clear, *turned, strict=True)
        if abs(one - other) > math.degrees(_CLEAR_DEVIATIONS * _noise(hinge, directions))
    }
    bend = math.radians(_bend_deg(best, directions))
    tolerance_deg = math.degrees(_CLEAR_DEVIATIONS * _noise(best, directions) / math.sin(bend))
    return RollEvidence(root, tuple(votes) if len(votes) == 1 else (first, second), tolerance_deg)


def _bend_deg(hinge: _Hinge, directions: _Directions) -> float:
    return angle_deg(directions[hinge.parent].along, directions[hinge.child].along)


def _noise(hinge: _Hinge, directions: _Directions) -> float:
    """Return the standard deviation, in radians and in each direction, of a bend between clicked links."""
    return math.hypot(directions[hinge.parent].noise, directions[hinge.child].noise)


def _clearness(hinge: _Hinge, directions: _Directions) -> float:
    """Return by how many standard deviations two links are out of line."""
    bend_deg = _bend_deg(hinge, directions)
    # A link that is folded back wholly shows no hinge either.
    return math.radians(min(bend_deg, 180.0 - bend_deg)) / _noise(hinge, directions)


def _possible_hinges(hinge: _Hinge, directions: _Directions) -> tuple[Array, Array]:
    """Return the two vectors, shape (3,), that have the hinge's angle to both of its links.

    For a hinge across its links they are the two senses of d0 × d1; in general a (d0 + d1) ± b d0 × d1.
    """
    parent, child = directions[hinge.parent].along, directions[hinge.child].along
    normal = np.cross(parent, child)
    middle = hinge.axis[0] / (1 + parent @ child) * (parent + child)
    share = math.sqrt(max(1 - middle @ middle, 0.0)) / math.hypot(*normal)
    return middle + share * normal, middle - share * normal


def _root_roll_deg(
    root: str, hinge: _Hinge, hinge_vector: Array, hinges: list[_Hinge], directions: _Directions
) -> float:
    """Return the roll of a group's first link if a hinge has this direction, shape (3,), in the volume."""
    above = {each.child: each for each in hinges}
    link = hinge.parent
    axes = _framed(directions[link].along, hinge.axis, hinge_vector)
    while link != root:
        inner = above[link]
        link = inner.parent
        axes = _carried(axes, inner.axis, directions[link].along)
    return rotations.yaw_pitch_roll_deg(rotations.from_matrix(axes))[2]


def _beyond_limits_deg(
    axes: Mapping[str, Array], hinges: list[_Hinge], directions: _Directions
) -> list[float]:
    """Return by how much each hinge is turned beyond its limits."""
    beyond = []
    for hinge in hinges:
        turned = axes[hinge.parent].T @ directions[hinge.child].along
        turn_deg = signed_angle_deg((1.0, 0.0, 0.0), turned, hinge.axis)
        low, high = hinge.limits_deg
        # Limits that add up over a link may pass the half turn.
        turns = (turn_deg - 360.0, turn_deg, turn_deg + 360.0)
        beyond.append(min(max(low - turn, turn - high, 0.0) for turn in turns))
    return beyond
