"""From a robot's pose to its tool's tip in a volume: a rigid map between frames of opposite hands."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

_ORDERS = tuple("".join(order) for axes in ("xyz", "XYZ") for order in itertools.permutations(axes))
"""The data set does not say how its three angles make a rotation: all ways are tried."""
_ROBUST_UM = 50.0
_DRIFT_NEIGHBOURS = 20
_MIRROR = np.diag([1.0, 1.0, -1.0])


@dataclass(frozen=True, eq=False)
class RobotMap:
    """``tip = mirror · turn · (translation + R(angles) · tip offset) + origin``.

    Attributes
    ----------
    order : str
        Of the angles, as `scipy.spatial.transform.Rotation.from_euler` names it.
    turn_rotvec : ndarray, shape (3,)
        Of the robot's frame, in radians.
    origin_um, tip_offset_um : ndarray, shape (3,)
        In the volume's frame, and in that of the robot's flange.
    """

    order: str
    turn_rotvec: Array
    origin_um: Array
    tip_offset_um: Array

    @property
    def matrix(self) -> Array:
        """The 3 × 3 matrix from the robot's frame to the volume's; its determinant is −1."""
        return np.asarray(_MIRROR @ Rotation.from_rotvec(self.turn_rotvec).as_matrix())

    def tips_um(self, poses: Array) -> Array:
        """Return the tips, shape (n, 3), for poses, shape (n, 6), in millimetres and degrees."""
        turns = Rotation.from_euler(self.order, poses[:, 3:], degrees=True)
        return np.asarray(
            (poses[:, :3] * 1000 + turns.apply(self.tip_offset_um)) @ self.matrix.T + self.origin_um
        )


def fitted_map(poses: Array, tips_um: Array) -> RobotMap:
    """Return the map that fits best, with little weight for tips that are far off.

    Parameters
    ----------
    poses : ndarray, shape (n, 6)
        Millimetres and degrees.
    tips_um : ndarray, shape (n, 3)
    """
    start = _start(poses, tips_um)
    found: list[tuple[float, RobotMap]] = []
    for order in _ORDERS:

        def made(numbers: Array, order: str = order) -> RobotMap:
            return RobotMap(order, numbers[:3], numbers[3:6] * 1000, numbers[6:] * 1000)

        fit = least_squares(
            lambda numbers: (made(numbers).tips_um(poses) - tips_um).ravel() / _ROBUST_UM,
            np.concatenate([start, tips_um.mean(0) / 1000, np.zeros(3)]),
            loss="soft_l1",
        )
        found.append((float(fit.cost), made(fit.x)))
    return min(found, key=lambda each: each[0])[1]


def linear_residuals_um(poses: Array, tips_um: Array) -> Array:
    """Return how far tips are from a straight linear fit on the pose, shape (n, 3)."""
    known = np.column_stack([poses, np.ones(len(poses))])
    return np.asarray(tips_um - known @ np.linalg.lstsq(known, tips_um, rcond=None)[0])


def _start(poses: Array, tips_um: Array) -> Array:
    """Return the rotation vector nearest to the linear map of the translations (Kabsch 1976), mirrored."""
    known = np.column_stack([poses, np.ones(len(poses))])
    linear = np.linalg.lstsq(known, tips_um, rcond=None)[0][:3].T
    left, _, right = np.linalg.svd(_MIRROR @ linear)
    left[:, -1] *= np.linalg.det(left @ right)
    return np.asarray(Rotation.from_matrix(left @ right).as_rotvec())


def drift_um(times_s: Array, residuals_um: Array, at_s: Array) -> Array:
    """Return the slow part of residuals at some times, shape (m, 3): the median of those nearest in time."""
    order = np.argsort(times_s)
    sorted_s, sorted_um = times_s[order], residuals_um[order]
    places = np.searchsorted(sorted_s, at_s)
    starts = np.clip(places - _DRIFT_NEIGHBOURS // 2, 0, max(0, len(order) - _DRIFT_NEIGHBOURS))
    return np.array([np.median(sorted_um[start : start + _DRIFT_NEIGHBOURS], axis=0) for start in starts])
