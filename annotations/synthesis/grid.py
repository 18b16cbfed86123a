"""Where the voxels of a synthetic volume lie: any number of them over the scanner's workspace."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, extent_um, vector, voxel_to_um
from annotations.volumes.spacing import OMES_REALTIME_SPACING_UM, OMES_SPACING_UM

FULL_SHAPE = (1096, 1936, 1152)
"""Voxels of the scanner's full volume."""

REALTIME_SHAPE = (28, 1936, 1152)
"""Voxels of its real-time volume, which covers the same workspace."""


@dataclass(frozen=True)
class Grid:
    """The voxels of a volume.

    Attributes
    ----------
    shape : (int, int, int)
        Voxels along axes 0, 1, 2; axis 2 is depth.
    spacing_um : (float, float, float)
        Between their centres; voxel (0, 0, 0) is the origin.
    """

    shape: tuple[int, int, int] = FULL_SHAPE
    spacing_um: Vector = OMES_SPACING_UM

    @classmethod
    def over_workspace(cls, shape: tuple[int, int, int]) -> "Grid":
        """Return a grid of this shape over the workspace of the full volume: fewer voxels are larger ones."""
        if shape == REALTIME_SHAPE:
            return cls(shape, OMES_REALTIME_SPACING_UM)
        # Rounded to a picometre, so that the full shape has the scanner's own figures again.
        return cls(shape, vector(np.round(np.array(WORKSPACE_UM) / shape, 6)))

    def axis_um(self, axis: int) -> NDArray[np.float64]:
        """Return the positions in µm of the voxels' centres along an axis, shape (n,)."""
        return np.asarray(np.arange(self.shape[axis]) * self.spacing_um[axis], dtype=np.float64)

    @property
    def extent_um(self) -> Vector:
        """Position in µm of the last voxel's centre."""
        return extent_um(self.shape, self.spacing_um)


WORKSPACE_UM = vector(voxel_to_um(FULL_SHAPE, OMES_SPACING_UM))
"""Size of the scanner's workspace, 17.4 × 26.1 × 10.8 mm."""
