from collections.abc import Sequence

import numpy as np
import pytest

from annotations.errors import UserError
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import quaternion
from annotations.geometry.targets import target_arrays
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.learning.pose_vector import PoseScaling, angle_range_deg

FORCEPS = shipped_tools()["magnetic-forceps"]
NEEDLE = shipped_tools()["needle"]
LOW_UM, HIGH_UM = (0.0, 100.0, 0.0), (17_400.0, 26_100.0, 10_800.0)


def random_positions_um(count: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    poses = [
        ToolPose(
            tuple(rng.uniform(LOW_UM, HIGH_UM)),
            quaternion(rng.standard_normal(4)),
            {"theta1": float(rng.uniform(-90, 90)), "theta2": float(rng.uniform(0, 90))},
        )
        for _ in range(count)
    ]
    return np.array([list(keypoints_um(pose, FORCEPS).values()) for pose in poses])


def changed(section: str, **fields: object) -> ToolSpecification:
    content = FORCEPS.model_dump(mode="json")
    (content["joints"][0] if section == "joint" else content["targets"]).update(fields)
    return ToolSpecification.model_validate(content)


def test_poses_within_the_workspace_become_eight_numbers_from_0_to_1_and_back() -> None:
    scaling, positions_um = PoseScaling(FORCEPS, LOW_UM, HIGH_UM), random_positions_um(50)
    scaled = scaling.scaled(positions_um)
    assert scaled.shape == (50, 8)
    assert len(scaling.names) == 8
    assert scaling.names[-2:] == ("theta1", "theta2")
    assert scaled.min() >= 0
    assert scaled.max() <= 1
    found, expected = scaling.targets(scaled), target_arrays(positions_um, FORCEPS)
    np.testing.assert_allclose(found.position_um, expected.position_um, atol=1e-8)  # type: ignore[arg-type]
    np.testing.assert_allclose(found.orientation, expected.orientation, atol=1e-12)  # type: ignore[arg-type]
    for name, angle_deg in expected.angles_deg.items():
        np.testing.assert_allclose(found.angles_deg[name], angle_deg, atol=1e-10)


def test_the_ends_of_the_workspace_are_0_and_1() -> None:
    scaling = PoseScaling(NEEDLE, LOW_UM, HIGH_UM)
    for tip_um, end in ((LOW_UM, 0.0), (HIGH_UM, 1.0)):
        scaled = scaling.scaled([tip_um, np.subtract(tip_um, (0.0, 0.0, 500.0))])
        np.testing.assert_allclose(scaled, [end, end, end, 0.5, 0.5, 1.0], atol=1e-12)


def test_a_regressed_orientation_gets_the_length_of_one() -> None:
    found = PoseScaling(NEEDLE, LOW_UM, HIGH_UM).targets([0.5, 0.5, 0.5, 0.5, 0.65, 0.7])
    np.testing.assert_allclose(found.orientation, (0.0, 0.6, 0.8), atol=1e-12)  # type: ignore[arg-type]
    assert not found.angles_deg


def test_a_target_without_its_keypoints_is_not_a_number() -> None:
    positions_um = random_positions_um(1)
    positions_um[0, 5] = np.nan
    scaled = PoseScaling(FORCEPS, LOW_UM, HIGH_UM).scaled(positions_um)
    assert np.isnan(scaled).tolist() == [[False] * 7 + [True]]


@pytest.mark.parametrize(
    ("limits_deg", "hinge_axis", "expected"),
    [
        ((-90.0, 90.0), (0, 1, 0), (0.0, 90.0)),
        ((-30.0, 120.0), (0, 0, 1), (0.0, 120.0)),
        ((20.0, 60.0), (0, 1, 0), (20.0, 60.0)),
        ((-60.0, -20.0), (0, 1, 0), (20.0, 60.0)),
        # A hinge that is not across the links bends them less than it turns.
        ((20.0, 60.0), (0.6, 0.8, 0), (0.0, 180.0)),
    ],
)
def test_an_angle_is_scaled_by_the_limits_of_its_joint(
    limits_deg: Sequence[float], hinge_axis: Sequence[float], expected: tuple[float, float]
) -> None:
    tool = changed("joint", limits_deg=list(limits_deg), hinge_axis=[float(value) for value in hinge_axis])
    assert angle_range_deg(tool.targets.angles[0], tool) == expected


def test_an_angle_without_a_joint_may_be_anything() -> None:
    tool = changed("targets", angles=[{"name": "opening", "first": "link0", "second": "link2"}])
    assert angle_range_deg(tool.targets.angles[0], tool) == (0.0, 180.0)


@pytest.mark.parametrize("lacking", ["position", "orientation"])
def test_a_tool_without_position_or_orientation_is_refused(lacking: str) -> None:
    with pytest.raises(UserError, match=f"no target '{lacking}'"):
        PoseScaling(changed("targets", **{lacking: None}), LOW_UM, HIGH_UM)
