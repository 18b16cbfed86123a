"""The two frames of a volume, voxels and micrometres: the only module that converts between them.

Array axes 0, 1, 2 are x, y, z. An integer index is a voxel's centre, and the centre of voxel (0, 0, 0)
is the origin of the micrometre frame.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = tuple[float, float, float]
"""Three numbers along array axes 0, 1, 2."""


def vector(values: ArrayLike) -> Vector:
    """Return three finite or infinite numbers as a plain tuple of Python floats."""
    first, second, third = np.asarray(values, dtype=np.float64)
    return (float(first), float(second), float(third))


def voxel_to_um(index_voxel: ArrayLike, spacing_um: ArrayLike) -> NDArray[np.float64]:
    """Convert voxel indices, shape (..., 3), to positions in µm; fractions of a voxel are allowed."""
    return np.asarray(index_voxel, dtype=np.float64) * np.asarray(spacing_um, dtype=np.float64)


def um_to_voxel(position_um: ArrayLike, spacing_um: ArrayLike) -> NDArray[np.float64]:
    """Convert positions in µm, shape (..., 3), to voxel indices, with their fractions."""
    return np.asarray(position_um, dtype=np.float64) / np.asarray(spacing_um, dtype=np.float64)


def nearest_voxel(
    position_um: ArrayLike, spacing_um: ArrayLike, shape: Sequence[int]
) -> tuple[int, int, int]:
    """Return the index of the voxel of a volume of this shape that is nearest to a position in µm."""
    index = np.rint(um_to_voxel(position_um, spacing_um))
    first, second, third = np.clip(index, 0, np.asarray(shape) - 1).astype(int)
    return (int(first), int(second), int(third))


def extent_um(shape: Sequence[int], spacing_um: ArrayLike) -> Vector:
    """Return the position in µm of the centre of a volume's last voxel."""
    return vector(voxel_to_um(np.asarray(shape) - 1, spacing_um))


def is_inside(position_um: ArrayLike, shape: Sequence[int], spacing_um: ArrayLike) -> bool:
    """Say whether a position in µm lies within the voxels (their outer halves included) of a volume."""
    index = um_to_voxel(position_um, spacing_um)
    return bool(np.all(index >= -0.5) and np.all(index <= np.asarray(shape) - 0.5))
