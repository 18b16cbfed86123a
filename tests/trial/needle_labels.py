"""Where the needle's tip and shaft are in each volume, told from the images; what the robot says of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.trial.needle_surface import Points, common_direction, farthest_um, surface_um
from tests.trial.needle_template import Placement, end_um, made_template, shaft_um, started
from tests.trial.robot_map import RobotMap, drift_um, fitted_map

SHAFT_LENGTH_UM = 2000.0
"""From the tip to the keypoint on the shaft, as the tool's specification has it."""
_IN_TEMPLATE = 40
_SEEN_BEHIND_UM = 2200.0
"""How much of the needle is in every volume."""
_FLAGGED_SIGMAS = 4.0
_MEDIAN_LENGTH = 1.538
"""Of a vector of three normal numbers of standard deviation 1."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One file of the data set.

    Attributes
    ----------
    path : Path
        Its name is the time of the recording, in seconds.
    pose : ndarray, shape (6,)
        Of the robot: millimetres and degrees.
    surface_um : ndarray, shape (n, 3)
        Of the needle.
    """

    path: Path
    pose: Points
    surface_um: Points

    @property
    def time_s(self) -> float:
        """When it was recorded."""
        return float(self.path.stem)


@dataclass(frozen=True, eq=False)
class Labels:
    """The keypoints of n recordings, from their images and from nothing else.

    Attributes
    ----------
    tips_um, shafts_um : ndarray, shape (n, 3)
    farthest_um : ndarray, shape (n, 3)
        The middle of the farthest bright points: the plain automatic estimate.
    misfits_um : ndarray, shape (n,)
        Root mean square of the distances of the surface from the template.
    """

    tips_um: Points
    shafts_um: Points
    farthest_um: Points
    misfits_um: Points


def read_recording(path: Path) -> Recording:
    """Read a file of the data set, and find the needle in it."""
    with np.load(path) as content:
        return Recording(path, content["pos"], surface_um(content["data"]))


def labelled(recordings: Sequence[Recording], learn_from: int) -> Labels:
    """Return the keypoints of recordings; the first ``learn_from`` make the template.

    How the needle lies is told by the template, where it ends also by its farthest bright points: the tip is
    half way between the two, for their errors have little to do with each other.
    """
    direction = common_direction([one.surface_um for one in recordings[:learn_from]])
    ends_um = np.array([farthest_um(one.surface_um, direction) for one in recordings])
    seen = [
        one.surface_um[(one.surface_um - end_um) @ direction > -_SEEN_BEHIND_UM]
        for one, end_um in zip(recordings, ends_um, strict=True)
    ]
    template = made_template(seen[: learn_from : max(1, learn_from // _IN_TEMPLATE)], direction)
    placements = [template.placed(surface, started(surface, direction)) for surface in seen]
    apart_um = ends_um - [placement.offset_um for placement in placements]
    placements = [
        Placement(one.rotation, one.offset_um + shift_um / 2, one.residual_um, one.share)
        for one, shift_um in zip(placements, apart_um - np.median(apart_um[:learn_from], axis=0), strict=True)
    ]
    tip_um = end_um(template, placements[:learn_from], seen[:learn_from], direction)
    back_um = shaft_um(template, tip_um, direction, SHAFT_LENGTH_UM)
    return Labels(
        np.array([one.to_volume_um(tip_um) for one in placements]),
        np.array([one.to_volume_um(back_um) for one in placements]),
        ends_um,
        np.array([one.residual_um for one in placements]),
    )


@dataclass(frozen=True, eq=False)
class RobotView:
    """What the robot's poses say of tips, after a map and a drift that were fitted to tips for training.

    The drift is the volumes' own: it is seen along the depth, over hours, and no pose can tell it.

    Attributes
    ----------
    robot_map : RobotMap
    times_s : ndarray, shape (n,)
    residuals_um : ndarray, shape (n, 3)
        Of the tips that it was fitted to.
    limit_um : float
        What is farther off is flagged.
    """

    robot_map: RobotMap
    times_s: Points
    residuals_um: Points
    limit_um: float

    def off_um(self, recordings: Sequence[Recording], tips_um: Points, *, with_drift: bool) -> Points:
        """Return how far tips are from where the robot has them, shape (n, 3)."""
        off = tips_um - self.robot_map.tips_um(np.array([one.pose for one in recordings]))
        if not with_drift:
            off = off - drift_um(
                self.times_s, self.residuals_um, np.array([one.time_s for one in recordings])
            )
        return np.asarray(off)

    def flagged(self, recordings: Sequence[Recording], tips_um: Points) -> NDArray[np.bool_]:
        """Return which tips a person should look at, shape (n,)."""
        off = np.linalg.norm(self.off_um(recordings, tips_um, with_drift=False), axis=1)
        return np.asarray(off > self.limit_um)


def robot_view(recordings: Sequence[Recording], tips_um: Points) -> RobotView:
    """Fit what the robot says to tips."""
    poses, times_s = np.array([one.pose for one in recordings]), np.array([one.time_s for one in recordings])
    robot_map = fitted_map(poses, tips_um)
    residuals_um = tips_um - robot_map.tips_um(poses)
    off = np.linalg.norm(residuals_um - drift_um(times_s, residuals_um, times_s), axis=1)
    limit_um = _FLAGGED_SIGMAS * float(np.median(off)) / _MEDIAN_LENGTH
    return RobotView(robot_map, times_s, residuals_um, limit_um)


def rms_um(vectors_um: Points) -> float:
    """Return the root mean square length of vectors, shape (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(np.square(vectors_um), axis=1))))
