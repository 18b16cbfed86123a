"""Tools seen in a mirror across an array axis: what a flip of a volume does to positions, poses and boxes.

A mirror turns right-handed frames into left-handed ones. A tool that is its own mirror image, y → −y in the
frame of each link, looks in the mirror like itself in another pose: with the mirror M and S = diag(1, −1, 1),
a rotation R becomes M R S. Its own +y, the sense of a hinge, is an axial vector, and becomes −M y.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification

_OWN_MIRROR = np.diag([1.0, -1.0, 1.0])
_ROUNDING = 1e-6
"""As far as a specification's unit vectors may be off."""


def mirrored_um(position_um: ArrayLike, axis: int, plane_um: float) -> NDArray[np.float64]:
    """Return positions in a mirror.

    Parameters
    ----------
    position_um : array_like, shape (…, 3)
        In µm; NaN stays NaN.
    axis : int
        The array axis that the mirror is perpendicular to.
    plane_um : float
        Where it stands on that axis.

    Returns
    -------
    ndarray of float64, shape (…, 3)
    """
    mirrored = np.array(position_um, dtype=np.float64)
    mirrored[..., axis] = 2 * plane_um - mirrored[..., axis]
    return mirrored


def mirrored_direction(direction: ArrayLike, axis: int) -> NDArray[np.float64]:
    """Return directions, shape (…, 3), in a mirror across an array axis: those from one point to another."""
    return mirrored_um(direction, axis, 0.0)


def turn_sense(hinge_axis: Vector) -> int | None:
    """Say what becomes of a joint's signed angle in a mirror, which is the same for every mirror.

    The turn about h by θ becomes, in the mirrored frame, S · turn(h, θ) · S = turn(−S h, θ).

    Parameters
    ----------
    hinge_axis : (float, float, float)
        Unit vector in the parent's own frame.

    Returns
    -------
    int or None
        1 for a hinge along own y: the angle stays. −1 for one in the own xz plane: it changes its sign. None
        for any other: the turn in the mirror is not one about this hinge.
    """
    x, y, z = hinge_axis
    if max(abs(x), abs(z)) <= _ROUNDING:
        return 1
    return -1 if abs(y) <= _ROUNDING else None


def has_mirrored_poses(tool: ToolSpecification) -> bool:
    """Say whether a tool in a mirror is that tool in another pose: one with an oblique hinge is not."""
    return all(turn_sense(joint.hinge_axis) is not None for joint in tool.joints)


def mirrored_pose(pose: ToolPose, tool: ToolSpecification, axis: int, plane_um: float) -> ToolPose | None:
    """Return the pose that shows a posed tool as it looks in a mirror, or None if no pose does.

    Its keypoints are the mirrored keypoints. An angle that has changed its sign may lie beyond its limits.

    Parameters
    ----------
    pose : ToolPose
    tool : ToolSpecification
    axis, plane_um : int, float
        The mirror, as in `mirrored_um`.
    """
    angles_deg = {}
    for joint in tool.joints:
        sense = turn_sense(joint.hinge_axis)
        if sense is None:
            return None
        if joint.name in pose.angles_deg:
            angles_deg[joint.name] = sense * pose.angles_deg[joint.name]
    return ToolPose(
        vector(mirrored_um(pose.position_um, axis, plane_um)),
        _mirrored_rotation(pose.rotation_wxyz, axis),
        angles_deg,
    )


def mirrored_box(box: Box, axis: int, plane_um: float) -> Box:
    """Return a box as it looks in a mirror, as in `mirrored_um`: the sense of its +y turns round."""
    return replace(
        box,
        center_um=vector(mirrored_um(box.center_um, axis, plane_um)),
        rotation_wxyz=_mirrored_rotation(box.rotation_wxyz, axis),
    )


def _mirrored_rotation(rotation_wxyz: rotations.Quaternion, axis: int) -> rotations.Quaternion:
    # The columns of a rotation are directions.
    mirrored = mirrored_direction(rotations.matrix(rotation_wxyz).T, axis).T
    return rotations.from_matrix(mirrored @ _OWN_MIRROR)
