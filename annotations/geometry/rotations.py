"""Rotations as right-handed unit quaternions (w, x, y, z) with w ≥ 0.

Yaw, pitch and roll are intrinsic turns about z, the new y and the new x, in degrees.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Quaternion = tuple[float, float, float, float]
"""A unit quaternion (w, x, y, z), w ≥ 0."""

_ROUNDING = 8 * float(np.finfo(np.float64).eps)
_ORTHONORMAL = 1e-6 + 1e-5 * np.eye(3)
# Nearer to the vertical than this, yaw and roll are turns about one and the same axis.
_VERTICAL = 1e-9


def quaternion(values: ArrayLike) -> Quaternion:
    """Return the unit quaternion with w ≥ 0 of the same rotation; ValueError for a length of zero."""
    raw = np.asarray(values, dtype=np.float64)
    numbers = raw.tolist() if raw.shape == (4,) else []
    if not any(numbers) or not all(map(math.isfinite, numbers)):
        raise ValueError(f"a rotation needs four finite numbers (w, x, y, z), not all zero; found {values!r}")
    # One that is of unit length but for rounding stays as it is, or it would change each time it is read.
    if abs(math.hypot(*numbers) - 1) > _ROUNDING:
        # Scaled first, because a sum of squares would under- or overflow.
        raw = raw / np.abs(raw).max()
        numbers = (raw / math.hypot(*raw)).tolist()
    sign = -1.0 if numbers[0] < 0 else 1.0
    w, x, y, z = (sign * number for number in numbers)
    return (w, x, y, z)


def matrix(rotation_wxyz: ArrayLike) -> NDArray[np.float64]:
    """Return the (3, 3) matrix of a rotation; its columns are the rotated x, y and z axes."""
    return np.array(_rows(*quaternion(rotation_wxyz)))


def matrices(rotations_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrices, (…, 3, 3), of many rotations: unit quaternions (…, 4); NaN stays NaN."""
    by_row_and_column = np.array(_rows(*np.moveaxis(rotations_wxyz, -1, 0)))
    return np.moveaxis(by_row_and_column, (0, 1), (-2, -1))


def _rows(w: Any, x: Any, y: Any, z: Any) -> list[list[Any]]:
    """Return the entries of the matrix of a quaternion, or of many."""
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def from_matrix(rotation: ArrayLike) -> Quaternion:
    """Return the quaternion of a (3, 3) rotation matrix; ValueError for any other matrix, mirrors included.

    The largest of the four components is taken from the diagonal, so that none is found by dividing by a
    small number (S. W. Shepperd, *Quaternion from rotation matrix*, J. Guidance and Control 1, 1978).
    """
    m = np.asarray(rotation, dtype=np.float64)
    if m.shape != (3, 3) or not (np.abs(m.T @ m - np.eye(3)) <= _ORTHONORMAL).all() or np.linalg.det(m) < 0:
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


def product(second: ArrayLike, first: ArrayLike) -> Quaternion:
    """Return the rotation that turns by ``first`` and then by ``second`` (Hamilton's product)."""
    a, b = np.asarray(quaternion(second)), np.asarray(quaternion(first))
    vector_part = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return quaternion([a[0] * b[0] - a[1:] @ b[1:], *vector_part])


def from_yaw_pitch_roll(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Quaternion:
    """Return the rotation by yaw about z, then by pitch about the new y, then by roll about the new x."""
    return from_matrix(
        matrix(about_axis((0, 0, 1), yaw_deg))
        @ matrix(about_axis((0, 1, 0), pitch_deg))
        @ matrix(about_axis((1, 0, 0), roll_deg))
    )


def yaw_pitch_roll_deg(rotation_wxyz: ArrayLike) -> tuple[float, float, float]:
    """Return yaw and roll in (−180, 180] and pitch in [−90, 90] degrees; yaw is 0 where x is vertical."""
    m = matrix(rotation_wxyz)
    level = math.hypot(m[0, 0], m[1, 0])
    pitch = math.degrees(math.atan2(-m[2, 0], level))
    if level < _VERTICAL:
        return 0.0, pitch, math.degrees(math.atan2(math.copysign(1.0, pitch) * m[0, 1], m[1, 1]))
    yaw, roll = math.atan2(m[1, 0], m[0, 0]), math.atan2(m[2, 1], m[2, 2])
    return math.degrees(yaw), pitch, math.degrees(roll)


def along(direction: ArrayLike, roll_deg: float) -> Quaternion:
    """Return the rotation whose own +x has a direction of shape (3,), with this roll; ValueError if zero."""
    x, y, z = np.asarray(direction, dtype=np.float64)
    if not (x or y or z):
        raise ValueError("a rotation needs a direction that is not zero")
    level = math.hypot(x, y)
    # The same rule as in `yaw_pitch_roll_deg`, or a roll that was read there would be another one here.
    yaw = 0.0 if level < _VERTICAL * math.hypot(x, y, z) else math.degrees(math.atan2(y, x))
    return from_yaw_pitch_roll(yaw, math.degrees(math.atan2(-z, level)), roll_deg)
