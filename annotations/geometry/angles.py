"""Angles between directions, in degrees; directions must be in a metric frame (µm), never in voxels."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def angle_deg(first: ArrayLike, second: ArrayLike) -> float:
    """Return the unsigned angle between two vectors of shape (3,), in [0, 180] degrees.

    atan2(‖a × b‖, a · b), from the definitions of the two products. Near 0° and 180° the cosine hardly
    changes with the angle, so that arccos of it would lose half of the digits; the arc tangent keeps them.
    The lengths of the vectors do not matter; the angle to a vector of length zero is NaN.
    """
    a, b = scaled(first), scaled(second)
    if a is None or b is None:
        return math.nan
    return math.degrees(math.atan2(math.hypot(*np.cross(a, b)), float(np.dot(a, b))))


def signed_angle_deg(first: ArrayLike, second: ArrayLike, hinge_axis: ArrayLike) -> float:
    """Return the angle from one vector to another about a hinge axis, in [−180, 180] degrees.

    atan2((a × b) · h, a · b) with the hinge axis h as a unit vector; all of shape (3,). For vectors that are
    perpendicular to h this is the rotation about it; NaN where a length is zero.
    """
    a, b, hinge = scaled(first), scaled(second), scaled(hinge_axis)
    if a is None or b is None or hinge is None:
        return math.nan
    sine = float(np.dot(np.cross(a, b), hinge)) / math.hypot(*hinge)
    return math.degrees(math.atan2(sine, float(np.dot(a, b))))


def scaled(values: ArrayLike) -> NDArray[np.float64] | None:
    """Return a vector of the same direction whose largest component is ±1; None if its length is zero.

    Products of its components neither under- nor overflow, however short or long it was.
    """
    raw = np.asarray(values, dtype=np.float64)
    return raw / np.abs(raw).max() if raw.any() else None
