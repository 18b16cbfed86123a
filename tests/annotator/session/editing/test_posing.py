"""The tool as one body in the session: begun, and posed by handles and keys."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll, matrix
from annotations.volumes import Ray, write_sidecar
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.session.editing.posed_tool import POSE, STRAIGHT, assert_same

# Beginning


@pytest.mark.parametrize("depth_axis", [0, 2])
def test_a_tool_that_nobody_placed_lies_at_the_crosshair_across_the_light(
    qtbot: QtBot, empty_session: Session, volume_path: Path, depth_axis: int
) -> None:
    write_sidecar(volume_path, (15.9, 13.5, 9.4), depth_axis)  # type: ignore[arg-type]
    session = empty_session
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    session.look(crosshair_um=(159.0, 270.0, 94.0))
    assert session.tool_pose is None
    assert session.solids() == ()
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_mode("pose")
    assert "Drag the tool" in said.args[0]
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == session.view.crosshair_um
    axes = matrix(session.tool_pose.rotation_wxyz)
    np.testing.assert_allclose(axes[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(axes[:, 2], np.eye(3)[depth_axis], atol=1e-12)
    assert len(session.handles()) == 7
    assert {solid.kind for solid in session.solids()} == {"ghost"}
    assert session.undo_stack.count == 0
    session.set_mode("navigate")
    assert session.solids() == (), "nothing is placed that it could be the fit of"


def test_one_keypoint_is_too_little_for_a_fit_but_not_for_posing(session: Session) -> None:
    session.place((100.0, 200.0, 300.0))
    session.set_mode("pose")
    assert session.tool_fit is None
    session.drag_handle("move:link0", (500.0, 500.0, 500.0))
    session.keep_draft()
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == pytest.approx((500.0, 500.0, 500.0))
    assert len(session.document.positions_um) == 6  # type: ignore[union-attr]
    session.undo_stack.undo()
    session.set_mode("place")
    assert session.tool_pose is None, "the last pose is no fit of the one keypoint"


def test_a_tool_without_links_cannot_be_posed(
    qtbot: QtBot, options: SessionOptions, volume_path: Path
) -> None:
    options.user_tool_folder.mkdir()
    (options.user_tool_folder / "marks.toml").write_text(
        'schema = "oct-tool/1"\nname = "marks"\nkeypoints = [{ name = "a" }, { name = "b" }]\n'
    )
    session = Session(replace(options, tool_name="marks"))
    session.set_mode("pose")
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    assert session.view.mode == "navigate", "the volume before may have been posed in"
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_mode("pose")
    assert "no links" in said.args[0]
    assert session.view.mode == "navigate"
    session.place((1.0, 2.0, 3.0))
    assert session.tool_fit is None
    assert session.solids() == ()
    session.shut_down()


def test_a_needle_is_posed_too(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> None:
    session = Session(replace(options, tool_name="needle"))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    session.set_mode("pose")
    before = session.document
    session.bend(0, 10.0)
    assert session.document is before
    session.drag_handle("move:needle", (1000.0, 1000.0, 1000.0))
    session.keep_draft()
    document = session.document
    assert document is not None
    middle_um = np.mean([document.positions_um["tip"], document.positions_um["shaft"]], axis=0)
    assert middle_um == pytest.approx((1000.0, 1000.0, 1000.0))
    session.shut_down()


def test_pose_mode_goes_on_in_the_next_volume_with_a_tool_to_take_hold_of(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    second = volume_path.with_name("v002.npy")
    np.save(second, np.load(volume_path))
    write_sidecar(second, (15.9, 13.5, 9.4), 2)
    session.set_mode("pose")
    session.pose_tool(POSE)
    with qtbot.waitSignal(session.worklist_changed):
        session.open_path(volume_path.parent)
    qtbot.waitUntil(lambda: len(session.items) == 2 and not session.jobs.running)
    with qtbot.waitSignal(session.volume_changed):
        session.next_volume()
    assert session.view.mode == "pose"
    assert session.handles()
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == session.view.crosshair_um
    with qtbot.waitSignal(session.volume_changed):
        session.previous_volume()
    assert_same(session.tool_pose, POSE, at_um=1.0, at_axis=1e-3)


# Posing


def test_a_drag_moves_everything_and_is_one_edit(session: Session) -> None:
    session.set_mode("pose")
    before = session.document
    for x_um in (500.0, 700.0, 900.0):
        session.drag_handle("move:link1", (x_um, 800.0, 400.0))
    assert session.document is before
    assert session.view.draft is not None
    assert session.tool_pose == session.view.draft.pose
    drawn_um = dict(session.shown_positions_um())
    session.keep_draft()
    document = session.document
    assert document is not None
    assert document.positions_um == drawn_um
    assert np.mean([drawn_um["k2"], drawn_um["k3"]], axis=0) == pytest.approx((900.0, 800.0, 400.0))
    assert {part.source for part in document.parts} == {"posed"}
    assert session.undo_stack.count == 1
    assert session.undo_stack.undo_text == "Pose the tool"
    session.undo_stack.undo()
    assert session.document == before


def test_every_gesture_begins_where_the_last_one_ended(posed: Session) -> None:
    posed.drag_handle(
        "bend:theta2",
        keypoints_um(replace(POSE, angles_deg={"theta1": 40.0, "theta2": 70.0}), posed.tool)["k5"],
    )  # type: ignore[arg-type]
    posed.keep_draft()
    assert_same(posed.settled_pose, replace(POSE, angles_deg={"theta1": 40.0, "theta2": 70.0}))
    posed.drag_body("link2", (10.0, 20.0, 30.0))
    posed.keep_draft()
    assert posed.settled_pose is not None
    assert posed.settled_pose.position_um == pytest.approx((3010.0, 4020.0, 2030.0))
    posed.undo_stack.undo()
    posed.undo_stack.undo()
    assert_same(posed.settled_pose, POSE, at_um=1e-2, at_axis=1e-5)


def test_a_drop_takes_the_whole_drag_back(posed: Session) -> None:
    before = posed.document
    posed.drag_handle("swing", (0.0, 0.0, 0.0))
    posed.drop_preview()
    assert posed.document is before
    assert_same(posed.tool_pose, POSE)


def test_undo_in_the_middle_of_a_drag_drops_it(posed: Session) -> None:
    posed.drag_handle("swing", (0.0, 0.0, 0.0))
    posed.undo_stack.undo()
    assert posed.view.draft is None
    assert posed.document.positions_um == {}  # type: ignore[union-attr]
    posed.keep_draft()
    assert posed.document.positions_um == {}  # type: ignore[union-attr]


def test_a_straight_tool_keeps_the_roll_in_which_a_person_left_it(session: Session) -> None:
    session.set_mode("pose")
    session.pose_tool(STRAIGHT)
    assert session.settled_pose == STRAIGHT
    session.nudge(0, 5)
    session.undo_stack.undo()
    # The keypoints hardly hold it, so that the fit from there may turn it a little.
    assert_same(session.settled_pose, STRAIGHT, at_um=1e-2, at_axis=0.02)


def test_a_keypoint_that_is_moved_by_itself_makes_the_fit_count_again(posed: Session) -> None:
    assert posed.settled_pose is POSE
    posed.set_mode("place")
    posed.activate("k5")
    posed.nudge(0, 20)
    assert posed.settled_pose is not POSE
    assert posed.tool_fit is not None
    assert posed.settled_pose == posed.tool_fit.pose
    posed.undo_stack.undo()
    assert posed.settled_pose is POSE


def test_keys_move_turn_and_bend_within_limits(posed: Session) -> None:
    steps = posed.undo_stack.count
    posed.nudge(0, 2)
    assert posed.tool_pose.position_um == pytest.approx((3031.8, 4000.0, 2000.0))  # type: ignore[union-attr]
    posed.turn(0, 10.0)
    posed.bend(0, -10.0)
    posed.bend(1, 80.0)
    pose = posed.tool_pose
    assert pose is not None
    expected = ToolPose(
        (3031.8, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 40.0), {"theta1": 30.0, "theta2": 90.0}
    )
    assert_same(pose, expected)
    assert posed.undo_stack.count == steps + 4
    posed.bend(1, 1.0)
    assert posed.undo_stack.count == steps + 4, "it stands at its limit already"
    posed.bend(2, 1.0)
    assert posed.undo_stack.count == steps + 4, "there is no third joint"


def test_bending_outside_pose_mode_says_how(session: Session, messages: list[str]) -> None:
    session.bend(0, 1.0)
    assert "In pose mode (B)" in messages[-1]


def test_sliders_preview_an_angle_and_keep_the_others(posed: Session) -> None:
    posed.preview_angle("theta1", -20.0)
    posed.preview_angle("theta2", 50.0)
    assert posed.tool_pose is not None
    assert posed.tool_pose.angles_deg == {"theta1": -20.0, "theta2": 50.0}
    steps = posed.undo_stack.count
    posed.keep_draft()
    assert posed.undo_stack.count == steps + 1


def test_clicks_place_nothing(posed: Session, messages: list[str]) -> None:
    before = posed.document
    posed.place((1.0, 2.0, 3.0))
    assert "clicks place nothing" in messages[-1]
    posed.pick_ray(Ray((300.0, 400.0, -5000.0), (0.0, 0.0, 1.0)))
    assert posed.document is before
    assert posed.view.preview is None


@pytest.mark.parametrize(
    "change",
    [
        lambda session: session.drag_handle("move:link0", (0.0, 0.0, 0.0)),
        lambda session: session.drag_body("link0", (1.0, 1.0, 1.0)),
        lambda session: session.nudge(0, 1),
        lambda session: session.turn(0, 1.0),
        lambda session: session.bend(0, 1.0),
    ],
)
def test_a_locked_keypoint_holds_the_whole_tool(
    posed: Session, messages: list[str], change: Callable[[Session], None]
) -> None:
    posed.set_locked("k3", True)
    before = posed.document
    change(posed)
    assert "k3 is locked" in messages[-1]
    assert "Unlock it to move the tool as a whole" in messages[-1]
    assert posed.document is before
    assert posed.view.draft is None


@pytest.mark.parametrize("handle", ["center", "bend:theta3", ""])
def test_a_handle_that_is_not_shown_is_not_dragged(posed: Session, handle: str) -> None:
    posed.drag_handle(handle, (0.0, 0.0, 0.0))
    assert posed.view.draft is None


def test_boxes_follow_and_keep_the_cross_section_that_was_measured(boxes_session: Session) -> None:
    session = boxes_session
    session.free_cross_section("link1", True)
    session.type_box("link1", Box((0.0, 0.0, 0.0), (5000.0, 3900.0, 3800.0), (1.0, 0.0, 0.0, 0.0)))
    session.set_mode("pose")
    session.pose_tool(POSE)
    assert session.document is not None
    assert session.tool is not None
    boxes = session.document.placed_boxes
    for link, box in link_boxes(POSE, session.tool).items():
        assert boxes[link].center_um == pytest.approx(box.center_um)
        np.testing.assert_allclose(boxes[link].axes, box.axes, atol=1e-9)
    assert boxes["link1"].size_um == (5000.0, 3900.0, 3800.0)
    assert session.settled_pose is POSE
    assert session.document.keypoints == ()
    # Of the same body in another roll the keypoints agree, the boxes do not.
    session.set_mode("place")
    session.activate("link0")
    session.turn_over()
    assert session.settled_pose is not POSE
