"""A tool's pose as the numbers, scaled to [0, 1], that a network regresses directly. Needs no torch."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.errors import UserError
from annotations.geometry.angles import unit_vectors
from annotations.geometry.frames import Vector
from annotations.geometry.targets import TargetArrays, target_arrays
from annotations.geometry.tool import AngleTarget, ToolSpecification

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PoseScaling:
    """What the numbers of a pose mean: position, orientation, and each angle target, in this order.

    0 and 1 are the ends of the workspace along each axis, −1 and 1 for the orientation's components, and the
    least and largest unsigned angle. Nothing is cut off: what lies beyond has numbers beyond.

    Attributes
    ----------
    tool : ToolSpecification
    low_um, high_um : (float, float, float)
        Ends of the workspace in the volume's frame.

    Raises
    ------
    UserError
        The tool has no position or no orientation. It may have any number of angles, also none.
    """

    tool: ToolSpecification
    low_um: Vector
    high_um: Vector

    def __post_init__(self) -> None:
        targets = self.tool.targets
        for name, target in (("position", targets.position), ("orientation", targets.orientation)):
            if target is None:
                raise UserError(
                    f"the tool {self.tool.name!r} has no target {name!r}, so its pose cannot be regressed",
                    remedy="Choose a network that gives heatmaps, or add the target to the specification",
                )

    @property
    def names(self) -> tuple[str, ...]:
        """What each number is of: 8 for a tool with two angles."""
        axes = [f"{target}_{axis}" for target in ("position", "orientation") for axis in range(3)]
        return (*axes, *(angle.name for angle in self.tool.targets.angles))

    def scaled(self, positions_um: ArrayLike) -> Array:
        """Return the numbers of poses.

        Parameters
        ----------
        positions_um : array_like, shape (…, K, 3)
            Keypoints in the tool's order; NaN for those that have no position.

        Returns
        -------
        ndarray of float64, shape (…, len(names))
            NaN for a target whose keypoints are missing.
        """
        targets = target_arrays(np.asarray(positions_um, dtype=np.float64), self.tool)
        low, high = self._ends
        angles = [targets.angles_deg[angle.name][..., None] for angle in self.tool.targets.angles]
        parts = [part for part in (targets.position_um, targets.orientation) if part is not None]
        return np.asarray((np.concatenate([*parts, *angles], axis=-1) - low) / (high - low))

    def targets(self, scaled: ArrayLike) -> TargetArrays:
        """Return the pose targets of numbers, shape (…, len(names)); the orientation gets its length of 1."""
        low, high = self._ends
        values = low + np.asarray(scaled, dtype=np.float64) * (high - low)
        return TargetArrays(
            values[..., :3],
            unit_vectors(values[..., 3:6]),
            {angle.name: values[..., 6 + place] for place, angle in enumerate(self.tool.targets.angles)},
        )

    @property
    def _ends(self) -> tuple[Array, Array]:
        angles_deg = [angle_range_deg(angle, self.tool) for angle in self.tool.targets.angles]
        low = [*self.low_um, -1.0, -1.0, -1.0, *(least for least, _ in angles_deg)]
        high = [*self.high_um, 1.0, 1.0, 1.0, *(largest for _, largest in angles_deg)]
        return np.array(low), np.array(high)


def angle_range_deg(angle: AngleTarget, tool: ToolSpecification) -> tuple[float, float]:
    """Return the least and largest unsigned angle that an angle target can have.

    A joint of its name with a hinge across the links limits it; without one it may be anything.
    """
    for joint in tool.joints:
        if joint.name == angle.name and abs(joint.hinge_axis[0]) < 1e-6:
            low, high = joint.limits_deg
            least = 0.0 if low <= 0 <= high else min(abs(low), abs(high))
            return least, max(abs(low), abs(high))
    return 0.0, 180.0
