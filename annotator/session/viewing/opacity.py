"""How opaque an intensity is in the scene, and what a ray therefore meets: what is seen is what is picked."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from annotations.geometry.frames import Vector, vector
from annotations.volumes import Level, Ray, first_surface, intensities_along
from annotator.session.viewing.view import View

FAINT = 0.02
"""Opacity, for each voxel that light passes, of an intensity just above the threshold: speckle is a haze."""

OPAQUE = 0.6
"""The same for the brightest intensity of the window, and all above it."""

_LEAST_SEEN = 0.05


def opacity(intensities: ArrayLike, view: View) -> NDArray[np.float64]:
    """Return the opacity, from 0 to 1 for each voxel that light passes, of intensities in volume rendering.

    Nothing below the threshold, nor what is not a number; from the threshold to the window's end it rises.
    """
    values = np.asarray(intensities, dtype=np.float64)
    threshold = view.opacity_threshold
    brightest = max(view.window[1], np.nextafter(threshold, np.inf))
    ramp = np.interp(values, (threshold, brightest), (FAINT, OPAQUE))
    return np.where(values >= threshold, ramp, 0.0)


def seen_surface(level: Level, ray: Ray, view: View) -> Vector | None:
    """Return the position in µm at which a ray meets what is seen along it, or None where nothing is.

    A ray passes through haze, single voxels of speckle above the threshold, before it meets the instrument.
    Light is followed along the ray: where half of all that is seen has been passed, lies the body that is
    looked at, and its surface is where the threshold was crossed before.
    """
    sampled = intensities_along(level.data, level.spacing_um, level.origin_um, ray)
    if sampled is None:
        return None
    distances_um, values = sampled
    step_um = float(distances_um[-1] - distances_um[0]) / max(len(distances_um) - 1, 1)
    passing = (1.0 - opacity(values, view)) ** (step_um / float(np.mean(level.spacing_um)))
    seen = 1.0 - np.cumprod(passing)
    if seen[-1] < _LEAST_SEEN:
        return None
    middle = int(np.argmax(seen >= seen[-1] / 2))
    clear = np.flatnonzero(~(values[:middle] >= view.opacity_threshold))
    before_um = float(distances_um[clear[-1]] if clear.size else distances_um[0])
    towards = Ray(vector(ray.at(before_um)), ray.direction)
    found = first_surface(level.data, level.spacing_um, level.origin_um, towards, view.opacity_threshold)
    return None if found is None else vector(found)
