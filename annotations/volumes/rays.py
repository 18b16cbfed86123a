"""Rays through a volume: where they meet its first surface, its brightest sample, or one another.

Pure NumPy, in µm, so that picking can be tested without a window.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.volumes.volume import Array

PositionUm = tuple[float, float, float]

_STEP_VOXEL = 0.5
_REFINED_PARTS = 32
_PARALLEL = 1e-12
_LARGEST = 1e300


@dataclass(frozen=True)
class Ray:
    """A half-line in the volume's frame.

    Attributes
    ----------
    origin_um : tuple of float
    direction : tuple of float
        Made a unit vector.

    Raises
    ------
    ValueError
        The direction is zero, or a number is not finite.
    """

    origin_um: PositionUm
    direction: PositionUm

    def __post_init__(self) -> None:
        origin = np.asarray(self.origin_um, dtype=np.float64)
        direction = np.asarray(self.direction, dtype=np.float64)
        # Scaled before it is measured, so that no square of a component is lost or overflows.
        largest = float(np.abs(direction).max())
        if not (np.isfinite(origin).all() and math.isfinite(largest) and largest > 0):
            raise ValueError(f"no ray starts at {self.origin_um} and runs along {self.direction}")
        direction = direction / largest
        object.__setattr__(self, "origin_um", _position(origin))
        object.__setattr__(self, "direction", _position(direction / np.linalg.norm(direction)))

    @classmethod
    def through(cls, from_um: ArrayLike, to_um: ArrayLike) -> "Ray":
        """Return the ray that starts at one position and runs through another."""
        start = np.asarray(from_um, dtype=np.float64)
        return cls(_position(start), _position(np.asarray(to_um, dtype=np.float64) - start))

    def at(self, distance_um: float) -> PositionUm:
        """Return the position at a distance from the ray's origin."""
        return _position(np.asarray(self.origin_um) + distance_um * np.asarray(self.direction))


@dataclass(frozen=True)
class ClosestApproach:
    """Where two rays, taken as whole lines, come nearest to each other.

    Attributes
    ----------
    position_um : tuple of float
        Half-way between the two nearest points.
    gap_um : float
        The distance of those two.
    angle_deg : float
        Between the lines, from 0 to 90; the smaller, the less sure the position along them.
    """

    position_um: PositionUm
    gap_um: float
    angle_deg: float


def clip_to_box(ray: Ray, low_um: ArrayLike, high_um: ArrayLike) -> tuple[float, float] | None:
    """Return the distances along a ray at which it enters and leaves a box, or None where it misses.

    Parameters
    ----------
    ray : Ray
    low_um, high_um : array-like of float, shape (3,)
        Opposite corners of the box, which includes its faces.

    Returns
    -------
    tuple of float or None
        Not negative: a ray that starts inside enters at 0.
    """
    enter, leave = 0.0, math.inf
    for origin, direction, low, high in zip(
        ray.origin_um, ray.direction, np.asarray(low_um), np.asarray(high_um), strict=True
    ):
        if abs(direction) < _PARALLEL:
            if not low <= origin <= high:
                return None
            continue
        near, far = sorted(((float(low) - origin) / direction, (float(high) - origin) / direction))
        enter, leave = max(enter, near), min(leave, far)
    return (enter, leave) if enter <= leave else None


def intensities_along(
    data: Array, spacing_um: Sequence[float], origin_um: Sequence[float], ray: Ray
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return the intensities that a ray passes, or None where it misses.

    Intensities between voxels are trilinear, sampled every half voxel of the axis on which the ray crosses
    voxels fastest.

    Parameters
    ----------
    data : numpy.ndarray, shape (x, y, z)
        Real.
    spacing_um, origin_um : sequence of float
        Of the data: see `annotations.volumes.levels.Level`.
    ray : Ray

    Returns
    -------
    distances_um : numpy.ndarray of float64, shape (n,)
        From the ray's origin, ascending and evenly spaced.
    intensities : numpy.ndarray of float64, shape (n,)
        NaN where a voxel with a share in the sample is.
    """
    span = _span(data, spacing_um, origin_um, ray)
    if span is None:
        return None
    distances = _steps(ray, spacing_um, *span)
    return distances, _sampled(data, spacing_um, origin_um, ray, distances)


def first_surface(
    data: Array, spacing_um: Sequence[float], origin_um: Sequence[float], ray: Ray, threshold: float
) -> PositionUm | None:
    """Return where a ray first meets an intensity of at least a threshold, or None where it never does.

    Intensities are sampled as by `intensities_along` and, where the threshold is first crossed, finely enough
    to place the crossing to a thousandth of a voxel.

    Parameters
    ----------
    data : numpy.ndarray, shape (x, y, z)
        Real; NaN is never a surface.
    spacing_um, origin_um : sequence of float
        Of the data: see `annotations.volumes.levels.Level`.
    ray : Ray
    threshold : float
    """
    sampled = intensities_along(data, spacing_um, origin_um, ray)
    if sampled is None:
        return None
    distances, values = sampled
    above = np.flatnonzero(values >= threshold)
    if above.size == 0:
        return None
    first = int(above[0])
    if first == 0:
        return ray.at(float(distances[0]))
    before, after = float(distances[first - 1]), float(distances[first])
    for _ in range(2):
        distances = np.linspace(before, after, _REFINED_PARTS + 1)
        values = _sampled(data, spacing_um, origin_um, ray, distances)
        first = max(1, int(np.argmax(values >= threshold)))
        before, after = float(distances[first - 1]), float(distances[first])
    return ray.at((before + after) / 2.0)


def brightest_sample(
    data: Array, spacing_um: Sequence[float], origin_um: Sequence[float], ray: Ray
) -> PositionUm | None:
    """Return where along a ray the intensity is highest, or None where the ray misses or meets only NaN.

    Sampled as by `intensities_along`. Of several samples that are equally bright without a gap, as in a
    saturated reflection, it is the middle; of several such runs, that of the first.

    Parameters
    ----------
    data : numpy.ndarray, shape (x, y, z)
    spacing_um, origin_um : sequence of float
    ray : Ray
    """
    sampled = intensities_along(data, spacing_um, origin_um, ray)
    if sampled is None:
        return None
    distances, values = sampled
    if np.isnan(values).all():
        return None
    brightest = values == np.nanmax(values)
    first = int(np.argmax(brightest))
    run = int(np.argmin(brightest[first:])) or len(brightest) - first
    return ray.at(float(distances[first] + distances[first + run - 1]) / 2.0)


def closest_approach(ray_a: Ray, ray_b: Ray) -> ClosestApproach:
    """Return where two rays, taken as whole lines, come nearest to each other.

    Of parallel lines the position is that beside the first ray's origin.
    """
    origin_a, along_a = np.asarray(ray_a.origin_um), np.asarray(ray_a.direction)
    origin_b, along_b = np.asarray(ray_b.origin_um), np.asarray(ray_b.direction)
    cross = np.cross(along_a, along_b)
    squared = float(cross @ cross)
    between = origin_b - origin_a
    if squared < _PARALLEL**2:
        on_a = origin_a
        on_b = origin_b - (between @ along_b) * along_b
    else:
        on_a = origin_a + float(np.cross(between, along_b) @ cross) / squared * along_a
        on_b = origin_b + float(np.cross(between, along_a) @ cross) / squared * along_b
    return ClosestApproach(
        position_um=_position((on_a + on_b) / 2.0),
        gap_um=float(np.linalg.norm(on_b - on_a)),
        angle_deg=math.degrees(math.atan2(math.sqrt(squared), abs(float(along_a @ along_b)))),
    )


def _span(
    data: Array, spacing_um: Sequence[float], origin_um: Sequence[float], ray: Ray
) -> tuple[float, float] | None:
    """Clip a ray to the box that the voxel centres span, which is what is drawn of a volume.

    An axis with a single voxel spans that voxel.
    """
    counts = np.asarray(data.shape)
    spacing, low = np.asarray(spacing_um, dtype=np.float64), np.asarray(origin_um, dtype=np.float64)
    margin = np.where(counts == 1, spacing / 2.0, 0.0)
    return clip_to_box(ray, low - margin, low + (counts - 1) * spacing + margin)


def _steps(ray: Ray, spacing_um: Sequence[float], enter: float, leave: float) -> NDArray[np.float64]:
    """Return distances half a voxel apart, along the axis on which the ray crosses voxels fastest."""
    voxels_per_um = np.max(np.abs(np.asarray(ray.direction)) / np.asarray(spacing_um, dtype=np.float64))
    count = math.ceil((leave - enter) * float(voxels_per_um) / _STEP_VOXEL) + 1
    return np.linspace(enter, leave, count)


def _sampled(
    data: Array,
    spacing_um: Sequence[float],
    origin_um: Sequence[float],
    ray: Ray,
    distances_um: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return trilinear intensities at distances along a ray, the outermost voxels reaching on outwards."""
    positions = np.asarray(ray.origin_um) + distances_um[:, None] * np.asarray(ray.direction)
    index = (positions - np.asarray(origin_um)) / np.asarray(spacing_um)
    last = np.asarray(data.shape) - 1
    index = np.clip(index, 0, last)
    low = np.minimum(np.floor(index).astype(np.intp), np.maximum(last - 1, 0))
    high = np.minimum(low + 1, last)
    weight = index - low
    values = np.zeros(len(index))
    for corner in np.ndindex(2, 2, 2):
        x, y, z = (np.where(corner[axis], high[:, axis], low[:, axis]) for axis in range(3))
        share = np.prod(np.where(corner, weight, 1.0 - weight), axis=1)
        # A voxel without a share must not count, not even as NaN; an infinite one stays comparable.
        voxels = np.clip(data[x, y, z].astype(np.float64), -_LARGEST, _LARGEST)
        values += np.where(share > 0, share * voxels, 0.0)
    return values


def _position(values: NDArray[np.float64]) -> PositionUm:
    return (float(values[0]), float(values[1]), float(values[2]))
