import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.errors import UserError
from annotations.geometry.body import link_bodies
from annotations.geometry.kinematics import keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.poses import random_pose

FORCEPS = shipped_tools()["magnetic-forceps"]
EXTENT_UM = Grid().extent_um
DEEPEST_UM = 6000.0


@given(st.integers(0, 2**32), st.sampled_from(["magnetic-forceps", "needle"]))
def test_a_pose_is_legal_and_inside_the_volume_and_the_signal(seed: int, name: str) -> None:
    tool = shipped_tools()[name]

    pose = random_pose(tool, np.random.default_rng(seed), EXTENT_UM, DEEPEST_UM)

    for joint in tool.joints:
        assert joint.limits_deg[0] <= pose.angles_deg[joint.name] <= joint.limits_deg[1]
    for body in link_bodies(pose, tool).values():
        low, high = body.bounds_um()
        assert np.all(low >= 0)
        assert np.all(high <= EXTENT_UM)
    assert all(0 < position[2] <= DEEPEST_UM for position in keypoints_um(pose, tool).values())


def test_strongly_bent_tools_are_no_rarer_than_straight_ones() -> None:
    rng = np.random.default_rng(5)
    angles = [random_pose(FORCEPS, rng, EXTENT_UM, DEEPEST_UM).angles_deg for _ in range(300)]

    for name, middle in (("theta1", 0.0), ("theta2", 45.0)):
        values = np.array([each[name] for each in angles])
        # Uniform over 180° and 90°: half of them are further from the middle than a quarter of the range.
        quarter = (90 - middle) / 2
        assert np.mean(np.abs(values - middle) > quarter) == pytest.approx(0.5, abs=0.09)


def test_a_tool_that_does_not_fit_is_refused() -> None:
    with pytest.raises(UserError, match=r"does not fit into the workspace of 5\.0 × 5\.0 × 5\.0 mm"):
        random_pose(FORCEPS, np.random.default_rng(1), (5000.0, 5000.0, 5000.0), DEEPEST_UM)


def test_a_tool_without_links_has_no_body() -> None:
    points = ToolSpecification.model_validate(
        {"schema": "oct-tool/1", "name": "points", "keypoints": [{"name": "a"}]}
    )

    with pytest.raises(UserError, match="no links"):
        random_pose(points, np.random.default_rng(1), EXTENT_UM, DEEPEST_UM)
