"""The pose in which a tool looks like itself in a mirror: what `has_mirrored_poses` says there is."""

import numpy as np

from annotations.geometry import rotations
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.mirroring import mirrored_um
from annotations.geometry.tool import ToolSpecification

OWN_MIRROR = np.diag([1.0, -1.0, 1.0])


def mirrored_pose(pose: ToolPose, tool: ToolSpecification, axis: int, plane_um: float) -> ToolPose:
    """Return the pose of a tool that `has_mirrored_poses`; the mirror as in `mirrored_um`."""
    senses = {joint.name: 1 if joint.hinge_axis[1] else -1 for joint in tool.joints}
    # The columns of a rotation are directions.
    rotation = mirrored_um(rotations.matrix(pose.rotation_wxyz).T, axis, 0.0).T @ OWN_MIRROR
    return ToolPose(
        vector(mirrored_um(pose.position_um, axis, plane_um)),
        rotations.from_matrix(rotation),
        {name: senses[name] * angle_deg for name, angle_deg in pose.angles_deg.items()},
    )
