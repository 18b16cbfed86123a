"""What a network would see of a scene's volume, made without the volume: fast enough to train on."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from annotations.geometry.body import Surface
from annotations.synthesis.grey_noise import GREATEST_GREY, Moments
from annotations.synthesis.grid import Grid
from annotations.synthesis.scanner import Depths, Scanner
from annotations.synthesis.scene import Scene
from annotations.volumes.sampling import Sampling, depth_cells, sampled_voxels

_NOTHING = Surface(np.array([np.inf]), np.zeros(1))
_GLOW_SIGMAS = 6.0
"""How far above a surface, in its axial spread, its power is 78 dB less and nothing beside the noise."""


def network_volume(scene: Scene, sampling: Sampling) -> NDArray[np.float32]:
    """Return what `sample_volume` would give of a scene's volume, with noise of its own.

    Where depth is averaged, a sample is drawn from the distribution of the mean of its voxels: their mean and
    variance, cut to whole grey values from 0 to 255 as they are, and the skewness that speckle leaves
    (R. A. Fisher & E. A. Cornish, *The percentile points of distributions having known cumulants*,
    Technometrics 2, 1960). Away from a surface its middle voxel stands for all of them.

    Parameters
    ----------
    scene : Scene
        Its grid is that of the volume, which is never made.
    sampling : Sampling

    Returns
    -------
    ndarray of float32, shape ``sampling.shape``
        Grey values; samples beyond the volume's end have the value that is scaled to 0.

    Raises
    ------
    ValueError
        The sampling is for volumes whose light travels along another axis than 2.
    """
    if sampling.depth_axis != 2:
        raise ValueError(f"light travels along axis 2, not {sampling.depth_axis}")
    grid, scanner = scene.grid, scene.scanner
    x_um, y_um = (
        grid.axis_um(axis)[sampled_voxels(sampling, grid.spacing_um, grid.shape, axis)] for axis in (0, 1)
    )
    cells = depth_cells(sampling, grid.spacing_um, grid.shape)
    found = scene.surface_at(x_um, y_um)
    surface = Surface(found.depth_um.ravel(), found.facing.ravel())
    shape = (len(surface.depth_um), len(cells) - 1)
    bits = scene.sampled_bits(shape)
    if sampling.is_averaged:
        grey = _means(scanner, surface, grid, cells, bits)
    else:
        single = scanner.depths(grid.axis_um(2)[cells[:-1]])
        grey = scanner.image(surface, grid, bits, single).astype(np.float32)
    samples = np.full(sampling.shape, sampling.value_range[0], dtype=np.float32)
    samples[: len(x_um), : len(y_um), : shape[1]] = grey.reshape(len(x_um), len(y_um), shape[1])
    return samples


def _means(
    scanner: Scanner, surface: Surface, grid: Grid, cells: NDArray[np.intp], bits: NDArray[np.uint16]
) -> NDArray[np.float32]:
    """Return drawn means of the voxels of each cell, shape (n, cells), for columns of shape (n,)."""
    noise = scanner.noise.moments()
    # As in a sampled volume, an empty cell shows the voxel where the next one begins.
    counts = np.maximum(np.diff(cells), 1)
    depths = scanner.depths(grid.axis_um(2)[: cells[-1]])
    middles = _middles(depths, cells[:-1], counts)
    normal = _normal_quantiles().take(bits, mode="clip")
    struck = np.flatnonzero(np.isfinite(surface.depth_um))
    normal_below = normal[struck]
    free = scanner.mean_grey(_NOTHING, grid, middles)
    grey = _drawn(noise.of(free), counts, normal)
    seen = Surface(surface.depth_um[struck], surface.facing[struck])
    cell = np.searchsorted(cells, seen.depth_um / grid.spacing_um[2], side="right")[:, None] - 1
    # Above the surface all is as in a free column, far below it there is nothing left but noise.
    level = np.where(np.arange(len(counts)) < cell, free, np.float32(scanner.noise_grey))
    cell_um = counts[0] * grid.spacing_um[2]
    lit = _span(cell, len(counts), 0, math.ceil(scanner.reach_um / cell_um))
    level[lit] = scanner.mean_grey(seen, grid, middles[lit[1]])
    moments = noise.of(level)
    # Around the surface each voxel counts, as far above it as it glows.
    glow = math.ceil(_GLOW_SIGMAS * max(scanner.axial_sigma_um, grid.spacing_um[2] / 2) / cell_um)
    near = _span(cell, len(counts), -glow, 1)
    voxels = np.minimum(cells[near[1]][..., None] + np.arange(counts.max()), cells[-1] - 1)
    close = depths[voxels.reshape(len(struck), math.prod(voxels.shape[1:]))]
    around = noise.of(scanner.mean_grey(seen, grid, close))
    moments.mean[near] = around.mean.reshape(voxels.shape).mean(axis=2)
    moments.variance[near] = around.variance.reshape(voxels.shape).mean(axis=2)
    grey[struck] = _drawn(moments, counts, normal_below)
    return grey


def _span(
    cell: NDArray[np.intp], count: int, first: int, last: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return where the cells from `first` to `last` around one of each row are, shape (n, 1), as an index.

    At the ends of the rows, of so many cells, they are others, still as many and next to each other.
    """
    width = min(last - first + 1, count)
    columns = np.clip(cell + first, 0, count - width) + np.arange(width)
    return np.arange(len(cell))[:, None], columns


def _middles(depths: Depths, begins: NDArray[np.intp], counts: NDArray[np.intp]) -> Depths:
    """Return the middle of each cell, with the mean in decibels of what is left of the light in it."""
    z_um = np.add.reduceat(depths.z_um, begins) / counts
    through = np.exp(np.add.reduceat(np.log(depths.through), begins) / counts)
    return Depths(z_um.astype(np.float32), through.astype(np.float32))


def _drawn(moments: Moments, counts: NDArray[np.intp], normal: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return means of so many values of these moments, from standard normal variates, shape (n, cells)."""
    number = counts.astype(np.float32)
    sigma = np.sqrt(moments.variance / number)
    bend = sigma * moments.skewness / (6 * np.sqrt(number))
    grey = np.multiply(normal, bend, dtype=np.float32)
    grey += sigma
    grey *= normal
    grey += moments.mean - bend
    return np.asarray(np.clip(grey, 0, GREATEST_GREY, out=grey))


@lru_cache(maxsize=1)
def _normal_quantiles() -> NDArray[np.float32]:
    """Return the quantiles of the standard normal distribution, one for each value of 16 random bits."""
    return np.asarray(ndtri((np.arange(65536) + 0.5) / 65536), dtype=np.float32)
