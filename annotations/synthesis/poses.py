"""Random legal poses of a tool inside a scanner's workspace."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.geometry import rotations
from annotations.geometry.body import LinkBody, SolidBody, link_bodies
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.synthesis.mesh_tool import MeshTool

Array = NDArray[np.float64]

_CLEARANCE_UM = 300.0
"""Least depth of the tool's surface, so that its whole front is in the volume."""
_UNTURNED = (1.0, 0.0, 0.0, 0.0)
_SLACK_UM = 1e-3
_TURNS_PER_ANGLES = 200
_DRAWS_OF_ANGLES = 6


def random_pose(
    tool: ToolSpecification,
    rng: np.random.Generator,
    extent_um: Vector,
    deepest_um: float,
    largest_tilt_deg: float = 15.0,
    mesh: MeshTool | None = None,
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
    largest_tilt_deg : float
        Tilt of the root link out of the plane across the light, either way.
    mesh : MeshTool, optional
        The tool's body, instead of that of its specification; its joints stand as a mesh of it does.

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
    room_um = np.array(extent_um) - [0.0, 0.0, _CLEARANCE_UM] + _SLACK_UM
    for _ in range(_DRAWS_OF_ANGLES):
        if mesh is None:
            angles_deg = {joint.name: float(rng.uniform(*joint.limits_deg)) for joint in tool.joints}
        else:
            angles_deg = mesh.angles_deg(rng)
        outline = _Outline.of(link_bodies(ToolPose((0.0, 0.0, 0.0), _UNTURNED, angles_deg), tool).values())
        for _ in range(_TURNS_PER_ANGLES):
            rotation_wxyz = _random_rotation(rng, largest_tilt_deg)
            # Most rotations are refused, so that is decided fast; the rest are measured again, exactly.
            if mesh is None and np.any(outline.span_um(rotation_wxyz) > room_um):
                continue
            pose = ToolPose((0.0, 0.0, 0.0), rotation_wxyz, angles_deg)
            lowest, highest = _free_um(pose, tool, mesh, extent_um, deepest_um)
            if np.all(lowest <= highest):
                return ToolPose(vector(rng.uniform(lowest, highest)), rotation_wxyz, angles_deg)
    raise UserError(
        f"the tool {tool.name!r} does not fit into the workspace of "
        + " × ".join(f"{length / 1000:.1f}" for length in extent_um)
        + f" mm with its keypoints less than {deepest_um / 1000:g} mm deep",
        remedy="Choose a smaller tool",
    )


@dataclass(frozen=True, eq=False)
class _Outline:
    """The bodies of a bent tool in the root link's frame: what shows quickly how much room a rotation takes.

    Attributes
    ----------
    center_um, axes, half_size_um, is_round : ndarray, shapes (n, 3), (n, 3, 3), (n, 3) and (n, 1)
        Those of n bodies.
    """

    center_um: Array
    axes: Array
    half_size_um: Array
    is_round: NDArray[np.bool_]

    @classmethod
    def of(cls, bodies: Iterable[LinkBody]) -> "_Outline":
        """Return the outline of bodies that stand unturned."""
        parts = [(body.center_um, body.axes, body.half_size_um, [body.is_round]) for body in bodies]
        return cls(*(np.array(values) for values in zip(*parts, strict=True)))

    def span_um(self, rotation_wxyz: rotations.Quaternion) -> Array:
        """Return the size of the turned bodies along each axis, shape (3,); see `LinkBody.bounds_um`."""
        turn = rotations.matrix(rotation_wxyz)
        axes = np.abs(turn @ self.axes)
        half, along = self.half_size_um, axes[:, :, 0]
        block = (axes @ half[:, :, None])[:, :, 0]
        cylinder = half[:, :1] * along + half[:, 1:2] * np.sqrt(np.maximum(1 - along**2, 0))
        reach = np.where(self.is_round, cylinder, block)
        middle = self.center_um @ turn.T
        return np.asarray((middle + reach).max(axis=0) - (middle - reach).min(axis=0))


def _free_um(
    pose: ToolPose, tool: ToolSpecification, mesh: MeshTool | None, extent_um: Vector, deepest_um: float
) -> tuple[Array, Array]:
    """Return the lowest and the highest shift of a pose that `random_pose` allows, shape (3,) each."""
    bodies: Mapping[str, SolidBody] = link_bodies(pose, tool) if mesh is None else mesh.bodies(pose)
    bounds = [body.bounds_um() for body in bodies.values()]
    lowest = np.array([0.0, 0.0, _CLEARANCE_UM]) - np.min([low for low, _ in bounds], axis=0)
    highest = np.array(extent_um) - np.max([high for _, high in bounds], axis=0)
    deepest = max(position[2] for position in keypoints_um(pose, tool).values())
    highest[2] = min(highest[2], deepest_um - deepest)
    return lowest, highest


def _random_rotation(rng: np.random.Generator, largest_tilt_deg: float) -> rotations.Quaternion:
    yaw, roll = rng.uniform(-180, 180, size=2)
    tilt = rng.uniform(-largest_tilt_deg, largest_tilt_deg)
    return rotations.from_yaw_pitch_roll(yaw, tilt, roll)
