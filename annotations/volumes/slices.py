"""Planes of a volume and where to draw them: coarse ones, cut from a level at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from annotations.volumes.levels import Level
from annotations.volumes.spacing import SpacingUm
from annotations.volumes.volume import Array


@dataclass(frozen=True, eq=False)
class SliceImage:
    """A plane of a volume, with its place.

    Attributes
    ----------
    data : numpy.ndarray
        Two-dimensional: the two axes other than `axis`, in their order; in memory. As made here, C-contiguous
        and in one of the types of `annotations.volumes.levels.displayed_dtype`.
    spacing_um : tuple of float
        Of its pixels, along the two axes.
    origin_um : tuple of float
        The centre of its pixel (0, 0) in the volume's frame, along the two axes.
    axis : int
        The volume's axis that the plane is perpendicular to.
    index : int
        The full-resolution plane that it stands for.
    every : tuple of int, or None
        Of the plane's voxels, along the two axes, it has each how many-th. None where it was cut from a
        level: that has voxels of a plane nearby, or means.
    """

    data: Array
    spacing_um: tuple[float, float]
    origin_um: tuple[float, float]
    axis: int
    index: int
    every: tuple[int, int] | None = None

    @property
    def sharp(self) -> bool:
        """Whether it has every pixel of the volume."""
        return self.every == (1, 1)


def level_slice(
    level: Level, volume_shape: Sequence[int], volume_spacing_um: SpacingUm, axis: int, index: int
) -> SliceImage:
    """Return a level's plane nearest to a plane of the volume; never waits for the disk.

    Parameters
    ----------
    level : Level
    volume_shape : sequence of int
    volume_spacing_um : tuple of float
    axis : int
        0, 1 or 2.
    index : int
        Of the volume's plane.

    Raises
    ------
    IndexError
        The volume has no such plane, or the level is a detail that the plane does not cross.
    """
    if not 0 <= index < volume_shape[axis]:
        raise IndexError(f"no plane {index} along axis {axis} of a volume of shape {tuple(volume_shape)}")
    place = (index * volume_spacing_um[axis] - level.origin_um[axis]) / level.spacing_um[axis]
    count = level.data.shape[axis]
    nearest = round(place)
    if level.kind == "detail" and not 0 <= nearest < count:
        raise IndexError(f"plane {index} along axis {axis} does not cross this detail")
    # The outermost planes of a volume can lie half a coarse voxel beyond the level's outermost centres.
    plane = np.moveaxis(level.data, axis, 0)[min(max(nearest, 0), count - 1)]
    across, down = (other for other in range(3) if other != axis)
    return SliceImage(
        data=np.ascontiguousarray(plane),
        spacing_um=(level.spacing_um[across], level.spacing_um[down]),
        origin_um=(level.origin_um[across], level.origin_um[down]),
        axis=axis,
        index=index,
    )
