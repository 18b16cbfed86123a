"""The whole tool moved, turned and bent with the mouse on slices, on real views and a real session."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import matrix
from annotator.session import Session
from annotator.slices.slice_view import SliceView

Views = tuple[SliceView, SliceView, SliceView]
WAY = QPoint(22, -13)
NO_MODIFIER = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def posing(placed_tool: Session) -> Session:
    """A session with all keypoints placed, in pose mode."""
    placed_tool.set_mode("pose")
    return placed_tool


@pytest.fixture
def posing_boxes(boxed: Session) -> Session:
    """A session with all boxes placed, in pose mode."""
    boxed.set_mode("pose")
    return boxed


def pose_of(session: Session) -> ToolPose:
    assert session.settled_pose is not None
    return session.settled_pose


def assert_follows(session: Session) -> None:
    """Say that all keypoints or boxes are where the tool's pose has them, as a person posed them."""
    assert session.document is not None
    assert session.tool is not None
    expected_um = keypoints_um(pose_of(session), session.tool)
    assert set(session.shown_positions_um()) == set(expected_um)
    for name, position_um in session.shown_positions_um().items():
        assert position_um == pytest.approx(expected_um[name], abs=1e-3)
    assert {part.source for part in session.document.parts} == {"posed"}


def assert_one_step(session: Session, edits: int, before: object) -> None:
    """Say that one edit was made, and that undoing and redoing it is exact."""
    after = session.document
    assert after != before
    assert session.undo_stack.count == edits + 1
    session.undo_stack.undo()
    assert session.document == before
    session.undo_stack.redo()
    assert session.document == after


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("link", ["link0", "link2"])
def test_the_handle_on_a_link_moves_everything_as_one_body(
    posing: Session, roomy_views: Views, hand: Any, axis: int, link: str
) -> None:
    view, before, was, edits = roomy_views[axis], posing.document, pose_of(posing), posing.undo_stack.count
    start = hand.handle(posing, view, f"move:{link}")

    hand.drag(view, start, start + QPoint(5, 5), start + WAY, release=False)

    assert posing.document is before
    assert posing.view.draft is not None
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + WAY)
    moved_um = np.subtract(pose_of(posing).position_um, was.position_um)
    assert moved_um == pytest.approx(hand.way_um(view, WAY), abs=1e-2)
    assert_follows(posing)
    assert_one_step(posing, edits, before)


@pytest.mark.parametrize("axis", range(3))
def test_a_press_within_the_outline_of_the_tool_moves_it(
    posing: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    assert posing.tool is not None
    view, before, was, edits = roomy_views[axis], posing.document, pose_of(posing), posing.undo_stack.count
    grip_um = link_boxes(was, posing.tool)["link0"].position_um((0.25, 0.2, 0.2))
    posing.look(crosshair_um=grip_um)
    start = hand.pixel(view, grip_um)
    assert view.handle_under(start.x(), start.y(), 8) is None

    hand.drag(view, start, start + QPoint(9, 9), start + WAY)

    moved_um = np.subtract(pose_of(posing).position_um, was.position_um)
    assert moved_um == pytest.approx(hand.way_um(view, WAY), abs=1e-2)
    assert_follows(posing)
    assert_one_step(posing, edits, before)


@pytest.mark.parametrize("joint", ["theta1", "theta2"])
def test_the_handle_at_the_tip_of_a_link_bends_its_joint_alone(
    posing: Session, roomy_views: Views, hand: Any, joint: str
) -> None:
    view, before, was, edits = roomy_views[2], posing.document, pose_of(posing), posing.undo_stack.count
    start = hand.handle(posing, view, f"bend:{joint}")

    hand.drag(view, start, start + QPoint(9, 0), start + QPoint(18, 0))

    now = pose_of(posing)
    other = "theta2" if joint == "theta1" else "theta1"
    assert abs(now.angles_deg[joint] - was.angles_deg[joint]) > 5
    assert now.angles_deg[other] == pytest.approx(was.angles_deg[other], abs=1e-2)
    assert now.position_um == pytest.approx(was.position_um, abs=1e-2)
    assert_follows(posing)
    assert_one_step(posing, edits, before)


def test_the_handle_of_a_joint_stays_under_the_mouse_though_the_hinge_is_oblique(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    view, was = roomy_views[2], pose_of(posing)
    start = hand.handle(posing, view, "bend:theta2")
    wanted = ToolPose(was.position_um, was.rotation_wxyz, {**was.angles_deg, "theta2": 55.0})
    assert posing.tool is not None
    end = hand.pixel(view, keypoints_um(wanted, posing.tool)["k5"])

    hand.drag(view, start, (start + end) / 2, end)

    assert pose_of(posing).angles_deg["theta2"] == pytest.approx(55.0, abs=2.0), "a pixel is about a degree"


@pytest.mark.parametrize("way", [QPoint(150, 100), QPoint(-150, 100), QPoint(-60, -190)])
def test_a_joint_stops_at_its_limits(posing: Session, roomy_views: Views, hand: Any, way: QPoint) -> None:
    view = roomy_views[2]
    start = hand.handle(posing, view, "bend:theta2")

    hand.drag(view, start, start + way / 4, start + way / 2, start + way)

    low, high = (0.0, 90.0)
    assert low - 1e-9 <= pose_of(posing).angles_deg["theta2"] <= high + 1e-9
    assert_follows(posing)


def test_pulling_a_joint_far_beyond_closed_closes_it(posing: Session, roomy_views: Views, hand: Any) -> None:
    view, was = roomy_views[2], pose_of(posing)
    start = hand.handle(posing, view, "bend:theta2")
    closed = ToolPose(was.position_um, was.rotation_wxyz, {**was.angles_deg, "theta2": -30.0})
    assert posing.tool is not None
    beyond = hand.pixel(view, keypoints_um(closed, posing.tool)["k5"])

    hand.drag(view, start, (start + beyond) / 2, beyond)

    assert pose_of(posing).angles_deg["theta2"] == pytest.approx(0.0, abs=1e-6)


def test_the_knob_at_the_base_turns_the_tool_about_the_middle_of_its_first_link(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    view, before, was, edits = roomy_views[2], posing.document, pose_of(posing), posing.undo_stack.count
    start = hand.handle(posing, view, "swing")

    hand.drag(view, start, start + WAY)

    now = pose_of(posing)
    assert now.position_um == pytest.approx(was.position_um, abs=1e-2)
    assert now.angles_deg == pytest.approx(was.angles_deg, abs=1e-2)
    base, towards = matrix(was.rotation_wxyz)[:, 0], matrix(now.rotation_wxyz)[:, 0]
    assert -(towards - base) @ np.array(hand.way_um(view, WAY)) > 0, "the base follows the hand"
    assert_follows(posing)
    assert_one_step(posing, edits, before)


def test_the_knob_at_the_side_turns_the_tool_about_its_axis(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    view, before, was, edits = roomy_views[1], posing.document, pose_of(posing), posing.undo_stack.count
    assert posing.tool is not None
    start = hand.handle(posing, view, "roll")
    aside = hand.pixel(view, link_boxes(was, posing.tool)["link0"].position_um((0.0, 0.7, 0.0)))

    hand.drag(view, start, (start + aside) / 2, aside)

    now = pose_of(posing)
    old, new = matrix(was.rotation_wxyz), matrix(now.rotation_wxyz)
    assert new[:, 0] == pytest.approx(old[:, 0], abs=1e-6)
    assert new[:, 2] @ old[:, 1] == pytest.approx(-1, abs=0.1), "the knob stands off −z"
    assert_follows(posing)
    assert_one_step(posing, edits, before)


@pytest.mark.parametrize("name", ["move:link1", "bend:theta1", "swing"])
def test_boxes_follow_as_one_body_too(
    posing_boxes: Session, roomy_views: Views, hand: Any, name: str
) -> None:
    session, view = posing_boxes, roomy_views[2]
    before, edits = session.document, session.undo_stack.count
    start = hand.handle(session, view, name)

    hand.drag(view, start, start + WAY)

    assert session.document is not None
    assert session.document.method == "boxes"
    assert_follows(session)
    assert_one_step(session, edits, before)


def test_a_tool_that_nobody_has_placed_is_dragged_to_where_it_is(
    roomy_views: Views, empty_session: Session, hand: Any
) -> None:
    session, view = empty_session, roomy_views[2]
    session.set_mode("pose")
    before = session.document
    start = hand.handle(session, view, "move:link0")

    hand.drag(view, start, start + WAY)

    assert_follows(session)
    assert_one_step(session, 0, before)


def test_a_press_and_release_changes_nothing(posing: Session, roomy_views: Views, hand: Any) -> None:
    document, edits, was = posing.document, posing.undo_stack.count, pose_of(posing)
    for name in ("move:link0", "bend:theta1", "bend:theta2", "swing"):
        start = hand.handle(posing, roomy_views[2], name)
        hand.click(roomy_views[2], start)
        hand.drag(roomy_views[2], start, start + QPoint(2, 1))

    assert posing.document is document
    assert posing.undo_stack.count == edits
    assert pose_of(posing) == was
    assert posing.view.draft is None


def test_beside_the_tool_the_mouse_moves_the_crosshair(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    document, view = posing.document, roomy_views[2]
    wanted_um = hand.position_um(view, QPoint(260, 60))

    hand.drag(view, QPoint(250, 40), QPoint(260, 60))

    assert posing.document is document
    assert posing.view.crosshair_um[:2] == pytest.approx(wanted_um[:2])


@pytest.mark.parametrize("name", ["move:link0", "bend:theta2"])
def test_escape_takes_a_drag_back(posing: Session, roomy_views: Views, hand: Any, name: str) -> None:
    view, document, was = roomy_views[2], posing.document, pose_of(posing)
    start = hand.handle(posing, view, name)
    hand.drag(view, start, start + WAY, release=False)
    assert posing.view.draft is not None
    view.setFocus()

    QTest.keyClick(view, Qt.Key.Key_Escape)

    assert posing.view.draft is None
    # The button is still down: neither moving on nor letting go brings the drag back.
    hand.move(view, start + 2 * WAY)
    assert posing.view.draft is None
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + 2 * WAY)
    assert posing.document is document
    assert pose_of(posing) == was


def test_a_locked_keypoint_holds_the_whole_tool_and_says_why_once(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    posing.set_locked("k3", True)
    document, view = posing.document, roomy_views[2]
    said: list[str] = []
    posing.message_posted.connect(said.append)
    start = hand.handle(posing, view, "move:link0")

    hand.move(view, start)
    assert view.cursor().shape() == Qt.CursorShape.ForbiddenCursor
    hand.drag(view, start, start + QPoint(9, 9), start + WAY)

    assert posing.document is document
    assert posing.view.draft is None
    assert len(said) == 1
    assert "k3 is locked" in said[0]


def test_a_drag_keeps_its_hold_when_the_plane_is_scrolled(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    view, was = roomy_views[2], pose_of(posing)
    start = hand.handle(posing, view, "move:link0")
    hand.drag(view, start, start + QPoint(10, 0), release=False)

    hand.wheel(view, -120, start)
    hand.move(view, start + WAY)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + WAY)

    moved_um = np.subtract(pose_of(posing).position_um, was.position_um)
    assert moved_um == pytest.approx(hand.way_um(view, WAY), abs=1e-2)


def test_hidden_overlays_cannot_be_taken_hold_of(posing: Session, roomy_views: Views, hand: Any) -> None:
    view, document = roomy_views[2], posing.document
    start = hand.handle(posing, view, "move:link0")
    posing.look(overlays_hidden=True)

    assert view.handle_under(start.x(), start.y(), 8) is None
    hand.drag(view, start, start + WAY)

    assert posing.document is document
    assert posing.view.draft is None


def test_the_other_buttons_and_the_wheel_do_what_they_always_do(
    posing: Session, roomy_views: Views, hand: Any
) -> None:
    view, document = roomy_views[2], posing.document
    start = hand.handle(posing, view, "move:link0")
    posing.look(window=(50.0, 150.0))
    assert view.viewport is not None
    center_um, index = view.viewport.center_um, view.index

    hand.drag(view, start, start + WAY, button=Qt.MouseButton.RightButton)
    hand.drag(view, start, start + WAY, button=Qt.MouseButton.MiddleButton)
    hand.wheel(view, -120, start)

    assert posing.view.window != (50.0, 150.0)
    assert view.viewport.center_um != center_um
    assert view.index == index + 1
    assert posing.document is document
