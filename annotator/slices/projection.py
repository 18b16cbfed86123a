"""Which axes a slice shows, and which way they run on the screen."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, um_to_voxel, voxel_to_um

AXIS_NAMES = ("x", "y", "z")


@dataclass(frozen=True)
class Plane:
    """The planes of a volume across one axis, and how they lie on the screen.

    Depth runs downwards wherever it lies in the plane, as in a B-scan. Where it does not, the later axis
    does: so a slice across depth is seen from the scanner.

    Attributes
    ----------
    axis : int
        The array axis that the planes are across.
    horizontal, vertical : int
        The array axes that run to the right and downwards.
    shape : (int, int, int)
        Voxels of the volume along its axes.
    spacing_um : (float, float, float)
        Of the volume's voxels.
    depth_axis : int
        Along which the light travels.
    """

    axis: int
    horizontal: int
    vertical: int
    shape: tuple[int, int, int]
    spacing_um: Vector
    depth_axis: int

    @classmethod
    def across(cls, axis: int, shape: tuple[int, int, int], spacing_um: Vector, depth_axis: int) -> Self:
        """Return the planes across an axis of a volume."""
        first, second = (other for other in range(3) if other != axis)
        vertical = first if first == depth_axis else second
        horizontal = second if vertical == first else first
        return cls(axis, horizontal, vertical, shape, spacing_um, depth_axis)

    @property
    def is_transposed(self) -> bool:
        """Whether rows on the screen run along the later of the two axes, unlike those of the array."""
        return self.vertical > self.horizontal

    @property
    def low_um(self) -> tuple[float, float]:
        """The left and upper edge of the volume: half a voxel before the first centre."""
        return (-self.spacing_um[self.horizontal] / 2, -self.spacing_um[self.vertical] / 2)

    @property
    def high_um(self) -> tuple[float, float]:
        """The right and lower edge of the volume: half a voxel after the last centre."""
        right, lower = (
            (self.shape[axis] - 0.5) * self.spacing_um[axis] for axis in (self.horizontal, self.vertical)
        )
        return (right, lower)

    def index(self, position_um: Sequence[float]) -> int:
        """Return the voxel index, along the axis, of the plane of the volume nearest to a position."""
        nearest = round(float(um_to_voxel(position_um[self.axis], self.spacing_um[self.axis])))
        return min(max(nearest, 0), self.shape[self.axis] - 1)

    def depth_um(self, index: int) -> float:
        """Return where the plane with an index lies along the axis, in µm: at its voxels' centres."""
        return float(voxel_to_um(index, self.spacing_um[self.axis]))

    def distance_um(self, position_um: Sequence[float], index: int) -> float:
        """Return the signed distance of a position from the plane with an index."""
        return position_um[self.axis] - self.depth_um(index)

    def flat(self, position_um: Sequence[float]) -> tuple[float, float]:
        """Return a position's coordinates along the horizontal and the vertical axis, in µm."""
        return (position_um[self.horizontal], position_um[self.vertical])

    def lifted(self, flat_um: tuple[float, float], through_um: float) -> Vector:
        """Return the position with these coordinates in the plane and this one along the axis, in µm."""
        position = [0.0, 0.0, 0.0]
        position[self.horizontal], position[self.vertical] = flat_um
        position[self.axis] = through_um
        return (position[0], position[1], position[2])

    def on_screen(self, data: NDArray[Any]) -> NDArray[Any]:
        """Return a slice's array with rows downwards and columns to the right, C-contiguous."""
        return np.ascontiguousarray(data.T if self.is_transposed else data)
