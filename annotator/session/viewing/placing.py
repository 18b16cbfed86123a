"""Where a click in the scene puts a keypoint: one ray finds a surface, two rays settle a depth."""

from dataclasses import dataclass, replace

import numpy as np

from annotations.geometry.frames import Vector, um_to_voxel, vector, voxel_to_um
from annotations.volumes import Level, Ray, brightest_sample, closest_approach, intensities_along
from annotator.session.viewing.opacity import seen_surface
from annotator.session.viewing.view import View

# Rays that are nearly parallel cross anywhere: below this angle the second one only proposes anew.
SMALLEST_ANGLE_DEG = 10.0
# Two rays that pass each other farther apart than this were not aimed at one point.
WIDEST_GAP_UM = 500.0
# Speckle differs from one voxel to the next: a Gaussian this wide averages some forty of them, and widens
# a surface by less than a hand trembles. Of the middle spacing, so that one coarse axis does not count.
_SMOOTHING_VOXEL = 1.0
# A Gaussian is nothing beyond this many of its standard deviations.
_SMOOTHING_REACH = 4.0


@dataclass(frozen=True)
class Settled:
    """The outcome of a second ray: a position, or the reason why there is none."""

    position_um: Vector | None
    reason: str = ""


def visible_part(level: Level, cropping_um: tuple[Vector, Vector] | None) -> Level:
    """Return the part of a level that the scene shows: a click must not meet what is cropped away."""
    if cropping_um is None:
        return level
    low, high = (
        um_to_voxel(np.subtract(corner, level.origin_um), level.spacing_um) for corner in cropping_um
    )
    first = np.clip(np.ceil(low), 0, np.array(level.data.shape) - 1).astype(int)
    last = np.clip(np.floor(high), first, np.array(level.data.shape) - 1).astype(int)
    part = tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
    origin_um = vector(np.add(level.origin_um, voxel_to_um(first, level.spacing_um)))
    return replace(level, data=level.data[part], origin_um=origin_um)


def depth_along_ray(level: Level, ray: Ray, view: View) -> Vector | None:
    """Return the position in µm that a click means.

    The brightest sample in a maximum intensity projection, else the surface of the body that is seen there,
    past the haze of speckle before it. None where the ray misses the volume or nothing is seen along it.
    """
    shown = visible_part(level, view.cropping_um)
    if view.rendering == "mip":
        found = brightest_sample(shown.data, shown.spacing_um, shown.origin_um, ray)
        return None if found is None else vector(found)
    return seen_surface(shown, ray, view)


def refining_margin_um(spacing_um: Vector) -> float:
    """Return how far around the searched part of a ray `depth_near` looks, to average speckle."""
    return _SMOOTHING_REACH * _smoothing_um(spacing_um)


def depth_near(block: Level, ray: Ray, proposed_um: Vector, reach_um: float, view: View) -> Vector | None:
    """Return the position in µm that a click means, at full resolution, near one found on a coarser level.

    In a maximum intensity projection it is the brightest place within reach. Else it is where the smoothed
    intensity rises half-way from what lies before the brightest place to what that has, but at least to the
    opacity threshold; of several such places, the nearest to the proposed one. The threshold alone would be
    met too early by a surface that smoothing widens, and anywhere if it lies within the speckle.

    Parameters
    ----------
    block : Level
        The voxels around the proposed position, in full resolution.
    ray : Ray
    proposed_um : (float, float, float)
        On the ray.
    reach_um : float
        How far from there, along the ray, the surface may lie.
    view : View

    Returns
    -------
    (float, float, float) or None
        None where there is no such surface within reach: then the proposed position stands.
    """
    shown = _smoothed(visible_part(block, view.cropping_um), view.window)
    sampled = intensities_along(shown.data, shown.spacing_um, shown.origin_um, ray)
    if sampled is None:
        return None
    distances_um, values = sampled
    proposed = float(np.subtract(proposed_um, ray.origin_um) @ np.asarray(ray.direction))
    near = np.abs(distances_um - proposed) <= reach_um
    distances_um, values = distances_um[near], values[near]
    if values.size == 0:
        return None
    peak = int(np.argmax(values))
    if view.rendering == "mip":
        return vector(ray.at(float(distances_um[peak])))
    # Glare beyond the window's end is drawn no brighter, and must not hide a fainter surface before it.
    brightest = min(float(values[peak]), max(view.window[1], view.opacity_threshold))
    surface = max(view.opacity_threshold, (float(np.median(values[: peak + 1])) + brightest) / 2)
    rises = np.flatnonzero((values[:-1] < surface) & (values[1:] >= surface))
    if rises.size == 0:
        return None
    share = (surface - values[rises]) / (values[rises + 1] - values[rises])
    crossings_um = distances_um[rises] + share * (distances_um[rises + 1] - distances_um[rises])
    return vector(ray.at(float(crossings_um[np.argmin(np.abs(crossings_um - proposed))])))


def _smoothing_um(spacing_um: Vector) -> float:
    return _SMOOTHING_VOXEL * float(np.median(spacing_um))


def _smoothed(level: Level, window: tuple[float, float]) -> Level:
    """Return a level with its speckle averaged, over a distance in µm that is the same along each axis.

    What is not a number is taken for black, infinite values for black and white, as they are drawn.
    """
    from scipy import ndimage  # late: it takes 0.4 s, and the first picture should not wait for it

    black, white = window
    values = np.nan_to_num(level.data.astype(np.float32), nan=black, neginf=black, posinf=white)
    sigma_voxel = _smoothing_um(level.spacing_um) / np.asarray(level.spacing_um)
    smoothed = ndimage.gaussian_filter(values, sigma_voxel, mode="nearest", truncate=_SMOOTHING_REACH)
    return replace(level, data=smoothed)


def is_seen_alike(first: Ray, second: Ray) -> bool:
    """Say whether two clicks were made from about the same angle, so that they settle no depth.

    In perspective the rays of one picture cross at the eye, at whatever angle.
    """
    if first.origin_um == second.origin_um:
        return True
    return closest_approach(first, second).angle_deg < SMALLEST_ANGLE_DEG


def settle(first: Ray, second: Ray) -> Settled:
    """Return the point nearest to two rays, if they are far from parallel and pass near each other."""
    if is_seen_alike(first, second):
        return Settled(None, "turn the volume further before the second click")
    approach = closest_approach(first, second)
    if approach.gap_um > WIDEST_GAP_UM:
        return Settled(
            None, f"the two clicks miss each other by {approach.gap_um:.0f} µm: aim at the same spot"
        )
    return Settled(vector(approach.position_um))


def nudged(position_um: Vector, axis: int, voxels: int, spacing_um: Vector) -> Vector:
    """Return a position moved along one axis by a number of voxels."""
    moved = list(position_um)
    moved[axis] += float(voxel_to_um(voxels, spacing_um[axis]))
    return vector(moved)


def clipped_crosshair(position_um: Vector, shape: tuple[int, int, int], spacing_um: Vector) -> Vector:
    """Return the position itself if it is in the volume, else the nearest there: slices are of voxels."""
    index = um_to_voxel(position_um, spacing_um)
    if np.all(index >= 0) and np.all(index <= np.subtract(shape, 1)):
        return position_um
    clipped = np.clip(index, 0, np.subtract(shape, 1))
    return vector(voxel_to_um(clipped, spacing_um))
