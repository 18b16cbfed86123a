import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.geometry.boxes import Box, hinge_axes
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.mirroring import (
    has_mirrored_poses,
    mirrored_box,
    mirrored_direction,
    mirrored_pose,
    mirrored_um,
    turn_sense,
)
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification

mirrors = st.tuples(st.integers(0, 2), st.floats(-20_000, 20_000))


def with_hinges(tool: ToolSpecification, *hinges: tuple[float, float, float]) -> ToolSpecification:
    """Return the tool with other hinges, whose limits allow both senses."""
    fields = tool.model_dump(mode="json")
    for joint, hinge in zip(fields["joints"], hinges, strict=True):
        joint |= {"hinge_axis": hinge, "limits_deg": (-180.0, 180.0)}
    return ToolSpecification.model_validate(fields)


def targets_of(pose: ToolPose, tool: ToolSpecification) -> PoseTargets:
    return pose_targets(keypoints_um(pose, tool), tool, hinge_axes(link_boxes(pose, tool), tool))


def assert_shows_the_mirror_image(
    found: ToolPose | None, pose: ToolPose, tool: ToolSpecification, mirror: tuple[int, float]
) -> None:
    assert found is not None
    positions_um = keypoints_um(found, tool)
    for name, position_um in keypoints_um(pose, tool).items():
        np.testing.assert_allclose(positions_um[name], mirrored_um(position_um, *mirror), rtol=0, atol=1e-7)
    boxes = link_boxes(found, tool)
    for name, box in link_boxes(pose, tool).items():
        expected = mirrored_box(box, *mirror)
        assert boxes[name].size_um == expected.size_um
        np.testing.assert_allclose(boxes[name].center_um, expected.center_um, rtol=0, atol=1e-7)
        np.testing.assert_allclose(boxes[name].axes, expected.axes, rtol=0, atol=1e-12)


def test_a_mirror_moves_positions_across_its_plane() -> None:
    found = mirrored_um([[1.0, 2.0, 3.0], [np.nan] * 3], 1, 10.0)
    np.testing.assert_array_equal(found, [[1.0, 18.0, 3.0], [np.nan] * 3])
    np.testing.assert_array_equal(mirrored_direction((1.0, 2.0, 3.0), 2), (1.0, 2.0, -3.0))


@given(pose=..., mirror=mirrors)
def test_the_forceps_in_a_mirror_are_the_forceps_with_the_same_angles(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float]
) -> None:
    found = mirrored_pose(pose, forceps, *mirror)
    assert_shows_the_mirror_image(found, pose, forceps, mirror)
    assert found is not None
    assert found.angles_deg == pose.angles_deg


@given(pose=..., mirror=mirrors, turn=st.floats(0, 2 * np.pi))
def test_angles_about_hinges_in_the_own_xz_plane_change_their_sign(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float], turn: float
) -> None:
    tool = with_hinges(forceps, (0.0, 0.0, 1.0), (float(np.sin(turn)), 0.0, float(np.cos(turn))))
    found = mirrored_pose(pose, tool, *mirror)
    assert_shows_the_mirror_image(found, pose, tool, mirror)
    assert found is not None
    assert found.angles_deg == {name: -angle_deg for name, angle_deg in pose.angles_deg.items()}


@given(pose=..., mirror=mirrors)
def test_targets_in_a_mirror_keep_their_unsigned_angles_and_turn_their_direction(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float]
) -> None:
    for tool in (forceps, with_hinges(forceps, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        found = mirrored_pose(pose, tool, *mirror)
        assert found is not None
        before, after = targets_of(pose, tool), targets_of(found, tool)
        assert before.position_um is not None
        assert before.orientation is not None
        assert after.position_um == pytest.approx(mirrored_um(before.position_um, *mirror), abs=1e-7)
        assert after.orientation == pytest.approx(mirrored_direction(before.orientation, mirror[0]), abs=1e-9)
        assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-8)
        for joint in tool.joints:
            sense = turn_sense(joint.hinge_axis)
            assert sense == (1 if joint.hinge_axis[1] else -1)
            assert after.signed_angles_deg[joint.name] == pytest.approx(
                sense * before.signed_angles_deg[joint.name], abs=1e-8
            )


@given(box=..., mirror=mirrors)
def test_a_box_in_a_mirror_has_its_ends_there_and_its_hinge_turned_round(
    box: Box, mirror: tuple[int, float]
) -> None:
    found = mirrored_box(box, *mirror)
    np.testing.assert_allclose(found.base_um, mirrored_um(box.base_um, *mirror), rtol=0, atol=1e-7)
    np.testing.assert_allclose(found.tip_um, mirrored_um(box.tip_um, *mirror), rtol=0, atol=1e-7)
    assert np.linalg.det(found.axes) == pytest.approx(1)
    np.testing.assert_allclose(
        found.axes[:, 1], -mirrored_direction(box.axes[:, 1], mirror[0]), rtol=0, atol=1e-12
    )
    # The same body: own y alone has turned.
    np.testing.assert_allclose(
        found.axes[:, 2], mirrored_direction(box.axes[:, 2], mirror[0]), rtol=0, atol=1e-12
    )


@given(pose=..., mirror=mirrors)
def test_a_mirror_twice_is_none(
    forceps: ToolSpecification, pose: ToolPose, mirror: tuple[int, float]
) -> None:
    once = mirrored_pose(pose, forceps, *mirror)
    assert once is not None
    assert_shows_the_mirror_image(once, pose, forceps, mirror)
    twice = mirrored_pose(once, forceps, *mirror)
    assert twice is not None
    np.testing.assert_allclose(twice.position_um, pose.position_um, rtol=0, atol=1e-9)
    before, after = (link_boxes(each, forceps) for each in (pose, twice))
    for name, box in before.items():
        np.testing.assert_allclose(after[name].axes, box.axes, rtol=0, atol=1e-12)


def test_a_tool_with_an_oblique_hinge_is_another_tool_in_a_mirror(forceps: ToolSpecification) -> None:
    oblique = with_hinges(forceps, (0.0, 1.0, 0.0), (0.0, 0.6, 0.8))
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta2": 30.0})
    assert mirrored_pose(pose, oblique, 0, 0.0) is None
    assert not has_mirrored_poses(oblique)
    assert has_mirrored_poses(forceps)


def test_a_joint_that_is_not_named_stays_straight_in_a_mirror(forceps: ToolSpecification) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta2": 30.0})
    found = mirrored_pose(pose, forceps, 0, 0.0)
    assert found is not None
    assert found.angles_deg == {"theta2": 30.0}


def test_a_needle_needs_no_hinges_to_be_mirrored(needle: ToolSpecification) -> None:
    pose = ToolPose((1.0, 2.0, 3.0), (0.6, 0.8, 0.0, 0.0))
    assert_shows_the_mirror_image(mirrored_pose(pose, needle, 2, 5.0), pose, needle, (2, 5.0))
