"""Pose targets: what a network learns, computed from keypoints in micrometres."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.angles import angles_deg, signed_angle_deg, unit_vectors
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
    points_um = np.array([positions_um.get(name, (np.nan,) * 3) for name in tool.keypoint_names])
    arrays = target_arrays(points_um, tool)
    hinges = hinge_axes or {}
    signed: dict[str, float] = {}
    for angle in tool.targets.angles:
        hinge = hinges.get(angle.name)
        if hinge is not None and any(hinge) and not np.isnan(arrays.angles_deg[angle.name]):
            first, second = (link_direction_um(points_um, tool, name) for name in (angle.first, angle.second))
            signed[angle.name] = signed_angle_deg(first, second, hinge)
    return PoseTargets(
        _known(arrays.position_um),
        _known(arrays.orientation),
        {name: float(value) for name, value in arrays.angles_deg.items() if not np.isnan(value)},
        signed,
    )


def _known(value: NDArray[np.float64] | None) -> Vector | None:
    return None if value is None or np.isnan(value).any() else vector(value)


@dataclass(frozen=True)
class TargetArrays:
    """The pose targets of many annotations at once; NaN where an annotation lacks the points for one.

    Attributes
    ----------
    position_um : (…, 3) array of float64 or None
        None where the tool has no such target.
    orientation : (…, 3) array of float64 or None
        Unit vectors; None where the tool has no such target.
    angles_deg : mapping of str to (…) array of float64
        Unsigned, for each of the tool's angle targets.
    """

    position_um: NDArray[np.float64] | None
    orientation: NDArray[np.float64] | None
    angles_deg: Mapping[str, NDArray[np.float64]]


def target_arrays(positions_um: NDArray[np.float64], tool: ToolSpecification) -> TargetArrays:
    """Compute the pose targets of many annotations, by the formulas of `pose_targets`.

    Parameters
    ----------
    positions_um : (…, K, 3) array of float64
        In µm, keypoints in the tool's order; NaN for those that have no position.
    """
    ends, names = tool.targets.orientation, tool.keypoint_names
    used = [names.index(name) for name in tool.targets.position or ()]
    return TargetArrays(
        positions_um[..., used, :].mean(axis=-2) if used else None,
        None
        if ends is None
        else unit_vectors(
            positions_um[..., names.index(ends[1]), :] - positions_um[..., names.index(ends[0]), :]
        ),
        {
            angle.name: angles_deg(
                link_direction_um(positions_um, tool, angle.first),
                link_direction_um(positions_um, tool, angle.second),
            )
            for angle in tool.targets.angles
        },
    )


def link_direction_um(
    positions_um: NDArray[np.float64], tool: ToolSpecification, link_name: str
) -> NDArray[np.float64]:
    """Return the vectors from a link's base to its tip, (…, 3) in µm, of keypoints (…, K, 3) in µm."""
    link, names = tool.link(link_name), tool.keypoint_names
    return positions_um[..., names.index(link.tip), :] - positions_um[..., names.index(link.base), :]
