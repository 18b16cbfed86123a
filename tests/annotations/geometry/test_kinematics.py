import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from scipy.spatial.transform import Rotation

from annotations.geometry.boxes import box_keypoints_um
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes, link_frames
from annotations.geometry.rotations import about_axis, matrix, quaternion
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification

STRAIGHT = (1.0, 0.0, 0.0, 0.0)


def test_a_straight_tool_lies_along_its_own_x(forceps: ToolSpecification) -> None:
    found = keypoints_um(ToolPose((0.0, 0.0, 0.0), STRAIGHT), forceps)
    assert found == {
        "k0": (-5500.0, 0.0, 0.0),
        "k1": (5500.0, 0.0, 0.0),
        "k2": (6000.0, 0.0, 0.0),
        "k3": (11_000.0, 0.0, 0.0),
        "k4": (11_500.0, 0.0, 0.0),
        "k5": (17_500.0, 0.0, 0.0),
    }


def test_a_joint_turns_its_child_about_the_hinge_right_handed(forceps: ToolSpecification) -> None:
    pose = ToolPose((100.0, 200.0, 300.0), STRAIGHT, {"theta1": 90.0, "theta2": 90.0})
    found = keypoints_um(pose, forceps)
    # About +y, x turns towards −z, and −z towards −x. Each hinge lies 250 µm beyond one link's tip.
    expected = {
        "k0": (-5400.0, 200.0, 300.0),
        "k1": (5600.0, 200.0, 300.0),
        "k2": (5850.0, 200.0, 50.0),
        "k3": (5850.0, 200.0, -4950.0),
        "k4": (5600.0, 200.0, -5200.0),
        "k5": (-400.0, 200.0, -5200.0),
    }
    assert set(found) == set(expected)
    for name, position_um in expected.items():
        assert found[name] == pytest.approx(position_um, abs=1e-9), name


@given(pose=...)
def test_the_targets_of_a_posed_tool_are_its_pose(forceps: ToolSpecification, pose: ToolPose) -> None:
    frames = link_frames(pose, forceps)
    hinges = {
        joint.name: tuple(float(value) for value in frames[joint.parent].axes @ joint.hinge_axis)
        for joint in forceps.joints
    }
    found = pose_targets(keypoints_um(pose, forceps), forceps, hinges)  # type: ignore[arg-type]
    assert found.position_um == pytest.approx(pose.position_um, rel=1e-9, abs=1e-9)
    assert found.orientation == pytest.approx(tuple(matrix(pose.rotation_wxyz)[:, 0]), abs=1e-9)
    for name, turn_deg in pose.angles_deg.items():
        assert found.angles_deg[name] == pytest.approx(abs(turn_deg), abs=1e-9)
        assert found.signed_angles_deg[name] == pytest.approx(turn_deg, abs=1e-9)


@given(pose=..., motion=...)
def test_a_rigid_motion_moves_every_keypoint_rigidly(
    forceps: ToolSpecification, pose: ToolPose, motion: ToolPose
) -> None:
    turn = Rotation.from_quat(motion.rotation_wxyz, scalar_first=True)
    turned = turn * Rotation.from_quat(pose.rotation_wxyz, scalar_first=True)
    moved = ToolPose(
        tuple(turn.apply(pose.position_um) + motion.position_um),
        quaternion(turned.as_quat(scalar_first=True)),
        pose.angles_deg,
    )
    found = keypoints_um(moved, forceps)
    for name, position_um in keypoints_um(pose, forceps).items():
        np.testing.assert_allclose(found[name], turn.apply(position_um) + motion.position_um, atol=1e-8)


@given(pose=...)
def test_links_keep_their_lengths(forceps: ToolSpecification, pose: ToolPose) -> None:
    found = keypoints_um(pose, forceps)
    for link in forceps.links:
        assert math.dist(found[link.base], found[link.tip]) == pytest.approx(link.length_um, rel=1e-12)


@given(pose=...)
def test_the_boxes_of_a_posed_tool_end_at_its_keypoints(forceps: ToolSpecification, pose: ToolPose) -> None:
    frames, boxes = link_frames(pose, forceps), link_boxes(pose, forceps)
    assert list(boxes) == ["link0", "link1", "link2"]
    found = box_keypoints_um(boxes, forceps)
    for name, position_um in keypoints_um(pose, forceps).items():
        np.testing.assert_allclose(found[name], position_um, rtol=0, atol=1e-9)
    for link in forceps.links:
        assert boxes[link.name].size_um == (link.length_um, *link.cross_section_um)
        np.testing.assert_allclose(boxes[link.name].axes, frames[link.name].axes, atol=1e-14)


def test_a_hinge_lies_between_two_links(forceps: ToolSpecification) -> None:
    fields = forceps.model_dump(mode="json")
    fields["joints"][0]["offsets_um"] = [100.0, 40.0]
    uneven = ToolSpecification.model_validate(fields)
    found = keypoints_um(ToolPose((0.0, 0.0, 0.0), STRAIGHT, {"theta1": 90.0}), uneven)
    # The hinge is 100 µm beyond k1, and k2 another 40 µm beyond the hinge, in the direction of its own link.
    assert found["k2"] == pytest.approx((5600.0, 0.0, -40.0), abs=1e-9)


def test_joints_may_be_listed_in_any_order(chain: Callable[..., ToolSpecification]) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), STRAIGHT, {"theta1": 90.0, "theta2": 90.0, "theta3": 90.0})
    forwards, backwards = chain(4), chain(4, joints_backwards=True)
    assert keypoints_um(pose, backwards) == keypoints_um(pose, forwards)
    # Four links of one length, three right angles: a square.
    square = keypoints_um(pose, forwards)
    assert square["k4"] == pytest.approx(square["k0"], abs=1e-9)


def test_two_jaws_open_from_one_link(chain: Callable[..., ToolSpecification]) -> None:
    fields = chain(3).model_dump(mode="json")
    fields["links"][2] |= {"base": "k1", "tip": "k3"}
    fields["joints"][1] |= {"parent": "link0"}
    jaws = ToolSpecification.model_validate(fields)
    pose = ToolPose((500.0, 0.0, 0.0), STRAIGHT, {"theta1": 30.0, "theta2": -30.0})
    found = keypoints_um(pose, jaws)
    assert found["k2"][2] == pytest.approx(-500.0)
    assert found["k3"][2] == pytest.approx(500.0)
    assert found["k2"][0] == found["k3"][0]


def test_a_link_that_hangs_on_nothing_has_no_place(chain: Callable[..., ToolSpecification]) -> None:
    fields = chain(3).model_dump()
    fields["joints"] = fields["joints"][:1]
    loose = ToolSpecification.model_validate(fields)
    assert set(link_frames(ToolPose((0.0, 0.0, 0.0), STRAIGHT), loose)) == {"link0", "link1"}


def test_a_tool_without_links_has_no_places() -> None:
    point = ToolSpecification.model_validate(
        {"schema": "oct-tool/1", "name": "bead", "keypoints": [{"name": "centre"}]}
    )
    assert keypoints_um(ToolPose((1.0, 2.0, 3.0), STRAIGHT), point) == {}


def test_keypoints_between_the_ends_of_links_have_no_place(nine_keypoints: ToolSpecification) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), about_axis((0, 0, 1), 90))
    found = keypoints_um(pose, nine_keypoints)
    assert set(found) == {"hub", "tip"}
    assert found["tip"] == pytest.approx((0.0, 4500.0, 0.0), abs=1e-9)
