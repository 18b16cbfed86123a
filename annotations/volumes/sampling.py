"""The coarse grid that a network sees of a volume: which voxels, averaged how, scaled and padded."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from annotations.volumes.spacing import SpacingUm
from annotations.volumes.volume import Array, Region, Volume, VolumeError

_MOST_IN_16_BITS = 65535 // 255
"""Voxels of 8 bits whose sum has 16 bits."""

_LARGEST_INPUT = 1 << 24
"""Voxels of a padded input: 64 MiB as floating-point numbers, thirty times the published one."""

Count = Annotated[int, Field(gt=0, le=_LARGEST_INPUT, strict=True)]
Padding = Annotated[int, Field(ge=0, le=4096, strict=True)]
Length = Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class Sampling(BaseModel):
    """How a volume becomes the input of a network. Array axes are those of the volume.

    Sample i along an axis lies at ``i · spacing_um``, and takes the nearest voxel. Where `is_averaged`, a
    sample along the depth is the mean of the voxels whose centres lie in ``[i, i + 1) · spacing_um``, and is
    in their middle: less noise for little work, because they are neighbours in the file. Samples beyond the
    volume's end are empty, as is the padding: they have the value 0 after scaling.

    Attributes
    ----------
    shape : (int, int, int)
        Samples along array axes 0, 1, 2.
    spacing_um : (float, float, float)
        Between samples. The strides follow from it and the volume's own spacing, so that full and real-time
        volumes of one scanner are seen alike.
    depth_axis : int
        Along which the light travels; of the volumes as well.
    is_averaged : bool
    padding_before, padding_after : (int, int, int)
        Empty samples before the first and after the last along each axis.
    dtype : str
        Of the volume's voxels, as numpy names it.
    value_range : (float, float)
        The voxel values that become 0 and 1.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    shape: tuple[Count, Count, Count]
    spacing_um: tuple[Length, Length, Length]
    depth_axis: Literal[0, 1, 2] = 2
    is_averaged: bool = Field(default=True, strict=True)
    padding_before: tuple[Padding, Padding, Padding] = (0, 0, 0)
    padding_after: tuple[Padding, Padding, Padding] = (0, 0, 0)
    dtype: str = "uint8"
    value_range: tuple[Number, Number] = (0.0, 255.0)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if math.prod(self.padded_shape) > _LARGEST_INPUT:
            raise ValueError(f"an input of {self.padded_shape} voxels is larger than any network's")
        if self.value_range[0] >= self.value_range[1]:
            raise ValueError("value_range must be two values, the smaller first")
        return self

    @property
    def padded_shape(self) -> tuple[int, int, int]:
        """Voxels of the network's input along axes 0, 1, 2."""
        first, second, third = (
            before + count + after
            for before, count, after in zip(self.padding_before, self.shape, self.padding_after, strict=True)
        )
        return (first, second, third)

    def origin_in_um(self, volume_spacing_um: ArrayLike) -> NDArray[np.float64]:
        """Return the position in µm of the input's voxel (0, 0, 0), padding included, shape (3,).

        Parameters
        ----------
        volume_spacing_um : (float, float, float)
            Of the volume that is sampled: the first of n averaged voxels lies at 0, so that their middle lies
            half of one of its voxels before the middle of the sample's cell.
        """
        origin_um = -np.multiply(self.padding_before, self.spacing_um)
        if self.is_averaged:
            voxel_um = float(np.asarray(volume_spacing_um, dtype=np.float64)[self.depth_axis])
            origin_um[self.depth_axis] += (self.spacing_um[self.depth_axis] - voxel_um) / 2
        return origin_um

    def axis_um(self, axis: int, volume_spacing_um: ArrayLike) -> NDArray[np.float64]:
        """Return the positions in µm of the samples along an axis, padding left out, shape (n,)."""
        first_um = (
            self.origin_in_um(volume_spacing_um)[axis] + self.padding_before[axis] * self.spacing_um[axis]
        )
        return np.asarray(first_um + np.arange(self.shape[axis]) * self.spacing_um[axis], dtype=np.float64)

    def to_um(self, index_input: ArrayLike, volume_spacing_um: ArrayLike) -> NDArray[np.float64]:
        """Convert indices of the padded input, shape (..., 3), to positions in µm in the volume's frame."""
        index = np.asarray(index_input, dtype=np.float64)
        return np.asarray(self.origin_in_um(volume_spacing_um) + index * np.array(self.spacing_um))

    def to_index(self, position_um: ArrayLike, volume_spacing_um: ArrayLike) -> NDArray[np.float64]:
        """Convert positions in µm, shape (..., 3), to indices of the padded input, with their fractions."""
        beyond_um = np.asarray(position_um, dtype=np.float64) - self.origin_in_um(volume_spacing_um)
        return np.asarray(beyond_um / np.array(self.spacing_um))

    def scaled(self, samples: Array) -> NDArray[np.float32]:
        """Return the input, shape `padded_shape`, of samples of shape `shape` in the volume's own values."""
        low, high = self.value_range
        padded = np.zeros(self.padded_shape, dtype=np.float32)
        inner = tuple(
            slice(before, before + count)
            for before, count in zip(self.padding_before, self.shape, strict=True)
        )
        # In place, since a live volume is waited for.
        within = padded[inner]
        np.subtract(samples, np.float32(low), out=within, dtype=np.float32)
        within *= np.float32(1 / (high - low))
        np.clip(within, 0, 1, out=within)
        return padded


def sample_volume(volume: Volume, spacing_um: SpacingUm, sampling: Sampling) -> NDArray[np.float32]:
    """Return what a network sees of a volume, before scaling and padding.

    Only the planes and rows that it needs are read.

    Parameters
    ----------
    volume : Volume
    spacing_um : (float, float, float)
        Of its voxels.
    sampling : Sampling

    Returns
    -------
    ndarray of float32, shape ``sampling.shape``
        In the volume's own values; samples beyond its end have the value that is scaled to 0.

    Raises
    ------
    VolumeError
        The file can no longer be read; its voxels are of another type, or light travels along another axis,
        than the sampling is for; or its voxels are coarser than the samples.
    """
    check_fits(volume, spacing_um, sampling)
    depth = sampling.depth_axis
    slow, fast = (axis for axis in range(3) if axis != depth)
    planes = sampled_voxels(sampling, spacing_um, volume.shape, slow)
    rows = sampled_voxels(sampling, spacing_um, volume.shape, fast)
    cells = depth_cells(sampling, spacing_um, volume.shape)
    samples = np.full(sampling.shape, sampling.value_range[0], dtype=np.float32)
    if not (len(planes) and len(rows) and len(cells) > 1):
        return samples
    step = _even_step(rows)
    for place, plane in enumerate(planes.tolist()):
        region = [slice(None)] * 3
        region[slow] = slice(plane, plane + 1)
        region[fast] = slice(int(rows[0]), int(rows[-1]) + 1, step)
        region[depth] = slice(int(cells[0]), int(cells[-1]))
        values = volume.read(_as_region(region)).squeeze(slow)
        if depth < fast:
            values = values.T
        # Now rows by depth.
        if step == 1:
            values = values[rows - rows[0]]
        means = _means(values, cells - cells[0]) if sampling.is_averaged else values[:, cells[:-1] - cells[0]]
        target: list[Any] = [slice(None)] * 3
        target[slow], target[fast], target[depth] = place, slice(len(rows)), slice(len(cells) - 1)
        samples[tuple(target)] = means.T if depth < fast else means
    return samples


def sampled_voxels(
    sampling: Sampling, spacing_um: SpacingUm, shape: Sequence[int], axis: int
) -> NDArray[np.intp]:
    """Return the voxel nearest to each sample along an axis across the light, up to the volume's end."""
    stride = sampling.spacing_um[axis] / spacing_um[axis]
    index = np.rint(np.arange(sampling.shape[axis]) * stride).astype(np.intp)
    return np.asarray(index[index < shape[axis]])


def depth_cells(sampling: Sampling, spacing_um: SpacingUm, shape: Sequence[int]) -> NDArray[np.intp]:
    """Return where the voxels of each sample begin along the depth, and after them where the last ends.

    Without averaging, a sample is the first voxel from there on alone: the one nearest to it.
    """
    axis = sampling.depth_axis
    if not sampling.is_averaged:
        nearest = sampled_voxels(sampling, spacing_um, shape, axis)
        return np.append(nearest, nearest[-1] + 1)
    stride = sampling.spacing_um[axis] / spacing_um[axis]
    # A voxel whose centre lies on the border belongs to the later cell, whatever rounding did to the stride.
    borders = np.ceil(np.arange(sampling.shape[axis] + 1) * stride - 1e-6).astype(np.intp)
    begun = borders[:-1][borders[:-1] < shape[axis]]
    # Voxels that are a little farther apart than the samples leave a cell empty now and then.
    end = max(int(borders[len(begun)]), int(begun[-1]) + 1)
    return np.append(begun, min(end, shape[axis]))


def check_fits(volume: Volume, spacing_um: SpacingUm, sampling: Sampling) -> None:
    """Look whether a network can be shown a volume; nothing of it is read.

    Raises
    ------
    VolumeError
        Its voxels are of another type, or light travels along another axis, than the sampling is for; or its
        voxels are coarser than the samples.
    """
    if volume.dtype.name != sampling.dtype:
        raise VolumeError(
            f"it holds {volume.dtype.name}, and the network was trained on {sampling.dtype}",
            where=volume.path,
            remedy="Convert the volume, or use a checkpoint that was trained on such volumes",
        )
    if volume.depth_axis != sampling.depth_axis:
        raise VolumeError(
            f"its depth runs along axis {volume.depth_axis}, and in the volumes that the network was trained "
            f"on along axis {sampling.depth_axis}",
            where=volume.path,
            remedy="Correct the depth axis where the spacing is asked for, or use another checkpoint",
        )
    for axis, (voxel_um, sample_um) in enumerate(zip(spacing_um, sampling.spacing_um, strict=True)):
        if voxel_um > sample_um * 1.01:
            raise VolumeError(
                f"its voxels are {voxel_um:g} µm apart along axis {axis}, and the network needs one every "
                f"{sample_um:g} µm",
                where=volume.path,
                remedy="Correct the spacing, or use a checkpoint that was trained on such volumes",
            )


def _even_step(rows: NDArray[np.intp]) -> int:
    """Return the step between rows that are evenly spaced, else 1: then all are read, and some are taken."""
    steps = np.unique(np.diff(rows))
    return int(steps[0]) if len(steps) == 1 else 1


def _means(values: Array, cells: NDArray[np.intp]) -> NDArray[np.float32]:
    """Return the means of each row's cells, shape (rows, cells)."""
    counts = np.diff(cells)
    whole = int(counts[0])
    is_even = counts.min() > 0 and counts.max() <= _MOST_IN_16_BITS and (counts[:-1] == whole).all()
    if values.dtype != np.uint8 or not is_even:
        # Of an empty cell, the sum is the voxel where the next one begins.
        sums = np.add.reduceat(values, cells[:-1], axis=1, dtype=np.float32)
        return np.asarray(sums / np.maximum(counts, 1), dtype=np.float32)
    # Sorted by their place in the cell, the first ones of all cells and then the second ones and so on, the
    # voxels are added in a third of the time; and sorted sooner once the rows lie side by side.
    even = (len(counts) - 1) * whole
    in_cells = np.ascontiguousarray(values)[:, :even].reshape(len(values), len(counts) - 1, whole)
    by_place = np.ascontiguousarray(in_cells.transpose(2, 0, 1))
    sums_of_cells = np.empty((len(values), len(counts)), dtype=np.uint16)
    sums_of_cells[:, :-1] = by_place.sum(axis=0, dtype=np.uint16)
    sums_of_cells[:, -1] = values[:, even : cells[-1]].sum(axis=1, dtype=np.uint16)
    return np.asarray(sums_of_cells / counts.astype(np.float32), dtype=np.float32)


def _as_region(parts: Sequence[slice]) -> Region:
    first, second, third = parts
    return (first, second, third)


OMES_SAMPLING = Sampling(
    shape=(28, 139, 83),
    spacing_um=(622.0, 14 * 13.5, 14 * 9.4),
    padding_before=(2, 10, 6),
    padding_after=(2, 11, 7),
)
"""28 planes over the workspace and every 14th voxel along axes 1 and 2, as published, for full and real-time
volumes of the OMES scanner; depth averaged; with a margin of 1.2 × 1.9 × 0.8 mm for what is out of view."""

PUBLISHED_SAMPLING = Sampling(
    shape=(28, 139, 83),
    spacing_um=(622.0, 14 * 13.5, 14 * 9.4),
    is_averaged=False,
    padding_before=(2, 2, 2),
    padding_after=(2, 3, 3),
)
"""The same as published: single voxels, padded to (32, 144, 88)."""
