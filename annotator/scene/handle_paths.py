"""Where a handle goes when the cursor pulls it: as near to the cursor as what it does allows. Plain numpy."""

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from annotations.geometry.frames import Vector, vector
from annotations.volumes import Ray
from annotator.scene.picking import Picture
from annotator.session.editing.handles import Handle

_STEPS = 720
_TOWARDS_LAST_PX = 0.05
"""What a degree away from the last position counts for: of a circle that is seen edge-on two places lie under
the cursor, and the handle stays on its side."""
_PARALLEL = 1e-6


class HandlePath(Protocol):
    """What a held handle can follow the cursor on."""

    def follow(self, picture: Picture, x_px: float, y_px: float) -> Vector:
        """Return the position in µm of the path that is nearest to a pixel."""


def handle_path(handle: Handle) -> HandlePath:
    """Return the path on which a handle is dragged."""
    if handle.pivot_um is not None and handle.axis is not None:
        return CirclePath(handle.position_um, handle.pivot_um, handle.axis)
    if handle.pivot_um is not None:
        return SpherePath(handle.position_um, handle.pivot_um)
    if handle.axis is not None:
        return LinePath(handle.position_um, handle.axis)
    return PlanePath(handle.position_um)


class PlanePath:
    """Anywhere in the plane through a position that is parallel to the picture."""

    def __init__(self, position_um: Vector) -> None:
        self._position = np.array(position_um)

    def follow(self, picture: Picture, x_px: float, y_px: float) -> Vector:
        """Return the position in µm that appears at a pixel."""
        ray, ahead = picture.ray(x_px, y_px), np.array(picture.camera.forward)
        # No ray of a picture runs along it.
        distance_um = ((self._position - ray.origin_um) @ ahead) / (ahead @ ray.direction)
        return vector(ray.at(float(distance_um)))


class LinePath:
    """Along a line, given by a position on it and a unit vector."""

    def __init__(self, position_um: Vector, axis: Vector) -> None:
        self._position, self._axis = np.array(position_um), np.array(axis)

    def follow(self, picture: Picture, x_px: float, y_px: float) -> Vector:
        """Return the line's position in µm that is nearest to the ray through a pixel."""
        ray = picture.ray(x_px, y_px)
        across = self._axis @ ray.direction
        if 1 - across**2 < _PARALLEL:
            # Seen from its end, a line has no position that is nearest.
            return vector(self._position)
        way = self._position - ray.origin_um
        along_um = (across * (way @ ray.direction) - way @ self._axis) / (1 - across**2)
        return vector(self._position + along_um * self._axis)


class CirclePath:
    """Round an axis, given by a position on it and a unit vector, at a position's distance from it."""

    def __init__(self, position_um: Vector, pivot_um: Vector, axis: Vector) -> None:
        offset = np.subtract(position_um, pivot_um)
        along = (offset @ np.array(axis)) * np.array(axis)
        turns = np.arange(_STEPS) * 2 * math.pi / _STEPS
        outwards = offset - along
        aside = np.cross(axis, outwards)
        self._places_um = (
            np.array(pivot_um) + along + np.outer(np.cos(turns), outwards) + np.outer(np.sin(turns), aside)
        )
        self._last = 0

    def follow(self, picture: Picture, x_px: float, y_px: float) -> Vector:
        """Return the circle's position in µm that appears nearest to a pixel."""
        places = picture.project(self._places_um)
        distances_px = np.hypot(places[:, 0] - x_px, places[:, 1] - y_px)
        steps = np.abs(np.arange(_STEPS) - self._last)
        turns_deg = np.minimum(steps, _STEPS - steps) * 360 / _STEPS
        behind_eye = np.isnan(distances_px)
        costs = np.where(behind_eye, np.inf, distances_px + _TOWARDS_LAST_PX * turns_deg)
        if not behind_eye.all():
            self._last = int(np.argmin(costs))
        return vector(self._places_um[self._last])


class SpherePath:
    """On a sphere round a pivot, at a position's distance from it."""

    def __init__(self, position_um: Vector, pivot_um: Vector) -> None:
        self._pivot = np.array(pivot_um)
        self._last = np.array(position_um)

    def follow(self, picture: Picture, x_px: float, y_px: float) -> Vector:
        """Return the sphere's position in µm that is nearest to the ray through a pixel, on the same side."""
        places = self._nearest(picture.ray(x_px, y_px))
        self._last = min(places, key=lambda place: float(np.linalg.norm(place - self._last)))
        return vector(self._last)

    def _nearest(self, ray: Ray) -> list[NDArray[np.float64]]:
        radius_um = float(np.linalg.norm(self._last - self._pivot))
        origin, direction = np.array(ray.origin_um), np.array(ray.direction)
        beside = origin + ((self._pivot - origin) @ direction) * direction - self._pivot
        distance_um = float(np.linalg.norm(beside))
        if distance_um >= radius_um:
            return [self._pivot + beside * (radius_um / distance_um)] if distance_um else [self._last]
        half_um = math.sqrt(radius_um**2 - distance_um**2)
        return [self._pivot + beside + sense * half_um * direction for sense in (-1.0, 1.0)]
