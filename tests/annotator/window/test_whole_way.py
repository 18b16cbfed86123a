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
    steps = session.undo_stack.count()
    assert steps == len(states) - 1
    for step in range(steps):
        person.press(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
        assert session.document == states[steps - 1 - step]
    assert session.document.positions_um == {}
    assert not session.undo_stack.canUndo()
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
