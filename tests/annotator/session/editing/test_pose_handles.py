"""What dragging a handle makes of the posed tool: one body that moves, turns and bends within its limits."""

import math
from dataclasses import replace

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given

from annotations.geometry.kinematics import ToolPose, keypoints_um, link_frames
from annotations.geometry.rotations import matrix, quaternion
from annotations.geometry.tool_library import shipped_tools
from annotator.session.editing.box_handles import KNOB_UM, smallest_turn
from annotator.session.editing.pose_handles import (
    bent,
    joint_named,
    moved,
    pose_dragged,
    pose_handles,
    turned,
)

FORCEPS, NEEDLE = shipped_tools()["magnetic-forceps"], shipped_tools()["needle"]
WITHOUT_LINKS = NEEDLE.model_copy(update={"links": (), "joints": ()})

positions = st.tuples(*[st.floats(-20_000, 20_000)] * 3)
rotations = (
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: math.hypot(*values) > 1e-3).map(quaternion)
)
angles = st.fixed_dictionaries({"theta1": st.floats(-90, 90), "theta2": st.floats(0, 90)})
poses = st.builds(ToolPose, positions, rotations, angles)


def position_of(pose: ToolPose, name: str) -> tuple[float, float, float]:
    return next(handle.position_um for handle in pose_handles(pose, FORCEPS) if handle.name == name)


def assert_same(pose: ToolPose, expected: ToolPose) -> None:
    assert pose.position_um == pytest.approx(expected.position_um, abs=1e-6)
    np.testing.assert_allclose(matrix(pose.rotation_wxyz), matrix(expected.rotation_wxyz), atol=1e-9)
    assert dict(pose.angles_deg) == pytest.approx(dict(expected.angles_deg), abs=1e-6)


def test_each_link_moves_two_knobs_turn_and_each_joint_bends() -> None:
    straight = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    handles = {handle.name: handle for handle in pose_handles(straight, FORCEPS)}
    assert {name: handle.kind for name, handle in handles.items()} == {
        "move:link0": "move",
        "move:link1": "move",
        "move:link2": "move",
        "swing": "turn",
        "roll": "turn",
        "bend:theta1": "bend",
        "bend:theta2": "bend",
    }
    assert handles["move:link0"].position_um == (0.0, 0.0, 0.0)
    assert handles["swing"].position_um == (-5500.0 - KNOB_UM, 0.0, 0.0)
    assert handles["roll"].position_um == (0.0, 0.0, -2000.0 - KNOB_UM)
    assert handles["roll"].stem_um == (0.0, 0.0, -2000.0)
    assert handles["bend:theta1"].position_um == pytest.approx(keypoints_um(straight, FORCEPS)["k3"])
    assert handles["bend:theta2"].color == FORCEPS.link("link2").color


def test_a_needle_only_moves_and_turns_and_a_tool_without_links_has_no_handles() -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    assert {handle.name for handle in pose_handles(pose, NEEDLE)} == {"move:needle", "swing", "roll"}
    assert pose_handles(pose, WITHOUT_LINKS) == ()


@given(poses)
def test_dragging_a_handle_to_where_it_is_changes_nothing(pose: ToolPose) -> None:
    for handle in pose_handles(pose, FORCEPS):
        assert_same(pose_dragged(pose, FORCEPS, handle.name, handle.position_um), pose)


@given(poses, positions, st.sampled_from(["link0", "link1", "link2"]))
def test_a_link_lands_where_it_is_dragged_and_everything_moves_with_it(
    pose: ToolPose, to_um: tuple[float, float, float], link: str
) -> None:
    dragged = pose_dragged(pose, FORCEPS, f"move:{link}", to_um)
    assert position_of(dragged, f"move:{link}") == pytest.approx(to_um, abs=1e-6)
    before, after = keypoints_um(pose, FORCEPS), keypoints_um(dragged, FORCEPS)
    ways_um = [np.subtract(after[name], before[name]) for name in before]
    np.testing.assert_allclose(ways_um, [ways_um[0]] * len(ways_um), atol=1e-6)
    assert (dragged.rotation_wxyz, dragged.angles_deg) == (pose.rotation_wxyz, pose.angles_deg)


@given(poses, positions)
def test_swinging_points_the_base_and_keeps_the_middle_and_the_angles(
    pose: ToolPose, to_um: tuple[float, float, float]
) -> None:
    towards = np.subtract(to_um, pose.position_um)
    base = -matrix(pose.rotation_wxyz)[:, 0]
    assume(math.hypot(*towards) > 1 and smallest_turn(base, towards) is not None)
    dragged = pose_dragged(pose, FORCEPS, "swing", to_um)
    assert (dragged.position_um, dragged.angles_deg) == (pose.position_um, pose.angles_deg)
    np.testing.assert_allclose(
        -matrix(dragged.rotation_wxyz)[:, 0], towards / math.hypot(*towards), atol=1e-6
    )


@given(poses, positions)
def test_rolling_keeps_the_root_link_where_it_is(pose: ToolPose, to_um: tuple[float, float, float]) -> None:
    dragged = pose_dragged(pose, FORCEPS, "roll", to_um)
    assert (dragged.position_um, dragged.angles_deg) == (pose.position_um, pose.angles_deg)
    before, after = keypoints_um(pose, FORCEPS), keypoints_um(dragged, FORCEPS)
    for name in ("k0", "k1"):
        assert after[name] == pytest.approx(before[name], abs=1e-5)


@given(poses, st.sampled_from(["theta1", "theta2"]), st.data())
def test_a_joint_bends_to_where_its_tip_is_dragged(pose: ToolPose, name: str, data: st.DataObject) -> None:
    low, high = joint_named(FORCEPS, name).limits_deg
    wanted = bent(pose, joint_named(FORCEPS, name), data.draw(st.floats(low, high)))
    # Farther out, and off the plane in which the tip moves: only the direction in that plane counts.
    frames = link_frames(wanted, FORCEPS)
    joint = joint_named(FORCEPS, name)
    hinge = frames[joint.parent].axes[:, 1]
    aside_um = data.draw(st.floats(-3000, 3000)) * hinge
    farther_um = data.draw(st.floats(0, 5000)) * frames[joint.child].axes[:, 0]
    to_um = tuple(np.asarray(position_of(wanted, f"bend:{name}")) + aside_um + farther_um)
    assert_same(pose_dragged(pose, FORCEPS, f"bend:{name}", to_um), wanted)


@given(poses, positions, st.sampled_from(["theta1", "theta2"]))
def test_bending_keeps_the_limits_and_moves_only_what_hangs_on_the_joint(
    pose: ToolPose, to_um: tuple[float, float, float], name: str
) -> None:
    dragged = pose_dragged(pose, FORCEPS, f"bend:{name}", to_um)
    for joint in FORCEPS.joints:
        assert joint.limits_deg[0] <= dragged.angles_deg[joint.name] <= joint.limits_deg[1]
    assert replace(dragged, angles_deg=pose.angles_deg) == pose
    before, after = keypoints_um(pose, FORCEPS), keypoints_um(dragged, FORCEPS)
    for keypoint in ("k0", "k1") if name == "theta1" else ("k0", "k1", "k2", "k3"):
        assert after[keypoint] == before[keypoint]


@pytest.mark.parametrize(
    ("name", "angle_deg", "kept_deg"),
    [
        ("theta1", 45.0, 45.0),
        ("theta1", 120.0, 90.0),
        ("theta1", -120.0, -90.0),
        ("theta2", -30.0, 0.0),
        # Round the circle 200° is nearer to 90° than to 0°, and −100° nearer to 0°.
        ("theta2", 200.0, 90.0),
        ("theta2", -160.0, 90.0),
        ("theta2", -100.0, 0.0),
    ],
)
def test_a_joint_stops_at_the_limit_that_is_nearest(name: str, angle_deg: float, kept_deg: float) -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 10.0, "theta2": 20.0})
    stopped = bent(pose, joint_named(FORCEPS, name), angle_deg)
    assert stopped.angles_deg == {**pose.angles_deg, name: kept_deg}


def test_a_drag_onto_the_hinge_itself_bends_nothing() -> None:
    pose = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 10.0})
    assert pose_dragged(pose, FORCEPS, "bend:theta1", (5750.0, 0.0, 0.0)) == pose
    assert pose_dragged(pose, FORCEPS, "swing", pose.position_um) == pose


@given(poses, st.integers(0, 2), st.floats(-360, 360))
def test_turns_are_about_the_root_links_own_axes_and_can_be_taken_back(
    pose: ToolPose, axis: int, turn_deg: float
) -> None:
    once = turned(pose, axis, turn_deg)
    assert once.position_um == pose.position_um
    np.testing.assert_allclose(
        matrix(once.rotation_wxyz)[:, axis], matrix(pose.rotation_wxyz)[:, axis], atol=1e-9
    )
    assert_same(turned(once, axis, -turn_deg), pose)


def test_moving_adds_up_and_an_unknown_joint_is_an_error() -> None:
    pose = ToolPose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))
    assert moved(pose, (10.0, 0.0, -1.0)).position_um == (11.0, 2.0, 2.0)
    with pytest.raises(KeyError):
        joint_named(FORCEPS, "theta3")
