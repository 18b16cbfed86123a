"""Rotations as right-handed unit quaternions (w, x, y, z) with w ≥ 0."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Quaternion = tuple[float, float, float, float]
"""A unit quaternion (w, x, y, z), w ≥ 0."""

_ROUNDING = 8 * float(np.finfo(np.float64).eps)
_ORTHONORMAL = 1e-6


def quaternion(values: ArrayLike) -> Quaternion:
    """Return the unit quaternion with w ≥ 0 of the same rotation; ValueError for a length of zero."""
    raw = np.asarray(values, dtype=np.float64)
    if raw.shape != (4,) or not np.isfinite(raw).all() or not raw.any():
        raise ValueError(f"a rotation needs four finite numbers (w, x, y, z), not all zero; found {values!r}")
    # One that is of unit length but for rounding stays as it is, or it would change each time it is read.
    if abs(math.hypot(*raw) - 1) > _ROUNDING:
        # Scaled first, because a sum of squares would under- or overflow.
        raw = raw / np.abs(raw).max()
        raw = raw / math.hypot(*raw)
    w, x, y, z = raw * (-1.0 if raw[0] < 0 else 1.0)
    return (float(w), float(x), float(y), float(z))


def matrix(rotation_wxyz: ArrayLike) -> NDArray[np.float64]:
    """Return the (3, 3) matrix of a rotation; its columns are the rotated x, y and z axes."""
    w, x, y, z = quaternion(rotation_wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def from_matrix(rotation: ArrayLike) -> Quaternion:
    """Return the quaternion of a (3, 3) rotation matrix; ValueError for any other matrix, mirrors included.

    The largest of the four components is taken from the diagonal, so that none is found by dividing by a
    small number (S. W. Shepperd, *Quaternion from rotation matrix*, J. Guidance and Control 1, 1978).
    """
    m = np.asarray(rotation, dtype=np.float64)
    if m.shape != (3, 3) or not np.allclose(m.T @ m, np.eye(3), atol=_ORTHONORMAL) or np.linalg.det(m) < 0:
        raise ValueError(f"not the (3, 3) matrix of a rotation: {m.tolist()}")
    trace = float(np.trace(m))
    squares = np.array([trace, *(2 * np.diag(m) - trace)])
    products = np.array(
        [
            [1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], 1 + squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 + squares[2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 + squares[3]],
        ]
    )
    return quaternion(products[int(np.argmax(squares))])


def about_axis(axis: ArrayLike, turn_deg: float) -> Quaternion:
    """Return the right-handed rotation by an angle in degrees about an axis of shape (3,) and any length.

    ValueError for an axis of length zero.
    """
    direction = np.asarray(axis, dtype=np.float64)
    if not direction.any():
        raise ValueError("a rotation needs an axis that is not zero")
    half = np.radians(turn_deg) / 2
    return quaternion([np.cos(half), *(np.sin(half) * direction / math.hypot(*direction))])
