"""The part of space in which a network takes a keypoint to be: fine enough to be drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, vector
from annotations.prediction.volume_heatmaps import VolumeHeatmaps

HALF, MOST = 0.5, 0.95
"""Shares of the probability that the two surfaces of a cloud hold."""

_LEAST_PRESENCE = 0.05
_LEAST_OF_PEAK = 1e-3
_SMOOTH_UM = 350.0
_STEP_UM = 270.0
_MOST_VOXELS = 100_000


@dataclass(frozen=True, eq=False)
class HeatmapCloud:
    """Where a keypoint is likely to be, in the volume's frame.

    Attributes
    ----------
    likelihood : ndarray of float32, shape (n0, n1, n2)
        Proportional to the probability; 0 at the faces.
    origin_um : (float, float, float)
        Centre of voxel (0, 0, 0).
    spacing_um : (float, float, float)
        Between voxel centres.
    half, most : float
        The likelihoods above which lie 50 % and 95 % of the probability.
    """

    likelihood: NDArray[np.float32]
    origin_um: Vector
    spacing_um: Vector
    half: float
    most: float


# Of the volume that is open and of the last one: a megabyte each at most.
@lru_cache(maxsize=16)
def heatmap_cloud(heatmaps: VolumeHeatmaps, name: str) -> HeatmapCloud | None:
    """Return the cloud of a keypoint; None where the network does not see it.

    A network's voxels are larger than its certainty: between them it is the logarithm that is interpolated,
    by cubic splines, under which a Gaussian stays one. What a network has doubled to reach the size of its
    heatmaps is smoothed by a Gaussian of 0.35 mm, so that no steps are seen that mean nothing.
    """
    if name not in heatmaps.names:
        return None
    coarse = heatmaps.probability[heatmaps.names.index(name)]
    if coarse.sum() < _LEAST_PRESENCE:
        return None
    from scipy.ndimage import gaussian_filter, zoom  # late: most sessions look at no heatmap

    least = _LEAST_OF_PEAK * float(coarse.max())
    block = _around(coarse > least)
    first = [part.start for part in block]
    logarithms = np.log(np.maximum(coarse[block], least))
    logarithms = gaussian_filter(logarithms, _SMOOTH_UM / np.asarray(heatmaps.spacing_um), mode="nearest")
    steps = _steps(logarithms.shape, heatmaps.spacing_um)
    sizes = [(size - 1) * step + 1 for size, step in zip(logarithms.shape, steps, strict=True)]
    factors = [fine / size for fine, size in zip(sizes, logarithms.shape, strict=True)]
    fine = np.exp(zoom(logarithms, factors, order=3, mode="nearest")).astype(np.float32)
    fine[fine < 2 * least] = 0
    # Surfaces are closed, at the faces of the grid too.
    likelihood = np.pad(fine, 1)
    spacing_um = np.asarray(heatmaps.spacing_um) / steps
    origin_um = np.asarray(heatmaps.origin_um) + np.asarray(first) * heatmaps.spacing_um - spacing_um
    half, most = _levels(likelihood)
    return HeatmapCloud(likelihood, vector(origin_um), vector(spacing_um), half, most)


def _around(wanted: NDArray[np.bool_]) -> tuple[slice, slice, slice]:
    """Return the smallest block around what is wanted, with a voxel more on each side where there is one."""
    parts = []
    for axis in range(3):
        (there,) = np.nonzero(wanted.any(axis=tuple(other for other in range(3) if other != axis)))
        parts.append(slice(max(int(there[0]) - 1, 0), min(int(there[-1]) + 2, wanted.shape[axis])))
    return (parts[0], parts[1], parts[2])


def _steps(shape: Sequence[int], spacing_um: Vector) -> list[int]:
    """Return into how many each voxel is divided along each axis; into fewer where the block is large."""
    step_um = _STEP_UM
    while True:
        steps = [max(1, round(spacing / step_um)) for spacing in spacing_um]
        if np.prod([size * step for size, step in zip(shape, steps, strict=True)]) <= _MOST_VOXELS:
            return steps
        if max(steps) == 1:
            return steps
        step_um *= 1.3


def _levels(likelihood: NDArray[np.float32]) -> tuple[float, float]:
    """Return the values above which lie the shares of the whole that `HALF` and `MOST` name."""
    falling = np.sort(likelihood, axis=None)[::-1]
    held = np.cumsum(falling, dtype=np.float64)
    half, most = (falling[np.searchsorted(held, share * held[-1])] for share in (HALF, MOST))
    return float(half), float(most)
