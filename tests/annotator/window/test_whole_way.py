"""From the first click to the same document on another day: every way of placing, undone and done again."""

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractSpinBox, QWidget

from annotations.documents.annotation import without_stamps
from annotations.documents.files import load_annotation
from annotations.geometry.frames import Vector
from annotator.scene.picking import Picture
from annotator.session import Session

SPACING_UM = (15.9, 13.5, 9.4)
# The slab of the small volume begins half a voxel before z = 20.
SURFACE_Z_UM = 19.5 * 9.4
# About what a pixel of a slice stands for in a window of the size of the tests.
A_PIXEL_UM = 6.0


def click_scene(person, position_um: Vector) -> None:
    """Click where a position appears in the scene."""
    scene = person.window.scene
    canvas = scene.findChild(QWidget, "scene_canvas")
    picture = Picture(scene.camera, canvas.width(), canvas.height(), canvas.devicePixelRatioF())
    x, y, _ = picture.project([position_um])[0]
    QTest.mouseClick(
        canvas, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(round(x), round(y))
    )


def at_voxel(*index: float) -> Vector:
    x, y, z = (value * step for value, step in zip(index, SPACING_UM, strict=True))
    return (x, y, z)


@pytest.fixture
def scene_window(qtbot, window):
    window.prepare_scene()
    qtbot.waitUntil(lambda: window.scene.findChild(QWidget, "scene_canvas") is not None, timeout=30_000)
    return window


def place_in_slice(person, session: Session, axis: int, position_um: Vector) -> None:
    """Bring a slice to a position, then click it there."""
    session.look(crosshair_um=position_um)
    person.click_slice(axis, position_um)


def test_all_six_are_placed_and_nothing_is_lost(
    qtbot, scene_window, person, session, make_window: Callable
) -> None:
    states = [session.document]
    session.document_changed.connect(lambda _before, after: states.append(after))

    # Slices of all three axes; the next unplaced keypoint becomes the active one by itself.
    person.press(Qt.Key.Key_P)
    for axis, name, index in ((2, "k0", (12, 20, 22)), (1, "k1", (14, 22, 24)), (0, "k2", (16, 26, 26))):
        assert session.view.active_part == name
        place_in_slice(person, session, axis, at_voxel(*index))
        error_um = np.abs(np.subtract(session.document.positions_um[name], at_voxel(*index)))
        assert np.all(error_um <= SPACING_UM)

    # In the scene: one click proposes a depth, Return keeps it.
    session.look(opacity_threshold=100.0)
    person.action("camera_+z").trigger()
    click_scene(person, at_voxel(20, 30, 20))
    assert session.view.preview is not None
    assert "k3" not in session.document.positions_um
    hint = scene_window.status.findChild(QWidget, "status_hint").text()
    assert "Return keeps k3" in hint
    qtbot.waitUntil(lambda: not session.jobs.running)
    person.press(Qt.Key.Key_Return)
    placed_um = session.document.positions_um["k3"]
    assert placed_um[:2] == pytest.approx(at_voxel(20, 30, 20)[:2], abs=15)
    assert placed_um[2] == pytest.approx(SURFACE_Z_UM, abs=9.4)

    # Two clicks from different angles settle a depth that no surface has.
    target_um = at_voxel(22, 32, 27)
    click_scene(person, target_um)
    person.action("camera_+y").trigger()
    click_scene(person, target_um)
    assert np.linalg.norm(np.subtract(session.document.positions_um["k4"], target_um)) < 20

    # Typed, with only the numbers that are there.
    person.press(Qt.Key.Key_6)
    assert session.view.active_part == "k5"
    for letter, value in zip("xyz", ("400.5", "500.25", "210"), strict=True):
        box = scene_window.findChild(QAbstractSpinBox, f"position_{letter}")
        box.setFocus()
        box.selectAll()
        person.type_text(value)
    person.press(Qt.Key.Key_Return)
    assert session.document.positions_um["k5"] == pytest.approx((400.5, 500.25, 210.0))
    assert len(session.document.positions_um) == 6

    # Dragged, and a drag that is taken back.
    start_um = session.document.positions_um["k1"]
    person.slice(2).setFocus()
    person.press(Qt.Key.Key_2)
    aim_um = (start_um[0] + 4 * 15.9, start_um[1] + 3 * 13.5, start_um[2])
    before = session.document
    person.drag_slice(2, start_um, aim_um, release=False)
    assert session.view.preview is not None
    person.press(Qt.Key.Key_Escape)
    assert session.view.preview is None
    assert session.document is before
    QTest.mouseRelease(person.slice(2), Qt.MouseButton.LeftButton)
    assert session.document is before
    person.drag_slice(2, start_um, aim_um)
    moved = session.document.keypoint("k1")
    assert moved.source == "dragged"
    assert moved.position_um == pytest.approx(aim_um, abs=16)

    # Nudged in the plane of the slice used last, across it, and by ten.
    at_um = moved.position_um
    person.press(Qt.Key.Key_Right)
    person.press(Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    person.press(Qt.Key.Key_PageDown)
    person.press(Qt.Key.Key_PageUp, Qt.KeyboardModifier.ShiftModifier)
    nudged_um = session.document.positions_um["k1"]
    assert np.subtract(nudged_um, at_um) == pytest.approx((15.9, 135.0, -9 * 9.4))

    # Judged, and said to be done.
    person.press(Qt.Key.Key_O)
    person.press(Qt.Key.Key_U)
    person.press(Qt.Key.Key_L)
    person.press(Qt.Key.Key_Right)
    assert session.document.positions_um["k1"] == nudged_um
    person.press(Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
    last = session.document
    assert (last.keypoint("k1").state, last.keypoint("k1").certainty) == ("occluded", "unsure")
    assert last.status == "done"

    # Back to the start, and forward again, state by state.
    steps = session.undo_stack.count
    assert steps == len(states) - 1
    for step in range(steps):
        person.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.document == states[steps - 1 - step]
    assert session.document.positions_um == {}
    assert not session.undo_stack.can_undo
    redo = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    for step in range(steps):
        person.press(Qt.Key.Key_Z, redo)
        assert session.document == states[step + 1]
    assert session.document == last

    # Saved and closed; on another day it is the same document.
    path = session.annotation_path
    person.press(Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert not session.unsaved
    scene_window.close()
    assert session.volume is None
    assert without_stamps(load_annotation(path)[0]) == without_stamps(last)
    again = make_window(session)
    again.open_path(path)
    qtbot.waitUntil(lambda: session.document is not None)
    assert without_stamps(session.document) == without_stamps(last)


def handle_um(session: Session, name: str) -> Vector:
    return next(handle.position_um for handle in session.handles() if handle.name == name)


def drag_handle(person, session: Session, axis: int, name: str, by_um: Vector) -> None:
    """Bring a slice to a handle, and drag it by a vector in that slice's plane."""
    start_um = handle_um(session, name)
    session.look(crosshair_um=start_um)
    person.drag_slice(axis, start_um, tuple(np.add(start_um, by_um)))


def go_back_and_forth(person, session: Session, states: list) -> None:
    """Undo everything and do it again, state by state."""
    steps = session.undo_stack.count
    assert steps == len(states) - 1
    for step in range(steps):
        person.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.document == states[steps - 1 - step]
    assert not session.undo_stack.can_undo
    for step in range(steps):
        person.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
        assert session.document == states[step + 1]


def close_and_reopen(qtbot, window, session: Session, make_window: Callable) -> None:
    """Save by key, close the window, and find the same document in another one."""
    last, path = session.document, session.annotation_path
    QTest.keyClick(window.slices[2], Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert not session.unsaved
    window.close()
    assert session.volume is None
    assert without_stamps(load_annotation(path)[0]) == without_stamps(last)
    again = make_window(session)
    again.open_path(path)
    qtbot.waitUntil(lambda: session.document is not None)
    assert without_stamps(session.document) == without_stamps(last)


def test_three_boxes_are_placed_and_nothing_is_lost(
    qtbot, window, person, session, make_window: Callable
) -> None:
    by_boxes = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    with qtbot.waitSignal(session.volume_changed):
        person.press(Qt.Key.Key_B, by_boxes)
    person.slice(2).setFocus()
    states = [session.document]
    session.document_changed.connect(lambda _before, after: states.append(after))

    # Two clicks each, in slices of two axes; the next link becomes the active one by itself.
    person.press(Qt.Key.Key_P)
    for axis, link, base, tip in (
        (2, "link0", (5, 10, 24), (15, 25, 24)),
        (2, "link1", (16, 27, 24), (25, 40, 24)),
        (0, "link2", (26, 42, 24), (26, 52, 40)),
    ):
        assert session.view.active_part == link
        place_in_slice(person, session, axis, at_voxel(*base))
        assert link not in session.document.placed_boxes
        person.click_slice(axis, at_voxel(*tip))
        box = session.document.placed_boxes[link]
        for position_um, index in ((box.base_um, base), (box.tip_um, tip)):
            assert np.all(np.abs(np.subtract(position_um, at_voxel(*index))) <= SPACING_UM)
        assert box.size_um[1:] == session.tool.link(link).cross_section_um

    # An end is dragged, the rest stays; and a drag that is taken back.
    person.press(Qt.Key.Key_1)
    before = session.document.placed_boxes["link0"]
    drag_handle(person, session, 2, "tip", (3 * 15.9, -2 * 13.5, 0.0))
    after = session.document.placed_boxes["link0"]
    assert np.subtract(after.tip_um, before.tip_um) == pytest.approx(
        (3 * 15.9, -2 * 13.5, 0.0), abs=A_PIXEL_UM
    )
    assert after.base_um == pytest.approx(before.base_um, abs=1e-6)
    assert session.document.part("link0").source == "dragged"
    start_um = handle_um(session, "base")
    session.look(crosshair_um=start_um)
    person.drag_slice(2, start_um, tuple(np.add(start_um, (50.0, 0.0, 0.0))), release=False)
    assert session.view.draft is not None
    person.press(Qt.Key.Key_Escape)
    QTest.mouseRelease(person.slice(2), Qt.MouseButton.LeftButton)
    assert session.document.placed_boxes["link0"] == after

    # By keys: turned, moved, turned over, grown; its cross-section freed and changed.
    person.press(Qt.Key.Key_X, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier)
    person.press(Qt.Key.Key_PageDown)
    person.press(Qt.Key.Key_I)
    person.press(Qt.Key.Key_C)
    grown = session.document.placed_boxes["link0"].size_um
    person.press(Qt.Key.Key_Down, Qt.KeyboardModifier.ControlModifier)
    assert session.document.placed_boxes["link0"].size_um != grown

    # Judged, and said to be done.
    person.press(Qt.Key.Key_O)
    person.press(Qt.Key.Key_U)
    person.press(Qt.Key.Key_L)
    person.press(Qt.Key.Key_Right)
    person.press(Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)
    part = session.document.part("link0")
    assert (part.state, part.certainty, part.locked) == ("occluded", "unsure", True)
    assert session.document.status == "done"

    go_back_and_forth(person, session, states)
    close_and_reopen(qtbot, window, session, make_window)
    assert session.document.method == session.method == "boxes"


def test_the_tool_is_posed_as_one_body_and_nothing_is_lost(
    qtbot, window, person, session, make_window: Callable
) -> None:
    states = [session.document]
    session.document_changed.connect(lambda _before, after: states.append(after))
    person.slice(2).setFocus()
    session.look(crosshair_um=at_voxel(20, 30, 25))
    person.press(Qt.Key.Key_B)
    assert session.view.mode == "pose"
    assert len(states) == 1

    # The whole tool is moved by its middle, in a slice; a click places nothing.
    drag_handle(person, session, 2, "move:link0", (4 * 15.9, 3 * 13.5, 0.0))
    placed_um = dict(session.document.positions_um)
    assert set(placed_um) == set(session.tool.keypoint_names)
    assert {part.source for part in session.document.parts} == {"posed"}
    expected_um = np.add(at_voxel(20, 30, 25), (4 * 15.9, 3 * 13.5, 0.0))
    assert np.mean([placed_um["k0"], placed_um["k1"]], axis=0) == pytest.approx(expected_um, abs=A_PIXEL_UM)
    person.click_slice(2, at_voxel(5, 5, 25))
    assert dict(session.document.positions_um) == placed_um

    # Moved along the other axes, turned and bent by keys: every step is one edit of the whole.
    drag_handle(person, session, 0, "move:link0", (0.0, -2 * 13.5, 5 * 9.4))
    person.slice(2).setFocus()
    ten = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    for key in (Qt.Key.Key_X, Qt.Key.Key_Y, Qt.Key.Key_Q, Qt.Key.Key_J, Qt.Key.Key_K):
        person.press(key, ten)
    person.press(Qt.Key.Key_Right)
    assert session.undo_stack.count == 8
    assert session.tool_pose.angles_deg == pytest.approx({"theta1": 10.0, "theta2": 10.0})
    lengths_um = [
        np.linalg.norm(
            np.subtract(session.document.positions_um[link.tip], session.document.positions_um[link.base])
        )
        for link in session.tool.links
    ]
    assert lengths_um == pytest.approx([link.length_um for link in session.tool.links])

    # One locked keypoint holds the whole tool.
    person.press(Qt.Key.Key_4)
    person.press(Qt.Key.Key_L)
    held = session.document
    person.press(Qt.Key.Key_Right)
    assert session.document is held
    assert "k3 is locked" in window.status.currentMessage()
    person.press(Qt.Key.Key_D, Qt.KeyboardModifier.ControlModifier)

    go_back_and_forth(person, session, states)
    close_and_reopen(qtbot, window, session, make_window)
    assert session.tool_fit.pose.angles_deg == pytest.approx({"theta1": 10.0, "theta2": 10.0}, abs=0.01)
