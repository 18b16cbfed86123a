"""Boxes and the tool in a person's hand: each gesture shows what it makes, and is one edit to be undone."""

import math
from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt

from annotations.geometry.angles import angle_deg
from annotations.geometry.kinematics import keypoints_um

WAY = QPoint(14, -22)
AWAY = QPoint(8, 100)


def undo_exactly(scene, before, index: int) -> None:
    """Check that there was one edit since, and that undoing and redoing it is exact."""
    session, after = scene.session, scene.session.document
    assert session.undo_stack.index == index + 1
    assert after != before
    session.undo_stack.undo()
    assert session.document == before
    session.undo_stack.redo()
    assert session.document == after


def place_of(scene, position_um) -> np.ndarray:
    return scene.picture.project([position_um])[0][:2]


def body_place(scene) -> QPoint:
    """Return a pixel on the body of link 0 that is away from every handle."""
    base, tip = (np.array(scene.session.shown_positions_um()[name]) for name in ("k0", "k1"))
    at = scene.place_of(tuple(base + 0.27 * (tip - base)))
    assert scene.view._hand.handle_at(scene.picture, QPointF(at)) is None
    return at


# Placing boxes


@pytest.mark.parametrize("keeps", [True, False])
def test_two_picks_that_are_kept_place_a_box_in_one_edit(unboxed, keeps: bool) -> None:
    scene, session = unboxed, unboxed.session
    before = session.document
    scene.view.look_from("+z")
    for position_um in ((7000.0, 8000.0, 6000.0), (9000.0, 18000.0, 6000.0)):
        scene.click(scene.place_of(position_um))
        assert session.view.preview is not None
        assert session.document is before
        if keeps:
            session.keep_preview()
    # The next click keeps what the last one proposed.
    session.keep_preview()
    box = session.document.placed_boxes["link0"]
    # Half a link's height beneath the slab's surface, at 6000 µm. A pixel of this picture is some 70 µm wide,
    # and the surface is coarser.
    assert box.base_um == pytest.approx((7000, 8000, 8000), abs=350)
    assert box.tip_um == pytest.approx((9000, 18000, 8000), abs=350)
    assert box.size_um[1:] == (4000.0, 4000.0)
    assert session.view.active_part == "link1"
    undo_exactly(scene, before, 0)


def test_a_click_on_another_box_makes_it_active_where_nothing_waits_for_a_place(boxed) -> None:
    scene, session = boxed, boxed.session
    middle_um = session.document.placed_boxes["link2"].center_um
    before = session.document
    scene.click(scene.place_of(middle_um))
    assert session.view.active_part == "link2"
    assert session.document is before
    session.clear("link2")
    scene.click(scene.place_of(session.document.placed_boxes["link0"].center_um))
    assert session.view.active_part == "link2"


def test_a_click_beside_all_boxes_says_what_could_be_done(boxed) -> None:
    messages: list[str] = []
    boxed.session.message_posted.connect(messages.append)
    before = boxed.session.document
    boxed.click(AWAY)
    assert boxed.session.document is before
    assert boxed.session.view.preview is None
    assert len(messages) == 1


def test_a_click_on_a_sphere_while_navigating_activates_its_link(boxed) -> None:
    boxed.session.set_mode("navigate")
    tip_um = boxed.session.shown_positions_um()["k5"]
    boxed.click(boxed.place_of(tip_um))
    assert boxed.session.view.active_part == "link2"
    assert boxed.session.view.crosshair_um == tip_um


# Handles of a box


@pytest.mark.parametrize("parallel", [True, False])
@pytest.mark.parametrize("name", ["center", "base", "tip", "swing"])
def test_a_dragged_handle_stays_under_the_cursor(boxed, name: str, parallel: bool) -> None:
    scene, session = boxed, boxed.session
    # Not outwards: the knob cannot leave the sphere that it turns on.
    way = QPoint(-16, 9)
    scene.view.set_parallel(parallel)
    before, index = session.document, session.undo_stack.index
    camera, box = scene.view.camera, before.placed_boxes["link0"]
    was = place_of(scene, scene.handle(name).position_um)
    at = scene.place_of(scene.handle(name).position_um) + QPoint(3, 2)
    scene.press(at)
    scene.move(at + way / 2)
    scene.move(at + way)
    assert session.document is before
    assert session.view.draft is not None
    moved = place_of(scene, scene.handle(name).position_um) - was
    assert moved == pytest.approx((way.x(), way.y()), abs=0.5)
    scene.release(at + way)
    assert scene.view.camera == camera
    after = session.document.placed_boxes["link0"]
    assert after.size_um[1:] == pytest.approx(box.size_um[1:])
    stays = {"base": "tip_um", "tip": "base_um", "swing": "center_um", "center": "size_um"}[name]
    assert getattr(after, stays) == pytest.approx(getattr(box, stays), abs=1e-6)
    undo_exactly(scene, before, index)


def test_the_knob_at_its_side_rolls_the_box_about_its_own_axis(boxed) -> None:
    scene, session = boxed, boxed.session
    before, index = session.document, session.undo_stack.index
    box = before.placed_boxes["link0"]
    scene.drag_handle("roll", QPoint(0, -18))
    after = session.document.placed_boxes["link0"]
    assert after.base_um == pytest.approx(box.base_um)
    assert after.tip_um == pytest.approx(box.tip_um)
    assert angle_deg(after.axes[:, 1], box.axes[:, 1]) > 10
    undo_exactly(scene, before, index)


def test_a_face_moves_only_where_the_cross_section_is_free(boxed) -> None:
    scene, session = boxed, boxed.session
    with pytest.raises(KeyError):
        scene.handle("+y")
    session.free_cross_section("link0", True)
    before, index = session.document, session.undo_stack.index
    box = before.placed_boxes["link0"]
    face_um = scene.handle("+y").position_um
    way = place_of(scene, tuple(np.array(face_um) + 1500 * box.axes[:, 1])) - place_of(scene, face_um)
    scene.drag_handle("+y", QPointF(*way).toPoint())
    after = session.document.placed_boxes["link0"]
    assert after.size_um[1] == pytest.approx(box.size_um[1] + 1500, abs=60)
    assert after.size_um[::2] == box.size_um[::2]
    assert after.position_um((0, -0.5, 0)) == pytest.approx(box.position_um((0, -0.5, 0)))
    undo_exactly(scene, before, index)


def test_a_drag_on_a_box_turns_the_camera_and_edits_nothing(boxed) -> None:
    before, camera = boxed.session.document, boxed.view.camera
    boxed.drag(body_place(boxed), WAY)
    assert boxed.view.camera != camera
    assert boxed.session.document is before


@pytest.mark.parametrize("name", ["center", "swing"])
def test_a_press_without_a_way_changes_nothing(boxed, name: str) -> None:
    scene, session = boxed, boxed.session
    before, index, view = session.document, session.undo_stack.index, session.view
    at = scene.place_of(scene.handle(name).position_um)
    scene.click(at)
    scene.drag(at, QPoint(1, 1))
    assert session.document is before
    assert session.undo_stack.index == index
    assert session.view == view


def drop_by_key(scene) -> None:
    scene.qtbot.keyClick(scene.canvas, Qt.Key.Key_Escape)


DROPS = {
    "escape": drop_by_key,
    "undo": lambda scene: scene.session.undo_stack.undo(),
    "mode": lambda scene: scene.session.set_mode("navigate"),
    "another box": lambda scene: scene.session.activate("link1"),
}


@pytest.mark.parametrize("name", DROPS)
def test_what_was_dropped_does_not_come_back_with_the_next_move(boxed, name: str) -> None:
    scene, session = boxed, boxed.session
    at = scene.place_of(scene.handle("center").position_um)
    scene.press(at)
    scene.move(at + WAY)
    assert session.view.draft is not None
    DROPS[name](scene)
    before, index, camera = session.document, session.undo_stack.index, scene.view.camera
    assert session.view.draft is None
    scene.move(at + WAY * 2)
    assert session.view.draft is None
    scene.release(at + WAY * 2)
    assert session.document is before
    assert session.undo_stack.index == index
    assert scene.view.camera == camera


def test_what_changed_between_press_and_move_is_not_dragged(boxed) -> None:
    scene, session = boxed, boxed.session
    at = scene.place_of(scene.handle("center").position_um)
    scene.press(at)
    session.set_mode("navigate")
    before = session.document
    scene.move(at + WAY)
    scene.release(at + WAY)
    assert session.document is before
    assert session.view.draft is None


def test_a_locked_box_has_no_handles(boxed) -> None:
    boxed.session.set_locked("link0", True)
    assert boxed.session.handles() == ()


def test_hidden_handles_cannot_be_held(boxed) -> None:
    scene, session = boxed, boxed.session
    at = scene.place_of(scene.handle("center").position_um)
    before, camera = session.document, scene.view.camera
    session.look(overlays_hidden=True)
    scene.drag(at, WAY)
    assert session.document is before
    assert scene.view.camera != camera


def test_nothing_is_held_while_navigating(boxed) -> None:
    scene, session = boxed, boxed.session
    at = scene.place_of(scene.handle("center").position_um)
    session.set_mode("navigate")
    assert session.handles() == ()
    before, camera = session.document, scene.view.camera
    scene.drag(at, WAY)
    assert session.document is before
    assert scene.view.camera != camera


# The tool as one body


def direction(document) -> np.ndarray:
    return np.subtract(document.positions_um["k1"], document.positions_um["k0"])


def lengths_um(document) -> list[float]:
    positions = list(document.positions_um.values())
    return [math.dist(first, second) for first, second in pairwise(positions)]


@pytest.mark.parametrize("name", ["move:link0", "move:link2"])
def test_a_drag_of_a_link_moves_the_whole_tool(posed, name: str) -> None:
    scene, session = posed, posed.session
    session.set_mode("pose")
    before, index = session.document, session.undo_stack.index
    was = place_of(scene, scene.handle(name).position_um)
    scene.drag_handle(name, WAY)
    assert place_of(scene, scene.handle(name).position_um) - was == pytest.approx((14, -22), abs=0.5)
    moves = np.subtract(list(session.document.positions_um.values()), list(before.positions_um.values()))
    assert np.ptp(moves, axis=0) == pytest.approx((0, 0, 0), abs=1e-3)
    assert {keypoint.source for keypoint in session.document.keypoints} == {"posed"}
    undo_exactly(scene, before, index)


def test_a_drag_of_its_body_moves_the_tool_along_with_the_cursor(posed) -> None:
    scene, session = posed, posed.session
    session.set_mode("pose")
    before, index, camera = session.document, session.undo_stack.index, scene.view.camera
    was = place_of(scene, before.positions_um["k0"])
    scene.drag(body_place(scene), WAY)
    assert scene.view.camera == camera
    assert place_of(scene, session.document.positions_um["k0"]) - was == pytest.approx((14, -22), abs=0.5)
    undo_exactly(scene, before, index)


def test_beside_the_tool_a_drag_turns_the_camera_and_a_click_does_nothing(posed) -> None:
    scene, session = posed, posed.session
    session.set_mode("pose")
    before, view, camera = session.document, session.view, scene.view.camera
    scene.click(AWAY)
    assert session.view == view
    scene.drag(AWAY, QPoint(30, 20))
    assert scene.view.camera != camera
    assert session.document is before


@pytest.mark.parametrize("name", ["swing", "roll"])
def test_the_knobs_turn_the_tool_about_the_middle_of_its_root(posed, name: str) -> None:
    scene, session = posed, posed.session
    session.set_mode("pose")
    before, index = session.document, session.undo_stack.index
    middle_um, axis = session.tool_pose.position_um, direction(before)
    scene.drag_handle(name, QPoint(10, -16))
    assert session.tool_pose.position_um == pytest.approx(middle_um)
    turned_deg = angle_deg(axis, direction(session.document))
    assert turned_deg == pytest.approx(0, abs=1e-6) if name == "roll" else turned_deg > 3
    assert session.document.positions_um["k5"] != before.positions_um["k5"]
    assert lengths_um(session.document) == pytest.approx(lengths_um(before), abs=1e-2)
    undo_exactly(scene, before, index)


def test_the_tip_of_a_link_bends_its_joint(posed) -> None:
    scene, session = posed, posed.session
    scene.view.look_from("+z")
    session.set_mode("pose")
    before, index = session.document, session.undo_stack.index
    bent = session.tool_pose.angles_deg["theta1"]
    at = place_of(scene, scene.handle("bend:theta1").position_um)
    # To where the link's tip is with the joint at another angle.
    pose = session.tool_pose
    wanted = type(pose)(pose.position_um, pose.rotation_wxyz, {**pose.angles_deg, "theta1": bent - 30})
    to = place_of(scene, keypoints_um(wanted, session.tool)["k3"])
    scene.drag_handle("bend:theta1", QPointF(*(to - at)).toPoint())
    assert session.tool_pose.angles_deg["theta1"] == pytest.approx(bent - 30, abs=1)
    assert session.tool_pose.angles_deg["theta2"] == pytest.approx(35, abs=1e-3)
    assert session.document.positions_um["k0"] == pytest.approx(before.positions_um["k0"], abs=1e-3)
    undo_exactly(scene, before, index)


def test_a_joint_is_bent_within_its_limits(posed) -> None:
    scene, session = posed, posed.session
    scene.view.look_from("+z")
    session.set_mode("pose")
    pose = session.tool_pose
    at = place_of(scene, scene.handle("bend:theta2").position_um)
    beyond = type(pose)(pose.position_um, pose.rotation_wxyz, {"theta1": 20.0, "theta2": -40.0})
    to = place_of(scene, keypoints_um(beyond, session.tool)["k5"])
    scene.drag_handle("bend:theta2", QPointF(*(to - at)).toPoint())
    assert session.tool_pose.angles_deg["theta2"] == 0.0


def test_a_tool_that_nobody_has_placed_is_placed_by_moving_it(roomy) -> None:
    scene, session = roomy, roomy.session
    session.set_mode("pose")
    before = session.document
    scene.drag_handle("move:link0", WAY)
    assert all(keypoint.source == "posed" for keypoint in session.document.keypoints)
    undo_exactly(scene, before, 0)


def test_boxes_follow_the_tool_too(boxed) -> None:
    scene, session = boxed, boxed.session
    session.set_mode("pose")
    before, index = session.document, session.undo_stack.index
    scene.drag_handle("move:link1", WAY)
    assert all(box.source == "posed" for box in session.document.boxes)
    undo_exactly(scene, before, index)


def test_escape_leaves_the_tool_where_it_was(posed) -> None:
    scene, session = posed, posed.session
    session.set_mode("pose")
    before, index = session.document, session.undo_stack.index
    at = body_place(scene)
    scene.press(at)
    scene.move(at + WAY)
    assert session.view.draft is not None
    drop_by_key(scene)
    scene.move(at + WAY * 2)
    scene.release(at + WAY * 2)
    assert session.document is before
    assert session.undo_stack.index == index
    assert session.view.draft is None


# What the cursor says


def test_the_cursor_says_what_can_be_held_and_what_is(boxed) -> None:
    scene, session, shape = boxed, boxed.session, Qt.CursorShape
    at = scene.place_of(scene.handle("center").position_um)
    scene.hover(AWAY)
    assert scene.canvas.cursor().shape() == shape.CrossCursor
    scene.hover(at)
    assert scene.canvas.cursor().shape() == shape.OpenHandCursor
    assert scene.canvas.toolTip() == scene.handle("center").hint
    scene.press(at)
    assert scene.canvas.cursor().shape() == shape.ClosedHandCursor
    scene.move(at + WAY)
    scene.release(at + WAY)
    assert scene.canvas.cursor().shape() == shape.OpenHandCursor
    scene.hover(scene.place_of(session.document.placed_boxes["link2"].center_um))
    assert scene.canvas.cursor().shape() == shape.PointingHandCursor
    assert scene.canvas.toolTip() == ""
    session.set_mode("pose")
    scene.hover(body_place(scene))
    assert scene.canvas.cursor().shape() == shape.OpenHandCursor
    scene.hover(AWAY)
    assert scene.canvas.cursor().shape() == shape.ArrowCursor
