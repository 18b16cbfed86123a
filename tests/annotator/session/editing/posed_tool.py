"""A pose that the tool is given, and when another one is the same."""

import numpy as np
import pytest

from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import from_yaw_pitch_roll, matrix

POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)
STRAIGHT = ToolPose((3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 65.0))


def assert_same(
    pose: ToolPose | None, expected: ToolPose, at_um: float = 1e-6, at_axis: float = 1e-9
) -> None:
    assert pose is not None
    assert pose.position_um == pytest.approx(expected.position_um, abs=at_um)
    np.testing.assert_allclose(matrix(pose.rotation_wxyz), matrix(expected.rotation_wxyz), atol=at_axis)
    for name in ("theta1", "theta2"):
        assert pose.angles_deg.get(name, 0.0) == pytest.approx(expected.angles_deg.get(name, 0.0), abs=1e-3)
