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
    return float(angles_deg(np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)))


def angles_deg(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `angle_deg` of many pairs of vectors: shapes (…, 3), which broadcast, to (…); NaN stays NaN."""
    a, b = _scaled_each(first), _scaled_each(second)
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    sine = lengths(np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1))
    return np.degrees(np.arctan2(sine, a0 * b0 + a1 * b1 + a2 * b2))


def unit_vectors(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of shape (…, 3) with length one; NaN for those of length zero."""
    directions = _scaled_each(vectors)
    return directions / lengths(directions)[..., np.newaxis]


def lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lengths of vectors: shape (…, 3) to (…)."""
    return np.hypot(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])


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


def _scaled_each(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `scaled` of each vector of shape (…, 3); NaN for those of length zero."""
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    return vectors / np.where(largest > 0, largest, np.nan)
