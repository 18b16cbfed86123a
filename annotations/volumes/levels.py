"""Coarser or cropped copies of a volume in memory, that know where in the volume they lie."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from annotations.volumes.intensity_samples import IntensitySamples, intensity_samples
from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.stored_intensities import StoredIntensities, stored_intensities
from annotations.volumes.volume import Array, Shape, Volume

PREVIEW_BUDGET_VOXELS = 1_000_000
"""About every 14th voxel of a full volume: fast to read and fast to draw without a GPU."""

_WINDOW_PERCENT = (1.0, 99.8)
_SPECKLE_SIGMAS = 3.0
_SIGMAS_PER_DEVIATION = 1.4826
"""Standard deviation of a normal distribution over the median of absolute deviations from its median."""
_THRESHOLD_SHARES = (0.25, 0.5)


@dataclass(frozen=True, eq=False)
class Level:
    """A copy of a volume, or of a part of it, in memory.

    Attributes
    ----------
    data : numpy.ndarray
        Shape (x, y, z), Fortran-contiguous as VTK draws it, in one of the types of `displayed_dtype`. Holds
        NaN and infinities where the volume does.
    spacing_um : tuple of float
        Of its own voxels.
    origin_um : tuple of float
        The centre of its voxel (0, 0, 0) in the volume's frame: not zero for means of blocks, whose centres
        lie (factor - 1) / 2 voxels inwards.
    kind : {"strided", "averaged", "detail"}
        Single voxels a few apart; means of blocks; or full resolution around a position.
    factors : tuple of int
        How many of the volume's voxels one of its voxels stands for, along each axis.
    """

    data: Array
    spacing_um: SpacingUm
    origin_um: tuple[float, float, float]
    kind: Literal["strided", "averaged", "detail"]
    factors: tuple[int, int, int]

    @cached_property
    def stored(self) -> StoredIntensities:
        """Its intensities as VTK draws them.

        Of other types than uint8 and uint16 they are computed, once: a tenth of a second for a fine level, in
        which a window would stand still. `ready_to_draw` has it done in another thread.
        """
        return stored_intensities(self.data)

    @cached_property
    def samples(self) -> IntensitySamples:
        """Enough of its finite values for statistics."""
        return intensity_samples(self.data)

    def ready_to_draw(self) -> Self:
        """Return this level, with all computed that it is drawn from: for the thread that made it."""
        _ = self.stored
        return self


def displayed_dtype(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type that a level of a volume of this type has.

    Integers of 8 and 16 bits stay; float32 stays; everything else (wider integers, float16, float64 and
    wider) becomes float32, which VTK and the slice views take and which no screen can tell from more.
    """
    stays = dtype.itemsize <= 2 if dtype.kind in "iu" else dtype == np.float32
    return dtype if stays else np.dtype(np.float32)


def displayed(values: Array) -> Array:
    """Return a Fortran-contiguous copy in memory, in the type that `displayed_dtype` gives."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array(values, displayed_dtype(values.dtype), order="F", copy=True)


def preview_factors(
    shape: Sequence[int], spacing_um: ArrayLike, budget_voxels: int = PREVIEW_BUDGET_VOXELS
) -> tuple[int, int, int]:
    """Return how many voxels to merge along each axis, so that the result fits a budget.

    The merged voxels are as near to cubes, in µm, as whole numbers allow; an axis that is already coarser
    is left alone, and so is a volume within the budget.

    Parameters
    ----------
    shape : sequence of int
    spacing_um : array-like of float, shape (3,)
    budget_voxels : int
        The result has no more voxels than this, one voxel at the least.
    """
    lengths = [int(length) for length in shape]
    spacing = np.asarray(spacing_um, dtype=np.float64)
    low = math.log(spacing.min()) - 1.0
    high = math.log(float(np.max(spacing * lengths))) + 1.0
    factors = _factors_for(math.exp(low), lengths, spacing)
    if _merged_voxels(lengths, factors) <= budget_voxels:
        return factors
    # The number of voxels falls as the side of a merged one grows; halving finds the smallest that fits.
    factors = (lengths[0], lengths[1], lengths[2])
    for _ in range(60):
        middle = (low + high) / 2.0
        tried = _factors_for(math.exp(middle), lengths, spacing)
        if _merged_voxels(lengths, tried) <= budget_voxels:
            high, factors = middle, tried
        else:
            low = middle
    return factors


def strided_preview(
    volume: Volume, spacing_um: SpacingUm, *, budget_voxels: int = PREVIEW_BUDGET_VOXELS
) -> Level:
    """Return single voxels of a volume, a few apart: the first thing to look at.

    Fast where the file can be mapped; of a compressed file every block that holds a wanted voxel has to be
    unpacked. The voxels are chosen so that what is left over at both ends of an axis is alike.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels.
    budget_voxels : int
        Of the result.

    Raises
    ------
    VolumeError
        The file can no longer be read.
    """
    spacing = validate_spacing_um(spacing_um)
    factors = preview_factors(volume.shape, spacing, budget_voxels)
    starts = [(length - 1) % factor // 2 for length, factor in zip(volume.shape, factors, strict=True)]
    first, second, third = (slice(start, None, factor) for start, factor in zip(starts, factors, strict=True))
    return Level(
        data=displayed(volume.load((first, second, third))),
        spacing_um=_times(spacing, factors),
        origin_um=_times(spacing, starts),
        kind="strided",
        factors=factors,
    )


def detail_block(volume: Volume, spacing_um: SpacingUm, centre_um: ArrayLike, size_um: ArrayLike) -> Level:
    """Return the voxels around a position in full resolution.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels.
    centre_um : array-like of float, shape (3,)
        In the volume's frame.
    size_um : array-like of float, shape (3,) or a single number
        Edges of the block. It is clipped at the volume's borders, and has one voxel at the least: for a
        position outside, the nearest.

    Raises
    ------
    VolumeError
        The file can no longer be read.
    """
    spacing = validate_spacing_um(spacing_um)
    centre = np.asarray(centre_um, dtype=np.float64)
    half = np.broadcast_to(np.asarray(size_um, dtype=np.float64), 3) / 2.0
    starts: list[int] = []
    parts: list[slice] = []
    for axis, length in enumerate(volume.shape):
        low = np.clip(np.ceil((centre[axis] - half[axis]) / spacing[axis]), 0, length - 1)
        high = np.clip(np.floor((centre[axis] + half[axis]) / spacing[axis]), 0, length - 1)
        start, last = (int(low), int(high)) if low <= high else (int(high), int(high))
        starts.append(start)
        parts.append(slice(start, last + 1))
    return Level(
        data=displayed(volume.load((parts[0], parts[1], parts[2]))),
        spacing_um=spacing,
        origin_um=_times(spacing, starts),
        kind="detail",
        factors=(1, 1, 1),
    )


def intensity_window(level: Level) -> tuple[float, float]:
    """Return the intensities to draw as black and as white: the 1st and the 99.8th percentile.

    So neither the dark noise of an OCT volume nor a few glaring reflections use up the contrast. Infinite
    values and NaN do not count. The result is finite and its first number is the smaller one, whatever the
    level holds.
    """
    samples = level.samples
    if samples.size == 0:
        return (0.0, 1.0)
    low, high = (samples.percentile(percent) for percent in _WINDOW_PERCENT)
    if low >= high:
        low, high = float(samples.values[0]), float(samples.values[-1])
    if low >= high:
        # A constant volume is drawn black, and one grey value above it white.
        high = low + max(1.0, abs(low) * 1e-6)
    return (low, high)


def surface_threshold(level: Level) -> float:
    """Return an intensity between speckle and surfaces, below which a picture of a level may be transparent.

    It lies three standard deviations above the median: nearly all of a volume is noise and faint medium, and
    the median of absolute deviations tells their spread whatever the rest is. The lowest intensity does not
    count, because padding and saturated noise have it. The result is at least a quarter and at most half of
    the way through `intensity_window`, so that neither an empty background nor wide noise makes everything
    or nothing visible.
    """
    low, high = intensity_window(level)
    least, most = (low + share * (high - low) for share in _THRESHOLD_SHARES)
    samples = level.samples
    samples = samples.above(samples.values[0]) if samples.size else samples
    if samples.size == 0:
        return least
    median = samples.percentile(50.0)
    sigma = _SIGMAS_PER_DEVIATION * samples.deviations_from(median).percentile(50.0)
    return float(np.clip(median + _SPECKLE_SIGMAS * sigma, least, most))


def _factors_for(side_um: float, lengths: Sequence[int], spacing: Array) -> tuple[int, int, int]:
    first, second, third = (
        min(length, max(1, round(side_um / float(step))))
        for length, step in zip(lengths, spacing, strict=True)
    )
    return (first, second, third)


def _merged_voxels(lengths: Sequence[int], factors: Sequence[int]) -> int:
    return math.prod(merged_shape(lengths, factors))


def merged_shape(lengths: Sequence[int], factors: Sequence[int]) -> Shape:
    """Return the shape after merging; the last voxel along an axis may stand for fewer."""
    first, second, third = (-(-length // factor) for length, factor in zip(lengths, factors, strict=True))
    return (first, second, third)


def _times(spacing_um: SpacingUm, counts: Sequence[float]) -> tuple[float, float, float]:
    return (spacing_um[0] * counts[0], spacing_um[1] * counts[1], spacing_um[2] * counts[2])
