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
    """Return the angle from one vector to another as seen along a hinge axis, in [−180, 180] degrees.

    atan2((a × b) · h, a · b − (a · h)(b · h)) with the hinge axis h as a unit vector; all of shape (3,). It
    is the rotation about h that brings a to b, where one does, and for a hinge across one of them
    atan2((a × b) · h, a · b). NaN where a length is zero.
    """
    a, b, hinge = scaled(first), scaled(second), scaled(hinge_axis)
    if a is None or b is None or hinge is None:
        return math.nan
    axis = hinge / math.hypot(*hinge)
    cosine = float(np.dot(a, b) - np.dot(a, axis) * np.dot(b, axis))
    return math.degrees(math.atan2(float(np.dot(np.cross(a, b), axis)), cosine))


def scaled(values: ArrayLike) -> NDArray[np.float64] | None:
    """Return a vector of the same direction whose largest component is ±1; None if its length is zero.

    Products of its components neither under- nor overflow, however short or long it was.
    """
    raw = np.asarray(values, dtype=np.float64)
    return raw / np.abs(raw).max() if raw.any() else None
