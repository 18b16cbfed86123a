"""Pose targets: what a network learns, computed from keypoints in micrometres."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.angles import angle_deg, scaled, signed_angle_deg
from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class PoseTargets:
    """The pose targets of one annotation; a target whose points are missing is None or absent.

    Attributes
    ----------
    position_um : (float, float, float) or None
        Mean of the tool's position keypoints, in the volume's frame.
    orientation : (float, float, float) or None
        Unit vector along the tool's direction. It has two degrees of freedom: roll is not in it.
    angles_deg : dict of str to float
        Unsigned angle in [0, 180] for each of the tool's angle targets that is known.
    signed_angles_deg : dict of str to float
        Signed angle in [−180, 180] for those whose hinge axis is known besides.
    """

    position_um: Vector | None = None
    orientation: Vector | None = None
    angles_deg: Mapping[str, float] = field(default_factory=dict)
    signed_angles_deg: Mapping[str, float] = field(default_factory=dict)


def pose_targets(
    positions_um: Mapping[str, Vector],
    tool: ToolSpecification,
    hinge_axes: Mapping[str, Vector] | None = None,
) -> PoseTargets:
    """Compute the pose targets from the keypoints that have a position.

    For the six keypoints of a tool with three links: position = (k0 + k1)/2, orientation = k1 − k0,
    θ1 = angle(k1 − k0, k3 − k2), θ2 = angle(k3 − k2, k5 − k4), as published with the dataset. By these
    formulas the angles have no sign; signed ones need the hinge axes, which keypoints alone do not give.

    Parameters
    ----------
    positions_um : mapping of str to (3,)
        Keypoint positions in µm. Voxel indices would turn every angle: the voxel is not a cube.
    tool : ToolSpecification
        Says which keypoints make which target.
    hinge_axes : mapping of str to (3,), optional
        Unit vector of a joint's hinge in the volume's frame, by the joint's name.
    """
    points = {name: np.asarray(position, dtype=np.float64) for name, position in positions_um.items()}
    directions = {
        link.name: points[link.tip] - points[link.base]
        for link in tool.links
        if link.base in points and link.tip in points
    }
    hinges = hinge_axes or {}
    unsigned: dict[str, float] = {}
    signed: dict[str, float] = {}
    for angle in tool.targets.angles:
        first, second = directions.get(angle.first), directions.get(angle.second)
        if first is None or second is None or not first.any() or not second.any():
            continue
        unsigned[angle.name] = angle_deg(first, second)
        hinge = hinges.get(angle.name)
        if hinge is not None and any(hinge):
            signed[angle.name] = signed_angle_deg(first, second, hinge)
    return PoseTargets(_position(points, tool), _orientation(points, tool), unsigned, signed)


def _position(points: Mapping[str, NDArray[np.float64]], tool: ToolSpecification) -> Vector | None:
    names = tool.targets.position
    if not names or any(name not in points for name in names):
        return None
    return vector(np.mean([points[name] for name in names], axis=0))


def _orientation(points: Mapping[str, NDArray[np.float64]], tool: ToolSpecification) -> Vector | None:
    ends = tool.targets.orientation
    if ends is None or any(name not in points for name in ends):
        return None
    direction = scaled(points[ends[1]] - points[ends[0]])
    return None if direction is None else vector(direction / math.hypot(*direction))
