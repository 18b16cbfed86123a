"""Random legal poses of a tool inside a scanner's workspace."""

import numpy as np

from annotations.errors import UserError
from annotations.geometry import rotations
from annotations.geometry.body import link_bodies
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification

_CLEARANCE_UM = 300.0
"""Least depth of the tool's surface, so that its whole front is in the volume."""
_TILT_DEG = 15.0
"""Largest tilt of the root link out of the plane across the light."""
_TURNS_PER_ANGLES = 200
_DRAWS_OF_ANGLES = 6


def random_pose(
    tool: ToolSpecification, rng: np.random.Generator, extent_um: Vector, deepest_um: float
) -> ToolPose:
    """Return a random pose with the whole tool inside the volume and its keypoints within the signal.

    Joint angles are uniform within their limits, and the root link lies in any direction across the light,
    modestly tilted and rolled at will; what does not fit is drawn again, the rotation before the angles, so
    that strongly bent tools are not rarer than straight ones.

    Parameters
    ----------
    tool : ToolSpecification
    rng : numpy.random.Generator
    extent_um : (float, float, float)
        Position of the volume's last voxel; axis 2 is depth.
    deepest_um : float
        Largest depth of a keypoint.

    Raises
    ------
    UserError
        The tool has no links, or fits in no way.
    """
    if not tool.links:
        raise UserError(
            f"the tool {tool.name!r} has no links, so it has no body to be seen",
            remedy="Choose a tool whose specification has links",
        )
    for _ in range(_DRAWS_OF_ANGLES):
        angles_deg = {joint.name: float(rng.uniform(*joint.limits_deg)) for joint in tool.joints}
        for _ in range(_TURNS_PER_ANGLES):
            pose = ToolPose((0.0, 0.0, 0.0), _random_rotation(rng), angles_deg)
            bounds = [body.bounds_um() for body in link_bodies(pose, tool).values()]
            low = np.min([low for low, _ in bounds], axis=0)
            high = np.max([high for _, high in bounds], axis=0)
            lowest = np.array([0.0, 0.0, _CLEARANCE_UM]) - low
            highest = np.array(extent_um) - high
            deepest = max(position[2] for position in keypoints_um(pose, tool).values())
            highest[2] = min(highest[2], deepest_um - deepest)
            if np.all(lowest <= highest):
                return ToolPose(vector(rng.uniform(lowest, highest)), pose.rotation_wxyz, angles_deg)
    raise UserError(
        f"the tool {tool.name!r} does not fit into the workspace of "
        + " × ".join(f"{length / 1000:.1f}" for length in extent_um)
        + f" mm with its keypoints less than {deepest_um / 1000:g} mm deep",
        remedy="Choose a smaller tool",
    )


def _random_rotation(rng: np.random.Generator) -> rotations.Quaternion:
    yaw, roll = rng.uniform(-180, 180, size=2)
    tilt = rng.uniform(-_TILT_DEG, _TILT_DEG)
    return rotations.from_yaw_pitch_roll(yaw, tilt, roll)
