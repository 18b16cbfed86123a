"""Between the picture's pixels and micrometres, in plain numpy: rays under the cursor, keypoints on it.

Pixels are Qt's: counted from the picture's upper left corner, the middle of the first pixel at (0.5, 0.5).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.frames import Vector, vector
from annotations.volumes import Ray
from annotator.scene.camera import Camera

SPHERE_PX = 14.0
"""Diameter of a keypoint's sphere, at every zoom: as it is drawn, and as the cursor meets it."""

_ALIKE_PX = 3.0
"""What appears nearer together than this is one place for a hand: what lies on top counts."""


@dataclass(frozen=True)
class Picture:
    """What the camera's picture is drawn into.

    Attributes
    ----------
    camera : Camera
    width_px, height_px : float
        Size in Qt's pixels.
    ratio : float
        How many of the screen's pixels make one of Qt's.
    """

    camera: Camera
    width_px: float
    height_px: float
    ratio: float = 1.0

    @property
    def um_per_px(self) -> float:
        """Size of a pixel at the focal point; everywhere, in parallel projection."""
        return self.camera.height_um / self.height_px

    def from_middle_um(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Return how far a pixel is right of and below the middle, in µm at the focal point."""
        return (x_px - self.width_px / 2) * self.um_per_px, (y_px - self.height_px / 2) * self.um_per_px

    def ray(self, x_px: float, y_px: float) -> Ray:
        """Return the ray from the eye through a pixel, into the volume."""
        camera = self.camera
        right_um, down_um = self.from_middle_um(x_px, y_px)
        offset = right_um * np.asarray(camera.right) - down_um * np.asarray(camera.up)
        eye, ahead = np.asarray(camera.eye_um), np.asarray(camera.forward)
        if camera.parallel:
            return Ray(origin_um=vector(eye + offset), direction=camera.forward)
        direction = camera.distance_um * ahead + offset
        return Ray(origin_um=vector(eye), direction=vector(direction / np.linalg.norm(direction)))

    def project(self, positions_um: ArrayLike) -> NDArray[np.float64]:
        """Return where positions appear: x and y in pixels, and the depth behind the focal point in µm.

        Parameters
        ----------
        positions_um : array_like of float, shape (n, 3)

        Returns
        -------
        ndarray of float, shape (n, 3)
            NaN for x and y of a position behind the eye.
        """
        camera = self.camera
        offsets = np.asarray(positions_um, dtype=float).reshape(-1, 3) - camera.focal_um
        right, down = offsets @ camera.right, -(offsets @ camera.up)
        depth = offsets @ camera.forward
        if not camera.parallel:
            before_eye = camera.distance_um + depth
            shrunk = camera.distance_um / np.where(before_eye > 0, before_eye, np.nan)
            right, down = right * shrunk, down * shrunk
        return np.stack(
            (
                self.width_px / 2 + right / self.um_per_px,
                self.height_px / 2 + down / self.um_per_px,
                depth,
            ),
            axis=1,
        )

    def nearest(
        self, positions_um: Mapping[str, Vector], x_px: float, y_px: float, radius_px: float
    ) -> str | None:
        """Return the name of the position nearest to a pixel, or None if none is within the radius."""
        if not positions_um:
            return None
        names = list(positions_um)
        places = self.project([positions_um[name] for name in names])
        distances_px = _distances_px(places, x_px, y_px)
        best = int(np.argmin(distances_px))
        return names[best] if distances_px[best] <= radius_px else None

    def topmost(
        self, positions_um: Mapping[str, Vector], x_px: float, y_px: float, radius_px: float
    ) -> str | None:
        """Return the name of the position nearest to a pixel, of those that are about as near the topmost."""
        if not positions_um:
            return None
        names = list(positions_um)
        places = self.project([positions_um[name] for name in names])
        distances_px = _distances_px(places, x_px, y_px)
        nearest_px = distances_px.min()
        alike = distances_px <= nearest_px + _ALIKE_PX
        return (
            names[int(np.argmin(np.where(alike, places[:, 2], np.inf)))] if nearest_px <= radius_px else None
        )


def _distances_px(places: NDArray[np.float64], x_px: float, y_px: float) -> NDArray[np.float64]:
    """Return how far projected positions are from a pixel; infinitely far behind the eye."""
    distances_px = np.hypot(places[:, 0] - x_px, places[:, 1] - y_px)
    return np.where(np.isnan(distances_px), np.inf, distances_px)
