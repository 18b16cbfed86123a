"""Angles between directions, in degrees; directions must be in a metric frame (µm), never in voxels."""

import numpy as np
from numpy.typing import ArrayLike


def angle_deg(first: ArrayLike, second: ArrayLike) -> float:
    """Return the unsigned angle between two vectors of shape (3,), in [0, 180] degrees.

    atan2(‖a × b‖, a · b), from the definitions of the two products. Near 0° and 180° the cosine hardly
    changes with the angle, so that arccos of it would lose half of the digits; the arc tangent keeps them.
    The lengths of the vectors do not matter; the angle to a vector of length zero is NaN.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if not a.any() or not b.any():
        return float("nan")
    # Scaled so that neither tiny nor huge vectors under- or overflow in the products.
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))))


def signed_angle_deg(first: ArrayLike, second: ArrayLike, hinge_axis: ArrayLike) -> float:
    """Return the angle from one vector to another about a hinge axis, in (−180, 180] degrees.

    atan2((a × b) · h, a · b) with the hinge axis h as a unit vector; all of shape (3,). For vectors that are
    perpendicular to h this is the rotation about it; NaN where a length is zero.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    hinge = np.asarray(hinge_axis, dtype=np.float64)
    if not a.any() or not b.any() or not hinge.any():
        return float("nan")
    a, b = a / np.abs(a).max(), b / np.abs(b).max()
    hinge = hinge / np.linalg.norm(hinge)
    return float(np.degrees(np.arctan2(np.dot(np.cross(a, b), hinge), np.dot(a, b))))
