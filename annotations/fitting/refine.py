"""A tool's pose polished against the volume itself: its surface is laid on what the volume shows as one."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.fitting.pose_search import LARGEST_SHIFT_UM, LEAST_SAMPLES, PoseSearch
from annotations.fitting.surface_samples import SurfaceSamples, depth_last, surface_samples
from annotations.geometry import rotations
from annotations.geometry.body import LinkBody
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.volumes import SpacingUm, Volume

Array = NDArray[np.float64]

_FIRST_SHARES, _SHARES = (1.0, 0.6), (1.0, 0.6, 0.4, 0.25)
"""Shares of the reach within which samples count, less and less. The volume is read around the tool as it was
placed, and again around where it lies by then: the links at its end may have been further off."""
_LEAST_READINGS, _MOST_READINGS = 2, 4
_SETTLED_UM = 20.0
"""It is read no more once it moves no keypoint further than this."""
_LEAST_FACING = 0.5
"""Cosine from which a surface is expected to be seen: steeper ones may return too little light."""
_LEAST_SHARE, _THIN_SHARE = 0.1, 0.7
"""Of the places where the surface should be seen: with less it is not there, or not to be relied on."""
_OPEN_VARIANCE = 0.5
"""Share of a variance left by the volume from which a person's placing is what decides."""
_CHANGES = (
    "how far along its own axis the tool lies",
    *("how far to its sides the tool lies",) * 2,
    "how it is turned about its own axis",
    *("its direction",) * 2,
)


@dataclass(frozen=True)
class Support:
    """In how many columns of voxels a link should show its surface, and in how many it does."""

    found: int
    sought: int

    @property
    def is_thin(self) -> bool:
        """Whether it is too little to rely on."""
        return self.found < max(LEAST_SAMPLES, _THIN_SHARE * self.sought)


@dataclass(frozen=True)
class Refinement:
    """A pose that lies on the volume's bright surfaces, as a proposal.

    Attributes
    ----------
    pose : ToolPose
    moves_um : mapping of str to float
        How far each keypoint would move, by name.
    support : mapping of str to Support
        What was seen of each link.
    surface_rms_before_um, surface_rms_after_um : float
        Root mean square of the distances of the same surface samples from the tool before and after.
    remark : str
        Where the evidence is thin, where the tool moved far, and whether refining again may bring it nearer,
        in whole sentences; empty where there is no such thing.
    """

    pose: ToolPose
    moves_um: Mapping[str, float]
    support: Mapping[str, Support]
    surface_rms_before_um: float
    surface_rms_after_um: float
    remark: str


def refine_pose(
    volume: Volume,
    spacing_um: SpacingUm,
    tool: ToolSpecification,
    pose: ToolPose,
    *,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Refinement:
    """Return the pose near to a given one whose surface lies on what the volume shows as a surface.

    Samples of the surface (`surface_samples`) are drawn to the tool's body by least squares of their signed
    distances, weighted by J. W. Tukey's biweight, in rounds that look less and less far. What the volume
    does not tell stays as it was placed, for each change has a cost of its own; the joints keep their
    limits. The volume is read anew around where the tool lies by then, until it settles or has been read four
    times; where it went as far as `annotations.fitting.pose_search` lets it, the search begins again from
    there.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels.
    tool : ToolSpecification
    pose : ToolPose
        In the volume's frame.
    progress : callable
        Told the share that is done, in [0, 1].
    cancelled : callable
        Asked several times a second whether to stop.

    Raises
    ------
    UserError
        The tool has no links, or the volume shows nothing of its surface there.
    Cancelled
        `cancelled` said so.
    VolumeError
        The file can no longer be read.
    """
    order = depth_last(volume.depth_axis)
    start = search = PoseSearch.about(_along(order, pose), tool)
    bodies = search.bodies(search.unchanged)
    if not bodies:
        raise UserError(
            f"the tool {tool.name!r} has no links, so it has no surface to be seen",
            remedy="Choose a tool whose specification has links",
        )
    # No further than the tool is thick, so that what lies below it is not taken for it.
    reach_um = min(LARGEST_SHIFT_UM, *(2 * float(body.half_size_um.min()) for body in bodies.values()))
    change, left = search.unchanged, np.ones(len(search.unchanged))
    for number in range(_MOST_READINGS):
        if search.has_ended(change):
            search, change = PoseSearch.about(search.pose(change), tool), search.unchanged
        read = search.pose(change)
        samples = surface_samples(
            volume,
            spacing_um,
            search.bodies(change).values(),
            reach_um,
            partial(_tell, progress, number),
            cancelled,
        )
        if not number:
            change = search.lowered(samples, reach_um)
        for share in _SHARES if number else _FIRST_SHARES:
            change, left = search.improved(change, samples, share * reach_um)
        moved_um = max(_moves_um(read, search.pose(change), tool).values())
        is_settled = moved_um <= _SETTLED_UM and not search.has_ended(change)
        if is_settled and number + 1 >= _LEAST_READINGS:
            break
    progress(1.0)
    near_um = _SHARES[-1] * reach_um
    support = _support(search.bodies(change), samples, near_um)
    if unseen := [name for name, each in support.items() if each.found < _LEAST_SHARE * each.sought]:
        # What lies where an unseen link should be is chance: it must not bend the tool.
        samples = search.without(unseen, change, samples)
        change, left = search.improved(change, samples, near_um)
    if sum(each.found for each in support.values()) < max(
        LEAST_SAMPLES, _LEAST_SHARE * sum(each.sought for each in support.values())
    ):
        raise UserError(
            f"the volume shows nothing of the tool's surface within {reach_um:.0f} µm of where the tool is",
            where=volume.path,
            remedy="Bring the tool nearer to what the volume shows, and check the volume's depth axis",
        )
    refined = _along(tuple(np.argsort(order)), search.pose(change))
    surface_um = search.near(change, samples, near_um)
    return Refinement(
        pose=refined,
        moves_um=_moves_um(pose, refined, tool),
        support=support,
        surface_rms_before_um=_rms(start.distances_um(start.unchanged, surface_um)),
        surface_rms_after_um=_rms(search.distances_um(change, surface_um)),
        remark=" ".join(
            [
                *_of_support(support),
                *_of_what_is_left(left, tool),
                *_of_the_way(has_left=search is not start, is_settled=is_settled),
            ]
        ),
    )


def _tell(progress: Callable[[float], None], number: int, share: float) -> None:
    progress((number + share) / _MOST_READINGS)


def _moves_um(before: ToolPose, after: ToolPose, tool: ToolSpecification) -> dict[str, float]:
    before_um, after_um = keypoints_um(before, tool), keypoints_um(after, tool)
    return {name: math.dist(before_um[name], after_um[name]) for name in after_um}


def _along(order: Sequence[int], pose: ToolPose) -> ToolPose:
    """Return the same pose with the axes of the frame in another cyclic order, which is a rotation."""
    axes = list(order)
    return replace(
        pose,
        position_um=vector(np.asarray(pose.position_um)[axes]),
        rotation_wxyz=rotations.product(rotations.from_matrix(np.eye(3)[axes]), pose.rotation_wxyz),
    )


def _support(bodies: Mapping[str, LinkBody], samples: SurfaceSamples, reach_um: float) -> dict[str, Support]:
    """Count for each link the columns in which the light meets it first and not from the side."""
    hits = [body.first_hit(*samples.across_um.T) for body in bodies.values()]
    depth_um = np.array([hit.depth_um for hit in hits])
    facing = np.array([hit.facing for hit in hits])
    met = (depth_um == depth_um.min(axis=0)) & np.isfinite(depth_um) & (facing >= _LEAST_FACING)
    found = samples.found
    seen = np.zeros_like(met)
    seen[:, found] = np.abs(samples.depth_um[found] - depth_um[:, found]) < reach_um
    return {
        name: Support(found=int(np.sum(met[row] & seen[row])), sought=int(np.sum(met[row])))
        for row, name in enumerate(bodies)
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _of_support(support: Mapping[str, Support]) -> Iterator[str]:
    for name, each in support.items():
        if not each.sought:
            yield f"No light reaches {name}."
        elif each.is_thin:
            yield f"Of {name} little is seen: {each.found} of {each.sought} places show a surface."


def _of_what_is_left(left: Array, tool: ToolSpecification) -> Iterator[str]:
    names = [*_CHANGES, *(f"the angle {joint.name}" for joint in tool.joints)]
    unseen = dict.fromkeys(name for name, share in zip(names, left, strict=True) if share > _OPEN_VARIANCE)
    if unseen:
        yield f"The volume does not show {' or '.join(unseen)}: there it stays about as it was placed."


def _of_the_way(*, has_left: bool, is_settled: bool) -> Iterator[str]:
    if has_left:
        yield "It moved far: look whether it lies on the tool."
    if not is_settled:
        yield "It was moving still: refining again may bring it nearer."
