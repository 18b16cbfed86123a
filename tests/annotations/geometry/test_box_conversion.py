import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.geometry.box_conversion import (
    CLICK_NOISE_UM,
    RollUnknown,
    boxes_from_keypoints,
    roll_evidence,
)
from annotations.geometry.boxes import Box, box_keypoints_um, hinge_axes
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis, matrix, product, yaw_pitch_roll_deg
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification

# Bends at which clicks of 50 µm leave no doubt, on the links of the forceps.
CLEAR_DEG = 6.0

LEVEL = about_axis((0, 0, 1), 30.0)


def level_pose(roll_deg: float, theta1_deg: float, theta2_deg: float) -> ToolPose:
    rotation = product(LEVEL, about_axis((1, 0, 0), roll_deg))
    return ToolPose((5000.0, 6000.0, 4000.0), rotation, {"theta1": theta1_deg, "theta2": theta2_deg})


def roll_of(box: Box) -> float:
    return yaw_pitch_roll_deg(box.rotation_wxyz)[2]


def far_from_vertical(pose: ToolPose) -> bool:
    """Say whether the roll is a number to compute with: straight up it is one with the yaw."""
    return bool(math.hypot(*matrix(pose.rotation_wxyz)[:2, 0]) > 1e-3)


def assert_same(found: dict[str, Box], expected: dict[str, Box], atol: float = 1e-9) -> None:
    assert list(found) == list(expected)
    for name, box in expected.items():
        np.testing.assert_allclose(found[name].center_um, box.center_um, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found[name].size_um, box.size_um, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found[name].axes, box.axes, rtol=0, atol=atol)


@given(pose=...)
def test_boxes_are_their_keypoints_and_a_roll(forceps: ToolSpecification, pose: ToolPose) -> None:
    assume(far_from_vertical(pose))
    boxes = link_boxes(pose, forceps)
    found = boxes_from_keypoints(box_keypoints_um(boxes, forceps), forceps, roll_deg=roll_of(boxes["link0"]))
    assert_same(found, boxes)


@given(pose=...)
def test_without_a_roll_boxes_are_the_pose_s_or_are_refused(
    forceps: ToolSpecification, pose: ToolPose
) -> None:
    boxes = link_boxes(pose, forceps)
    positions_um = box_keypoints_um(boxes, forceps)
    (evidence,) = roll_evidence(positions_um, forceps)
    if len(evidence.candidates_deg) == 1:
        assert_same(boxes_from_keypoints(positions_um, forceps), boxes)
    else:
        # Link 2 must all but close for that.
        assert pose.angles_deg["theta2"] < CLEAR_DEG
        with pytest.raises(RollUnknown) as caught:
            boxes_from_keypoints(positions_um, forceps)
        assert caught.value.candidates_deg == evidence.candidates_deg


@given(pose=..., theta2_deg=st.floats(CLEAR_DEG, 90))
def test_an_opened_link_2_shows_the_hinge_and_its_sense(
    forceps: ToolSpecification, pose: ToolPose, theta2_deg: float
) -> None:
    opened = ToolPose(pose.position_um, pose.rotation_wxyz, {**pose.angles_deg, "theta2": theta2_deg})
    positions_um = keypoints_um(opened, forceps)
    boxes = boxes_from_keypoints(positions_um, forceps)
    found = pose_targets(positions_um, forceps, hinge_axes(boxes, forceps))
    for name, turn_deg in opened.angles_deg.items():
        assert found.signed_angles_deg[name] == pytest.approx(turn_deg, abs=1e-9)


@given(pose=..., noise=st.integers(0, 2**32 - 1), roll_deg=st.floats(-180, 180))
def test_boxes_end_at_noisy_keypoints_too(
    forceps: ToolSpecification, pose: ToolPose, noise: int, roll_deg: float
) -> None:
    jitter_um = np.random.default_rng(noise).normal(0, 500.0, (6, 3))
    positions_um = {
        name: tuple(np.add(position_um, off_um))
        for (name, position_um), off_um in zip(keypoints_um(pose, forceps).items(), jitter_um, strict=True)
    }
    boxes = boxes_from_keypoints(positions_um, forceps, roll_deg=roll_deg)
    found = box_keypoints_um(boxes, forceps)
    for name, position_um in positions_um.items():
        np.testing.assert_allclose(found[name], position_um, rtol=0, atol=1e-9)
    for link in forceps.links:
        assert boxes[link.name].size_um[1:] == link.cross_section_um


@pytest.mark.parametrize("theta1_deg", [-40.0, 40.0])
def test_a_bend_alone_leaves_two_rolls(forceps: ToolSpecification, theta1_deg: float) -> None:
    positions_um = keypoints_um(level_pose(25.0, theta1_deg, 0.0), forceps)
    with pytest.raises(RollUnknown, match="the line of its hinge, but not the sense") as caught:
        boxes_from_keypoints(positions_um, forceps)
    assert caught.value.link == "link0"
    assert sorted(caught.value.candidates_deg) == pytest.approx([-155.0, 25.0])
    assert "25.0°" in caught.value.remedy
    assert "-155.0°" in caught.value.remedy
    found = [
        pose_targets(
            positions_um,
            forceps,
            hinge_axes(boxes_from_keypoints(positions_um, forceps, roll_deg=roll_deg), forceps),
        ).signed_angles_deg["theta1"]
        for roll_deg in (25.0, -155.0)
    ]
    assert found == pytest.approx([theta1_deg, -theta1_deg])


@pytest.mark.parametrize("bend_deg", [0.0, 1.5, 3.0])
def test_a_straight_tool_shows_no_roll(forceps: ToolSpecification, bend_deg: float) -> None:
    positions_um = keypoints_um(level_pose(25.0, bend_deg, 0.0), forceps)
    with pytest.raises(RollUnknown, match="no clear bend shows it") as caught:
        boxes_from_keypoints(positions_um, forceps)
    assert caught.value.candidates_deg == ()
    assert boxes_from_keypoints(positions_um, forceps, roll_deg=25.0)


def test_clicks_on_a_straight_tool_are_not_taken_for_a_bend(forceps: ToolSpecification) -> None:
    random = np.random.default_rng(1)
    straight = keypoints_um(level_pose(0.0, 0.0, 0.0), forceps)
    noisy = [
        {
            name: tuple(position_um + random.normal(0, CLICK_NOISE_UM, 3))
            for name, position_um in straight.items()
        }
        for _ in range(300)
    ]
    mistaken = sum(bool(roll_evidence(each, forceps)[0].candidates_deg) for each in noisy)
    assert mistaken <= 2


def test_clicks_on_an_opened_tool_show_its_sense(forceps: ToolSpecification) -> None:
    random = np.random.default_rng(2)
    for theta1_deg in np.linspace(-90, 90, 50):
        pose = level_pose(25.0, theta1_deg, 12.0)
        noisy = {
            name: tuple(position_um + random.normal(0, CLICK_NOISE_UM, 3))
            for name, position_um in keypoints_um(pose, forceps).items()
        }
        (evidence,) = roll_evidence(noisy, forceps)
        assert len(evidence.candidates_deg) == 1
        assert evidence.contradiction_deg(25.0) is None
        assert evidence.contradiction_deg(-155.0) == pytest.approx(180.0, abs=evidence.tolerance_deg)


def test_a_given_roll_is_taken_literally_and_its_contradiction_is_told(forceps: ToolSpecification) -> None:
    positions_um = keypoints_um(level_pose(25.0, 40.0, 30.0), forceps)
    boxes = boxes_from_keypoints(positions_um, forceps, roll_deg=100.0)
    assert roll_of(boxes["link0"]) == pytest.approx(100.0)
    (evidence,) = roll_evidence(positions_um, forceps)
    assert evidence.contradiction_deg(100.0) == pytest.approx(75.0)
    assert evidence.contradiction_deg(26.0) is None
    assert evidence.contradiction_deg(385.0) is None


def test_a_needle_needs_to_be_told_its_roll(needle: ToolSpecification) -> None:
    positions_um = {"shaft": (0.0, 0.0, 0.0), "tip": (0.0, 2000.0, 0.0)}
    with pytest.raises(RollUnknown):
        boxes_from_keypoints(positions_um, needle)
    box = boxes_from_keypoints(positions_um, needle, roll_deg=40.0)["needle"]
    assert yaw_pitch_roll_deg(box.rotation_wxyz) == pytest.approx((90.0, 0.0, 40.0))
    assert box.size_um == (2000.0, 500.0, 500.0)


def test_a_link_needs_both_of_its_ends_at_two_places(forceps: ToolSpecification) -> None:
    positions_um = keypoints_um(level_pose(25.0, 40.0, 30.0), forceps)
    positions_um["k3"] = positions_um["k2"]
    del positions_um["k5"]
    assert list(boxes_from_keypoints(positions_um, forceps, roll_deg=0.0)) == ["link0"]
    assert boxes_from_keypoints({}, forceps) == {}
    assert roll_evidence({}, forceps) == ()


@given(pose=...)
def test_parallel_hinges_carry_the_roll_over_a_link_without_a_box(
    forceps: ToolSpecification, pose: ToolPose
) -> None:
    assume(far_from_vertical(pose))
    boxes = link_boxes(pose, forceps)
    positions_um = keypoints_um(pose, forceps)
    del positions_um["k2"], boxes["link1"]
    assert_same(boxes_from_keypoints(positions_um, forceps, roll_deg=roll_of(boxes["link0"])), boxes)


def test_limits_decide_over_a_link_without_a_box(forceps: ToolSpecification) -> None:
    # Together the joints turn from −90° to 180°: 130° to the other side is out of their reach, 70° is not.
    for theta1_deg, rolls in ((80.0, 1), (20.0, 2)):
        positions_um = keypoints_um(level_pose(25.0, theta1_deg, 50.0), forceps)
        del positions_um["k2"]
        (evidence,) = roll_evidence(positions_um, forceps)
        assert len(evidence.candidates_deg) == rolls
        assert min(abs(roll - 25.0) for roll in evidence.candidates_deg) < 1e-9


def with_joints(tool: ToolSpecification, *changes: dict[str, Any]) -> ToolSpecification:
    fields = tool.model_dump(mode="json")
    for joint, change in zip(fields["joints"], changes, strict=True):
        joint.update(change)
    return ToolSpecification.model_validate(fields)


OBLIQUE = [0.6, 0.0, 0.8]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ([0.0, 1.0, 0.0], [0.0, -1.0, 0.0]),
        ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]),
        ([0.0, 0.6, 0.8], [0.0, 0.0, -1.0]),
        (OBLIQUE, [0.0, 1.0, 0.0]),
        ([0.0, 1.0, 0.0], OBLIQUE),
    ],
)
@given(pose=..., theta2_deg=st.floats(15, 90))
def test_hinges_may_lie_anywhere_in_the_parent(
    forceps: ToolSpecification, first: list[float], second: list[float], pose: ToolPose, theta2_deg: float
) -> None:
    assume(far_from_vertical(pose))
    tool = with_joints(forceps, {"hinge_axis": first}, {"hinge_axis": second})
    opened = ToolPose(pose.position_um, pose.rotation_wxyz, {**pose.angles_deg, "theta2": theta2_deg})
    boxes = link_boxes(opened, tool)
    positions_um = box_keypoints_um(boxes, tool)
    given_roll = boxes_from_keypoints(positions_um, tool, roll_deg=roll_of(boxes["link0"]))
    assert_same(given_roll, boxes, atol=1e-8)
    (evidence,) = roll_evidence(positions_um, tool)
    # The true roll is among the candidates at least; with hinges across their links it is the only one.
    nearest = min(
        abs(math.remainder(roll - roll_of(boxes["link0"]), 360)) for roll in evidence.candidates_deg
    )
    assert nearest < 1e-5
    if OBLIQUE not in (first, second):
        assert len(evidence.candidates_deg) == 1


def test_joints_that_disagree_decide_nothing(forceps: ToolSpecification) -> None:
    tool = with_joints(forceps, {"limits_deg": [0.0, 90.0]}, {})
    positions_um = keypoints_um(level_pose(25.0, -40.0, 30.0), tool)
    (evidence,) = roll_evidence(positions_um, tool)
    assert len(evidence.candidates_deg) == 2


def test_a_hinge_along_its_link_carries_no_roll(forceps: ToolSpecification) -> None:
    tool = with_joints(forceps, {"hinge_axis": [1.0, 0.0, 0.0]}, {})
    positions_um = keypoints_um(level_pose(25.0, 40.0, 30.0), tool)
    straight, opened = roll_evidence(positions_um, tool)
    assert (straight.link, straight.candidates_deg) == ("link0", ())
    assert (opened.link, len(opened.candidates_deg)) == ("link1", 1)
    with pytest.raises(RollUnknown) as caught:
        boxes_from_keypoints(positions_um, tool)
    assert caught.value.link == "link0"


def test_links_that_hang_on_nothing_have_a_roll_of_their_own(
    chain: Callable[..., ToolSpecification],
) -> None:
    fields = chain(2).model_dump(mode="json")
    loose = ToolSpecification.model_validate(fields | {"joints": []})
    positions_um = {"k0": (0.0, 0.0, 0.0), "k1": (1000.0, 0.0, 0.0), "k2": (1000.0, 1000.0, 0.0)}
    assert [evidence.link for evidence in roll_evidence(positions_um, loose)] == ["link0", "link1"]
    boxes = boxes_from_keypoints(positions_um, loose, roll_deg=20.0)
    assert [roll_of(box) for box in boxes.values()] == pytest.approx([20.0, 20.0])


def test_a_link_along_the_hinge_has_a_box_too(forceps: ToolSpecification) -> None:
    # No forceps bend like that, but clicks may lie there.
    positions_um = {
        "k0": (0.0, 0.0, 0.0),
        "k1": (11_000.0, 0.0, 0.0),
        "k2": (11_000.0, 500.0, 0.0),
        "k3": (11_000.0, 5500.0, 0.0),
    }
    boxes = boxes_from_keypoints(positions_um, forceps, roll_deg=0.0)
    np.testing.assert_allclose(boxes["link1"].axes[:, 0], (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(boxes["link1"].axes[:, 2], (0, 0, 1), atol=1e-12)
