"""Means of blocks of a whole volume, streamed so that little of it is in memory at a time."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from annotations.errors import Cancelled
from annotations.volumes.levels import Level, displayed_dtype, merged_shape, preview_factors
from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.volume import Array, Region, Volume

AVERAGED_BUDGET_VOXELS = 5_000_000
"""What a renderer without a GPU draws at rest in under half a second."""

_TILE_BYTES = 16 << 20
_WHOLE_BYTES = 5 << 29
"""As much of a file is read at the most, where it can be read in part: a full volume, whole."""


def averaged_level(
    volume: Volume,
    spacing_um: SpacingUm,
    *,
    budget_voxels: int = AVERAGED_BUDGET_VOXELS,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> Level:
    """Return the means of blocks of voxels: finer than the preview, and with less speckle.

    The blocks are as near to cubes as `preview_factors` makes them. The last block along an axis may be a
    partial one, whose mean is that of the voxels it has. NaN does not count in a mean; a block of nothing
    else is NaN. Means of integers are rounded.

    Of a file that is larger than a full volume and can be read in part, only some planes of each block count:
    it takes no longer to read, and as many voxels make a mean.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels.
    budget_voxels : int
        Of the result.
    progress : callable
        Called with the fraction done, from 0 to 1, several times a second.
    cancelled : callable
        Asked as often whether to stop.

    Raises
    ------
    Cancelled
        `cancelled` said so.
    VolumeError
        The file can no longer be read.
    """
    spacing = validate_spacing_um(spacing_um)
    factors = preview_factors(volume.shape, spacing, budget_voxels)
    data = np.empty(merged_shape(volume.shape, factors), displayed_dtype(volume.dtype), order="F")
    progress(0.0)
    done = 0
    tiles = list(_tiles(volume, factors))
    slow = 2 if volume.fortran_order else 0
    counted = _counted_planes(volume, factors[slow])
    counted_factors = tuple(counted if axis == slow else factor for axis, factor in enumerate(factors))
    for region, following in zip(tiles, [*tiles[1:], None], strict=True):
        if cancelled():
            raise Cancelled
        if following is not None:
            for part in _parts(following, slow, factors[slow], counted):
                volume.prefetch(part)
        parts = [volume.read(part) for part in _parts(region, slow, factors[slow], counted)]
        values = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=slow)
        first, second, third = (
            slice(part.start // factor, -(-part.stop // factor))
            for part, factor in zip(region, factors, strict=True)
        )
        if volume.fortran_order:
            # The sums run along memory when the axes are turned round.
            means = _means(values.transpose(), counted_factors[::-1], data.dtype).transpose()
        else:
            means = _means(values, counted_factors, data.dtype)
        data[first, second, third] = means
        done += math.prod(part.stop - part.start for part in region)
        progress(done / math.prod(volume.shape))
    spacing_of_blocks = np.multiply(spacing, factors)
    origin = np.multiply(spacing, np.subtract(factors, 1) / 2.0)
    return Level(
        data=data,
        spacing_um=(float(spacing_of_blocks[0]), float(spacing_of_blocks[1]), float(spacing_of_blocks[2])),
        origin_um=(float(origin[0]), float(origin[1]), float(origin[2])),
        kind="averaged",
        factors=factors,
    )


def _counted_planes(volume: Volume, factor: int) -> int:
    """Return how many of a block's planes along the file's slowest axis are read."""
    size = math.prod(volume.shape) * volume.dtype.itemsize
    if volume.chunks is not None or size <= _WHOLE_BYTES:
        return factor
    return max(1, factor * _WHOLE_BYTES // size)


def _parts(region: Region, slow: int, factor: int, counted: int) -> list[Region]:
    """Return a region, or those of its planes that count: evenly over each block, alike in all of them."""
    if counted == factor:
        return [region]
    parts = []
    for begin in range(region[slow].start, region[slow].stop, factor):
        length = min(factor, region[slow].stop - begin)
        count = min(counted, length)
        for number in range(count):
            index = begin + (2 * number + 1) * length // (2 * count)
            first, second, third = (
                slice(index, index + 1) if axis == slow else part for axis, part in enumerate(region)
            )
            parts.append((first, second, third))
    return parts


def _tiles(volume: Volume, factors: Sequence[int]) -> Iterator[Region]:
    """Cut a volume into tiles of whole blocks, in the order of the file, near to whole chunks, and small."""
    limit = _TILE_BYTES // volume.dtype.itemsize
    chunks = volume.chunks or (1, 1, 1)
    edges = [
        min(-(-length // factor), max(1, round(chunk / factor))) * factor
        for length, factor, chunk in zip(volume.shape, factors, chunks, strict=True)
    ]
    fastest_first = (0, 1, 2) if volume.fortran_order else (2, 1, 0)
    for axis in fastest_first:
        most = -(-volume.shape[axis] // edges[axis])
        edges[axis] *= min(most, max(1, limit // math.prod(edges)))
    cuts = [_cuts(length, edge) for length, edge in zip(volume.shape, edges, strict=True)]
    if volume.fortran_order:
        for third, second, first in itertools.product(*reversed(cuts)):
            yield (first, second, third)
    else:
        yield from itertools.product(*cuts)


def _cuts(length: int, edge: int) -> list[slice]:
    return [slice(start, min(start + edge, length)) for start in range(0, length, edge)]


def _means(values: Array, factors: Sequence[int], dtype: np.dtype[Any]) -> Array:
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        counts: Array
        if values.dtype.kind == "f" and np.isnan(values).any():
            valid = ~np.isnan(values)
            sums = _sums(np.where(valid, values, 0), factors)
            counts = _sums(valid.view(np.uint8), factors)
        else:
            sums = _sums(values, factors)
            counts = _block_sizes(values.shape, factors)
        means = sums / counts
        if dtype.kind in "iu":
            np.rint(means, out=means)
        return means.astype(dtype)


def _sums(values: Array, factors: Sequence[int]) -> Array:
    """Sum over blocks, one axis after the other, each time in the narrowest type that holds the sums."""
    peak = 0
    if values.dtype.kind in "iu" and values.dtype.itemsize <= 2:
        bounds = np.iinfo(values.dtype)
        peak = max(int(bounds.max), -int(bounds.min))
    for axis, factor in enumerate(factors):
        peak *= factor
        dtype = _accumulator(values.dtype, peak)
        shape = list(values.shape)
        shape[axis] = -(-shape[axis] // factor)
        sums = np.zeros(shape, dtype)
        for offset in range(min(factor, values.shape[axis])):
            addend = values[(slice(None),) * axis + (slice(offset, None, factor),)]
            sums[(slice(None),) * axis + (slice(addend.shape[axis]),)] += addend
        values = sums
    return values


def _accumulator(dtype: np.dtype[Any], peak: int) -> type[np.number[Any]]:
    if peak == 0 or dtype.kind == "f":
        return np.float64
    narrow: tuple[type[np.integer[Any]], ...] = (
        (np.uint16, np.uint32) if dtype.kind == "u" else (np.int16, np.int32)
    )
    return next((each for each in narrow if peak <= np.iinfo(each).max), np.float64)


def _block_sizes(shape: Sequence[int], factors: Sequence[int]) -> Array:
    sizes: list[Array] = []
    for length, factor in zip(shape, factors, strict=True):
        along = np.full(-(-length // factor), factor, dtype=np.float64)
        along[-1] = length - factor * (len(along) - 1)
        sizes.append(along)
    first, second, third = sizes
    counts: Array = first[:, None, None] * second[None, :, None] * third[None, None, :]
    return counts
