"""Where a volume shows a surface near a tool: one depth in each of some thousand columns along the light.

Everything here is in the frame whose last axis is depth: the volume's own, with its axes in cyclic order.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.errors import Cancelled
from annotations.fitting.robust_sigma import robust_sigma
from annotations.geometry.body import LinkBody, surface_from_above
from annotations.volumes import SpacingUm, Volume, validate_spacing_um

Array = NDArray[np.float64]

_COLUMNS_OVER_TOOL = 3000
"""About how many columns the tool is sampled by, where the voxels are as fine as that."""
_BANDS = 12
"""In how many parts they are read: each reads no more depths than it needs, and between them one may stop."""
_STEP_UM = 80.0
"""How much of a column is compared above and below a place: several grains of speckle, less than a shadow."""
_LEAST_STEP_VOXEL = 2
_NOISE_SIGMAS = 3.5
"""How strong a rise must be: in some hundredths of the columns speckle alone makes one, at any depth."""
_NOISE_EVERY = 7
_LEAST_BEND = 1e-6


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """The columns that were looked at, and where they show a surface.

    Attributes
    ----------
    across_um : ndarray of float64, shape (n, 2)
        Where the columns are, along the two axes across the light.
    depth_um : ndarray of float64, shape (n,)
        Depth of the surface; infinite where a column shows none.
    """

    across_um: Array
    depth_um: Array

    @property
    def found(self) -> NDArray[np.bool_]:
        """Which columns show a surface, shape (n,)."""
        return np.isfinite(self.depth_um)

    @property
    def positions_um(self) -> Array:
        """Where the surfaces are that were found, shape (k, 3)."""
        return np.column_stack([self.across_um, self.depth_um])[self.found]


@dataclass(frozen=True, eq=False)
class _Band:
    """Neighbouring columns with their intensities: in order of rows, each in order of depth."""

    across_um: Array
    top_voxel: NDArray[np.int64]
    start_voxel: int
    values: NDArray[np.float32]


def depth_last(depth_axis: int) -> tuple[int, int, int]:
    """Return a volume's axes in the cyclic order that ends with depth; a cyclic order mirrors nothing."""
    return ((depth_axis + 1) % 3, (depth_axis + 2) % 3, depth_axis)


def surface_samples(
    volume: Volume,
    spacing_um: SpacingUm,
    bodies: Iterable[LinkBody],
    reach_um: float,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> SurfaceSamples:
    """Look for a surface in columns over and around a tool, no further from it than a reach.

    A surface is where intensities rise most, over `_STEP_UM`, on the way down: dark above, bright below. It
    must stand out from the speckle of all columns. As the rise begins above the surface proper, by how much
    depends on the scanner, the brightest depth of the mean profile under all rises is taken.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels, along its own axes.
    bodies : iterable of LinkBody
        Of the tool, in the frame whose last axis is depth.
    reach_um : float
        How far from the bodies the surface may lie.
    progress, cancelled : callable
        Told the share that is done; asked as often whether to stop.

    Raises
    ------
    Cancelled
        `cancelled` said so.
    VolumeError
        The file can no longer be read.
    """
    tool = list(bodies)
    order = depth_last(volume.depth_axis)
    spacing = np.asarray(validate_spacing_um(spacing_um))[list(order)]
    margin = max(_LEAST_STEP_VOXEL, round(_STEP_UM / float(spacing[2])))
    bands = []
    for share, band in _bands(volume, order, spacing, tool, reach_um, margin):
        bands.append(band)
        progress(share)
        if cancelled():
            raise Cancelled
    if not bands:
        return SurfaceSamples(np.empty((0, 2)), np.empty(0))
    across_um = np.concatenate([band.across_um for band in bands])
    rises = [_rises(band.values, margin) for band in bands]
    noise = np.concatenate([rise[::_NOISE_EVERY].ravel() for rise in rises])
    if not noise.size:
        return SurfaceSamples(across_um, np.full(len(across_um), np.inf))
    middle = float(np.median(noise))
    least = middle + _NOISE_SIGMAS * robust_sigma(noise - middle)
    depths_voxel, profiles = [], []
    for band, rise in zip(bands, rises, strict=True):
        # A rise begins `margin` voxels into the band, and so does its index.
        place = _strongest(rise, band.top_voxel - band.start_voxel - margin, least)
        depths_voxel.append(band.start_voxel + margin + place)
        found = np.flatnonzero(np.isfinite(place))
        around = np.rint(place[found]).astype(int)[:, None] + margin + np.arange(-1, margin + 1)
        profiles.append(band.values[found[:, None], np.minimum(around, band.values.shape[1] - 1)])
    depth_voxel, profile = np.concatenate(depths_voxel), np.concatenate(profiles)
    lag_voxel = _peak(profile.mean(axis=0)) - 1 if len(profile) else 0.0
    return SurfaceSamples(across_um, (depth_voxel + lag_voxel) * spacing[2])


def _bands(
    volume: Volume,
    order: tuple[int, int, int],
    spacing: Array,
    bodies: Sequence[LinkBody],
    reach_um: float,
    margin: int,
) -> Iterator[tuple[float, _Band]]:
    """Read the columns around the bodies, some rows at a time, each with the share that is done by then."""
    shape = np.asarray(volume.shape)[list(order)]
    bounds_um = [body.bounds_um() for body in bodies]
    low_um = np.min([low_um for low_um, _ in bounds_um], axis=0) - reach_um
    high_um = np.max([high_um for _, high_um in bounds_um], axis=0) + reach_um
    low = np.clip(np.ceil(low_um / spacing), 0, shape - 1).astype(int)
    high = np.clip(np.floor(high_um / spacing), 0, shape - 1).astype(int)
    shown_um2 = sum(4 * body.half_size_um[0] * body.half_size_um[1:].max() for body in bodies)
    steps = np.maximum(np.rint(math.sqrt(shown_um2 / _COLUMNS_OVER_TOOL) / spacing[:2]), 1).astype(int)
    rows, places = (np.arange(low[axis], high[axis] + 1, steps[axis]) for axis in range(2))
    around = [replace(body, half_size_um=body.half_size_um + reach_um) for body in bodies]
    top_um = surface_from_above(around, rows * spacing[0], places * spacing[1]).depth_um
    in_reach = top_um <= high[2] * spacing[2]
    top_voxel = np.ceil(np.clip(top_um / spacing[2], 0, shape[2])).astype(int)
    for band in np.array_split(np.arange(len(rows)), _BANDS):
        wanted = np.flatnonzero(in_reach[band].any(axis=0))
        if not wanted.size:
            continue
        here = np.ix_(band, np.arange(wanted[0], wanted[-1] + 1))
        near, tops = in_reach[here], top_voxel[here]
        start = max(int(tops[near].min()) - margin, 0)
        region = {
            order[0]: slice(rows[band[0]], rows[band[-1]] + 1, steps[0]),
            order[1]: slice(places[wanted[0]], places[wanted[-1]] + 1, steps[1]),
            order[2]: slice(start, high[2] + 1),
        }
        columns = volume.load((region[0], region[1], region[2])).transpose(order)[near]
        across_um = np.argwhere(near) * steps + (rows[band[0]], places[wanted[0]])
        yield (
            (band[-1] + 1) / len(rows),
            _Band(across_um * spacing[:2], tops[near], start, _as_numbers(columns)),
        )


def _as_numbers(values: NDArray[Any]) -> NDArray[np.float32]:
    """Return intensities with the darkest there for what is no number, which must not shine."""
    with np.errstate(over="ignore"):
        numbers = values.astype(np.float32)
    finite = np.isfinite(numbers)
    numbers[~finite] = numbers[finite].min() if finite.any() else 0
    return numbers


def _rises(values: NDArray[np.float32], margin: int) -> NDArray[np.float32]:
    """Return how much brighter the next voxels are than those before, for every place between enough of them.

    The first is between voxels ``margin - 1`` and ``margin``.
    """
    sums = np.pad(np.cumsum(values, axis=1, dtype=np.float64), ((0, 0), (1, 0)))
    means = (sums[:, margin:] - sums[:, :-margin]) / margin
    return (means[:, margin:] - means[:, :-margin]).astype(np.float32)


def _strongest(rises: NDArray[np.float32], first: NDArray[np.int64], least: float) -> Array:
    """Return which rise from a first one on is the strongest in each column, with its fraction.

    Infinite where it is not more than the least that counts.
    """
    count = rises.shape[1]
    if not count:
        return np.full(len(rises), np.inf)
    tried = np.where(np.arange(count) >= first[:, None], rises, -np.inf)
    place = tried.argmax(axis=1)
    column = np.arange(len(rises))
    before, middle, after = (
        rises[column, np.clip(place + shift, 0, count - 1)].astype(np.float64) for shift in (-1, 0, 1)
    )
    return np.where(tried[column, place] > least, place + _vertex(before, middle, after), np.inf)


def _peak(values: NDArray[np.float32]) -> float:
    """Return where values are highest, with its fraction."""
    place = int(values.argmax())
    if not 0 < place < len(values) - 1:
        return float(place)
    return place + float(_vertex(*values[place - 1 : place + 2].astype(np.float64)))


def _vertex(before: ArrayLike, middle: ArrayLike, after: ArrayLike) -> Array:
    """Return where parabolas through values at −1, 0, 1 are highest, at most half a step from 0."""
    bend = np.minimum(np.subtract(before, middle) + np.subtract(after, middle), -_LEAST_BEND)
    return np.asarray(np.clip(np.subtract(before, after) / (2 * bend), -0.5, 0.5))
