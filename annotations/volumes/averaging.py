"""Means of blocks of a whole volume, streamed so that little of it is in memory at a time."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from annotations.errors import Cancelled
from annotations.volumes.levels import Level, displayed_dtype, merged_shape, preview_factors
from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.volume import Array, Region, Volume, with_axis

AVERAGED_BUDGET_VOXELS = 5_000_000
"""What a renderer without a GPU draws at rest in under half a second."""

_TILE_BYTES = 16 << 20
_WHOLE_BYTES = 5 << 29
"""As much of a file is read at the most, where it can be read in part: a full volume, whole."""
_PART_BYTES = 3 << 29
"""As much is added up of one that is read in part: rows take longer to add than whole planes."""


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

    Of a file that is larger than a full volume and can be read in part, only some planes of each block count,
    and of those some rows: it takes no longer.

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
    slow = 2 if volume.fortran_order else 0
    counted = _counted_planes(volume, factors[slow])
    # In the order of memory, as the sums run along it.
    others = factors[1::-1] if volume.fortran_order else factors[1:]
    rows = _counted_rows(volume, counted / factors[slow], others[0])
    tiles = list(_tiles(volume, factors, counted))
    parts = [_parts(tile, slow, factors[slow], counted) for tile in tiles]
    for region, read, following in zip(tiles, parts, [*parts[1:], []], strict=True):
        if cancelled():
            raise Cancelled
        for part in following:
            volume.prefetch(part)
        found = [volume.read(part) for part in read]
        if volume.fortran_order:
            found = [each.transpose() for each in found]
        if counted == factors[slow]:
            found = [found[0][place::counted] for place in range(min(counted, len(found[0])))]
        means = _means(found, others, rows, data.dtype)
        first, second, third = (
            slice(part.start // factor, -(-part.stop // factor))
            for part, factor in zip(region, factors, strict=True)
        )
        data[first, second, third] = means.transpose() if volume.fortran_order else means
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


def _counted_rows(volume: Volume, counted_share: float, factor: int) -> list[int]:
    """Return the places of those rows of a block's planes that are added up: evenly over it, the first too.

    Parameters
    ----------
    volume : Volume
    counted_share : float
        Of the volume's planes.
    factor : int
        Rows of a block.
    """
    count = factor
    if counted_share < 1:
        size = math.prod(volume.shape) * volume.dtype.itemsize * counted_share
        # Of more than half of them the first is one: a partial block always has it.
        count = min(factor, max(factor // 2 + 1, int(factor * _PART_BYTES / size)))
    return [(2 * number + 1) * factor // (2 * count) for number in range(count)]


def _parts(region: Region, slow: int, factor: int, counted: int) -> list[Region]:
    """Return a tile, or those of its planes that count: evenly over each block, alike in all of them.

    Each is the planes that have one place in their blocks, of all the tile's blocks.
    """
    if counted == factor:
        return [region]
    along = region[slow]
    # A block at the end that is a partial one is a tile of its own.
    length = min(factor, along.stop - along.start)
    count = min(counted, length)
    places = [(2 * number + 1) * length // (2 * count) for number in range(count)]
    return [with_axis(region, slow, slice(along.start + place, along.stop, factor)) for place in places]


def _tiles(volume: Volume, factors: Sequence[int], counted: int) -> Iterator[Region]:
    """Cut a volume into tiles of whole blocks, in the order of the file, near to whole chunks, and small."""
    slow = 2 if volume.fortran_order else 0
    limit = _TILE_BYTES // volume.dtype.itemsize * factors[slow] // counted
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
    if counted < factors[slow] and (rest := volume.shape[slow] % factors[slow]):
        # The planes that count lie elsewhere in a partial block.
        whole = volume.shape[slow] - rest
        cuts[slow] = [*_cuts(whole, edges[slow]), slice(whole, whole + rest)]
    if volume.fortran_order:
        for third, second, first in itertools.product(*reversed(cuts)):
            yield (first, second, third)
    else:
        yield from itertools.product(*cuts)


def _cuts(length: int, edge: int) -> list[slice]:
    return [slice(start, min(start + edge, length)) for start in range(0, length, edge)]


def _means(
    planes: Sequence[Array], factors: Sequence[int], rows: Sequence[int], dtype: np.dtype[Any]
) -> Array:
    """Return the means of a tile's blocks.

    Parameters
    ----------
    planes : sequence of numpy.ndarray
        The first, second … plane of each block: the index along axis 0 is the block's. The last block may
        lack some.
    factors : sequence of int
        Of the blocks along axes 1 and 2.
    rows : sequence of int
        Places along axis 1, in each block, that count.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        counts: Array
        if planes[0].dtype.kind == "f" and any(np.isnan(each).any() for each in planes):
            valid = [~np.isnan(each) for each in planes]
            sums = _sums([np.where(*each, 0) for each in zip(valid, planes, strict=True)], factors, rows)
            counts = _sums([each.view(np.uint8) for each in valid], factors, rows)
        else:
            sums = _sums(planes, factors, rows)
            counts = _block_sizes(planes, factors, rows)
        means = sums / counts
        if dtype.kind in "iu":
            np.rint(means, out=means)
        return means.astype(dtype)


def _sums(planes: Sequence[Array], factors: Sequence[int], rows: Sequence[int]) -> Array:
    """Sum over blocks, one axis after the other, each time in the narrowest type that holds the sums."""
    peak = 0
    if planes[0].dtype.kind in "iu" and planes[0].dtype.itemsize <= 2:
        bounds = np.iinfo(planes[0].dtype)
        peak = max(int(bounds.max), -int(bounds.min))
    second, third = factors
    if len(rows) < second or len(planes) < second // 2:
        # Whole planes are added faster than rows, but few of them leave much to be added.
        peak *= len(rows)
        planes = [_merged(each, 1, second, rows, peak) for each in planes]
        second, rows = 1, [0]
    peak *= len(planes)
    sums = _added(planes, peak)
    peak *= len(rows)
    sums = _merged(sums, 1, second, rows, peak)
    return _merged(sums, 2, third, range(third), peak * third)


def _merged(values: Array, axis: int, factor: int, places: Sequence[int], peak: int) -> Array:
    """Add up, along an axis, what lies at some places of each block; the first place is the block's first."""
    before = (slice(None),) * axis
    there = [place for place in places if place < values.shape[axis]]
    return _added([values[(*before, slice(place, None, factor))] for place in there], peak)


def _added(addends: Sequence[Array], peak: int) -> Array:
    """Add arrays of which the first is the longest along each axis."""
    total = np.zeros(addends[0].shape, _accumulator(addends[0].dtype, peak))
    for addend in addends:
        total[tuple(slice(length) for length in addend.shape)] += addend
    return total


def _accumulator(dtype: np.dtype[Any], peak: int) -> type[np.number[Any]]:
    if peak == 0 or dtype.kind == "f":
        return np.float64
    narrow: tuple[type[np.integer[Any]], ...] = (
        (np.uint16, np.uint32) if dtype.kind == "u" else (np.int16, np.int32)
    )
    return next((each for each in narrow if peak <= np.iinfo(each).max), np.float64)


def _block_sizes(planes: Sequence[Array], factors: Sequence[int], rows: Sequence[int]) -> Array:
    first = np.zeros(len(planes[0]))
    for each in planes:
        first[: len(each)] += 1
    sizes: list[Array] = []
    for length, factor, places in zip(planes[0].shape[1:], factors, (rows, range(factors[1])), strict=True):
        along = np.full(-(-length // factor), len(places), dtype=np.float64)
        along[-1] = sum(place < length - factor * (len(along) - 1) for place in places)
        sizes.append(along)
    second, third = sizes
    counts: Array = first[:, None, None] * second[None, :, None] * third[None, None, :]
    return counts
