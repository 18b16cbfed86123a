"""From about the right place to the nearest bright spot or edge, with a fraction of a voxel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.volumes.rays import PositionUm
from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.volume import Volume

_SMOOTHING_VOXEL = 1.0
_MARGIN_VOXEL = 5
_EQUAL = 1e-6


@dataclass(frozen=True, eq=False)
class _Neighbourhood:
    """A smoothed block around a position: what is searched, and which of its voxels are near enough."""

    smoothed: NDArray[np.float64]
    start_voxel: NDArray[np.float64]
    distance: NDArray[np.float64]


def snap_to_maximum(
    volume: Volume, spacing_um: SpacingUm, position_um: ArrayLike, radius_um: float
) -> PositionUm:
    """Return the brightest place within a radius of a position.

    The intensities are smoothed by a Gaussian of one voxel, so that a single speckle does not win, and the
    peak is placed between voxels by a parabola along each axis.

    Parameters
    ----------
    volume : Volume
    spacing_um : tuple of float
        Of the volume's voxels.
    position_um : array-like of float, shape (3,)
        In the volume's frame.
    radius_um : float
        Where it is less than the spacing, the neighbouring voxels along that axis are searched all the same.

    Returns
    -------
    tuple of float
        The position itself where there is nothing to choose: constant intensities, or no voxel near it.

    Raises
    ------
    VolumeError
        The file can no longer be read.
    """
    spacing = np.asarray(validate_spacing_um(spacing_um))
    position = np.asarray(position_um, dtype=np.float64)
    near = _neighbourhood(volume, spacing, position, radius_um)
    place = None if near is None else _peak(near.smoothed, near.distance)
    if near is None or place is None:
        return _tuple(position)
    offsets = [_vertex(near.smoothed, place, axis) for axis in range(3)]
    return _tuple((near.start_voxel + place + offsets) * spacing)


def snap_to_edge(
    volume: Volume, spacing_um: SpacingUm, position_um: ArrayLike, radius_um: float
) -> PositionUm:
    """Return the place within a radius of a position at which the intensity changes most steeply.

    Steepness is the length of the gradient, per µm, of the intensities smoothed as in `snap_to_maximum`; the
    edge is placed between voxels by a parabola along the gradient.

    Parameters and errors are those of `snap_to_maximum`, and so is the result where there is no edge.
    """
    spacing = np.asarray(validate_spacing_um(spacing_um))
    position = np.asarray(position_um, dtype=np.float64)
    near = _neighbourhood(volume, spacing, position, radius_um)
    if near is None:
        return _tuple(position)
    # Along an axis with a single plane nothing can change.
    gradient = np.stack(
        [
            np.gradient(near.smoothed, spacing[axis], axis=axis)
            if near.smoothed.shape[axis] > 1
            else np.zeros_like(near.smoothed)
            for axis in range(3)
        ]
    )
    steepness = np.linalg.norm(gradient, axis=0)
    place = _peak(steepness, near.distance)
    if place is None:
        return _tuple(position)
    # One step along the gradient crosses one voxel on the axis that it follows most.
    direction = gradient[(slice(None), *place)] / spacing
    direction /= np.abs(direction).max()
    from scipy import ndimage

    line = np.asarray(place, dtype=np.float64)[:, None] + direction[:, None] * np.array([-1.0, 0.0, 1.0])
    before, middle, after = ndimage.map_coordinates(steepness, line, order=1, mode="nearest")
    offset = direction * _parabola_vertex(before, middle, after)
    return _tuple((near.start_voxel + place + offset) * spacing)


def _neighbourhood(
    volume: Volume, spacing: NDArray[np.float64], position: NDArray[np.float64], radius_um: float
) -> _Neighbourhood | None:
    centre = position / spacing
    from scipy import ndimage  # late: it takes 0.4 s, and few sessions snap

    reach = np.maximum(radius_um / spacing, 1.0)
    low = np.maximum(np.floor(centre - reach).astype(int) - _MARGIN_VOXEL, 0)
    high = np.minimum(np.ceil(centre + reach).astype(int) + _MARGIN_VOXEL + 1, volume.shape)
    if np.any(low >= high):
        return None
    values = volume.load((slice(low[0], high[0]), slice(low[1], high[1]), slice(low[2], high[2])))
    numbers = np.isfinite(values)
    # The darkest there, not zero: intensities in decibels lie below it, and what is no number must not shine.
    finite = np.where(numbers, values, values[numbers].min() if numbers.any() else 0).astype(np.float64)
    offsets = [(np.arange(low[axis], high[axis]) - centre[axis]) / reach[axis] for axis in range(3)]
    return _Neighbourhood(
        smoothed=ndimage.gaussian_filter(finite, _SMOOTHING_VOXEL, mode="nearest"),
        start_voxel=low.astype(np.float64),
        distance=np.sqrt(
            offsets[0][:, None, None] ** 2 + offsets[1][None, :, None] ** 2 + offsets[2][None, None, :] ** 2
        ),
    )


def _peak(values: NDArray[np.float64], distance: NDArray[np.float64]) -> tuple[int, int, int] | None:
    """Return the index of the highest value at a distance of at most 1, the nearest of several such."""
    inside = distance <= 1.0
    if not inside.any():
        return None
    highest, lowest = float(values[inside].max()), float(values[inside].min())
    tolerance = _EQUAL * max(abs(highest), abs(lowest))
    if highest - lowest <= tolerance:
        return None
    candidates = np.where(inside & (values >= highest - tolerance), distance, np.inf)
    first, second, third = np.unravel_index(int(np.argmin(candidates)), values.shape)
    return (int(first), int(second), int(third))


def _vertex(values: NDArray[np.float64], place: tuple[int, int, int], axis: int) -> float:
    if not 0 < place[axis] < values.shape[axis] - 1:
        return 0.0
    across, down = (place[other] for other in range(3) if other != axis)
    before, middle, after = np.moveaxis(values, axis, 0)[place[axis] - 1 : place[axis] + 2, across, down]
    return _parabola_vertex(float(before), float(middle), float(after))


def _parabola_vertex(before: float, middle: float, after: float) -> float:
    """Return where the parabola through values at −1, 0, 1 is highest, at most half a step from 0."""
    bend = before - 2.0 * middle + after
    if bend >= 0.0:
        return 0.0
    return float(np.clip((before - after) / (2.0 * bend), -0.5, 0.5))


def _tuple(values: NDArray[np.float64]) -> PositionUm:
    return (float(values[0]), float(values[1]), float(values[2]))
