"""Where a click in the scene puts a keypoint: one ray finds a surface, two rays settle a depth."""

from dataclasses import dataclass, replace

import numpy as np

from annotations.geometry.frames import Vector, um_to_voxel, vector, voxel_to_um
from annotations.volumes import Level, Ray, brightest_sample, closest_approach, first_surface
from annotator.view import View

# Rays that are nearly parallel cross anywhere: below this angle the second one only proposes anew.
SMALLEST_ANGLE_DEG = 10.0
# Two rays that pass each other farther apart than this were not aimed at one point.
WIDEST_GAP_UM = 500.0


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

    The brightest sample in a maximum intensity projection, else the first surface. None where the ray misses
    the volume or meets nothing above the opacity threshold.
    """
    shown = visible_part(level, view.cropping_um)
    if view.rendering == "mip":
        found = brightest_sample(shown.data, shown.spacing_um, shown.origin_um, ray)
    else:
        found = first_surface(shown.data, shown.spacing_um, shown.origin_um, ray, view.opacity_threshold)
    return None if found is None else vector(found)


def settle(first: Ray, second: Ray) -> Settled:
    """Return the point nearest to two rays, if they are far from parallel and pass near each other."""
    approach = closest_approach(first, second)
    if approach.angle_deg < SMALLEST_ANGLE_DEG:
        return Settled(None, "turn the volume further before the second click")
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
