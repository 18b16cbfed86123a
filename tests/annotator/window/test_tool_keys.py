"""Keys and menu entries of boxes, pose mode and the fit, in the real window."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLineEdit, QTableWidget

from annotations.documents.files import load_annotation
from annotations.fitting import refine
from annotations.fitting.refine import Refinement
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import from_yaw_pitch_roll, matrix
from annotations.geometry.tool_library import load_tool
from annotator.actions.table import ACTIONS
from annotator.dialogs.annotating.calibration_dialog import CalibrationDialog
from annotator.dialogs.annotating.roll_dialog import RollChoiceDialog, RollEntryDialog
from annotator.dialogs.error_dialog import ErrorDialog

NO_MODIFIER = Qt.KeyboardModifier.NoModifier
CONTROL, SHIFT, ALT = (
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.AltModifier,
)
LYING = Box((300.0, 400.0, 250.0), (500.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)


@pytest.fixture
def boxes(qtbot, person, session):
    """The session with the small volume's boxes open, and that of link 0 placed and active."""
    with qtbot.waitSignal(session.volume_changed):
        person.press(Qt.Key.Key_B, CONTROL | SHIFT)
    session.type_box("link0", LYING)
    session.activate("link0")
    session.set_mode("place")
    person.slice(2).setFocus()
    return session


@pytest.fixture
def posed(person, session):
    """The session in pose mode, with the tool in a pose."""
    person.press(Qt.Key.Key_B)
    session.pose_tool(POSE)
    return session


def box_of(session) -> Box:
    return session.document.placed_boxes["link0"]


def test_every_action_of_the_table_has_a_handler(window):
    # A missing one is a KeyError when the window is made; none is named that the table does not have.
    assert {entry.name for entry in ACTIONS} == {
        action.objectName().removeprefix("action_")
        for action in window.actions()
        if action.objectName().startswith("action_")
    }


def test_methods_by_key_are_remembered(qtbot, person, session, settings):
    with qtbot.waitSignal(session.volume_changed):
        person.press(Qt.Key.Key_B, CONTROL | SHIFT)
    assert session.document.method == "boxes"
    assert settings.method == "boxes"
    assert person.action("method_boxes").isChecked()
    with qtbot.waitSignal(session.volume_changed):
        person.press(Qt.Key.Key_K, CONTROL | SHIFT)
    assert session.document.method == settings.method == "keypoints"
    person.press(Qt.Key.Key_K, CONTROL | SHIFT)
    assert person.action("method_keypoints").isChecked(), "Qt turns a checkable action over by itself"


def test_modes_by_key(person, session):
    for key, mode in ((Qt.Key.Key_B, "pose"), (Qt.Key.Key_P, "place"), (Qt.Key.Key_Escape, "navigate")):
        person.press(key)
        assert session.view.mode == mode
        assert person.action(f"{mode}_mode").isChecked()


def test_escape_drops_what_is_on_its_way_before_it_leaves_the_mode(person, boxes):
    boxes.drag_handle("center", (0.0, 0.0, 0.0))
    person.press(Qt.Key.Key_Escape)
    assert boxes.view.draft is None
    assert boxes.view.mode == "place"
    boxes.activate("link1")
    boxes.place((1.0, 2.0, 3.0))
    person.press(Qt.Key.Key_Escape)
    assert boxes.view.first_end_um is None
    assert boxes.view.mode == "place"
    person.press(Qt.Key.Key_Escape)
    assert boxes.view.mode == "navigate"


def test_return_keeps_a_draft(person, boxes):
    boxes.drag_handle("center", (10.0, 20.0, 30.0))
    person.press(Qt.Key.Key_Return)
    assert box_of(boxes).center_um == (10.0, 20.0, 30.0)


@pytest.mark.parametrize(("key", "axis"), [(Qt.Key.Key_X, 0), (Qt.Key.Key_Y, 1), (Qt.Key.Key_Q, 2)])
def test_turns_by_key(person, boxes, key, axis):
    other, towards = (axis + 1) % 3, (axis + 2) % 3
    whole_deg = 0.0
    for modifiers, turn_deg in (
        (NO_MODIFIER, 1.0),
        (CONTROL | ALT, 10.0),
        (SHIFT, -1.0),
        (CONTROL | ALT | SHIFT, -10.0),
    ):
        person.press(key, modifiers)
        whole_deg += turn_deg
        assert box_of(boxes).axes[towards, other] == pytest.approx(np.sin(np.radians(whole_deg)), abs=1e-12)
        assert box_of(boxes).axes[axis, axis] == pytest.approx(1.0)


def test_turning_over_by_key(person, boxes):
    person.press(Qt.Key.Key_I)
    np.testing.assert_allclose(box_of(boxes).axes, np.diag([1.0, -1.0, -1.0]), atol=1e-12)


def test_faces_by_key(person, boxes):
    person.press(Qt.Key.Key_Right, CONTROL)
    assert box_of(boxes).tip_um[0] == pytest.approx(550.0 + 15.9)
    person.press(Qt.Key.Key_Left, CONTROL | SHIFT)
    assert box_of(boxes).base_um[0] == pytest.approx(50.0 - 159.0)
    person.press(Qt.Key.Key_Right, ALT)
    assert box_of(boxes).base_um[0] == pytest.approx(50.0 - 159.0 + 15.9)
    person.press(Qt.Key.Key_Left, ALT | SHIFT)
    assert box_of(boxes).tip_um[0] == pytest.approx(550.0 + 15.9 - 159.0)


def test_the_cross_section_is_freed_by_key(person, boxes):
    person.press(Qt.Key.Key_Down, CONTROL)
    assert "cross-section of link0 is fixed" in person.window.status.currentMessage()
    person.press(Qt.Key.Key_C)
    assert person.action("free_cross_section").isChecked()
    person.press(Qt.Key.Key_Down, CONTROL)
    assert box_of(boxes).size_um[1] == pytest.approx(4013.5)
    person.press(Qt.Key.Key_C)
    assert boxes.view.free_links == frozenset()


def test_arrows_move_the_box_and_number_keys_choose_links(person, boxes):
    person.press(Qt.Key.Key_Right, SHIFT)
    assert box_of(boxes).center_um == pytest.approx((459.0, 400.0, 250.0))
    person.press(Qt.Key.Key_3)
    assert boxes.view.active_part == "link2"
    person.press(Qt.Key.Key_1)
    assert boxes.view.active_part == "link0"
    assert boxes.view.crosshair_um == pytest.approx((459.0, 400.0, 250.0))
    person.press(Qt.Key.Key_Delete)
    assert boxes.document.placed_boxes == {}


def test_bends_by_key(person, posed):
    steps = (
        (Qt.Key.Key_J, NO_MODIFIER, (41.0, 25.0)),
        (Qt.Key.Key_J, CONTROL | ALT, (51.0, 25.0)),
        (Qt.Key.Key_J, SHIFT, (50.0, 25.0)),
        (Qt.Key.Key_K, NO_MODIFIER, (50.0, 26.0)),
        (Qt.Key.Key_K, CONTROL | ALT | SHIFT, (50.0, 16.0)),
    )
    for number, (key, modifiers, angles_deg) in enumerate(steps, start=2):
        person.press(key, modifiers)
        pose = posed.settled_pose
        assert (pose.angles_deg["theta1"], pose.angles_deg["theta2"]) == pytest.approx(angles_deg)
        assert posed.undo_stack.count == number


def test_bends_only_in_pose_mode(person, posed):
    person.press(Qt.Key.Key_P)
    assert not person.action("bend_1").isEnabled()
    person.press(Qt.Key.Key_J)
    assert posed.undo_stack.count == 1


def test_the_tool_is_moved_and_turned_by_key(person, posed):
    person.press(Qt.Key.Key_Right)
    person.press(Qt.Key.Key_X, CONTROL | ALT)
    pose = posed.settled_pose
    assert pose.position_um == pytest.approx((3015.9, 4000.0, 2000.0))
    np.testing.assert_allclose(
        matrix(pose.rotation_wxyz), matrix(from_yaw_pitch_roll(20.0, 10.0, 40.0)), atol=1e-9
    )


def test_filling_in_by_key(person, session):
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name != "k4":
            session.place(position_um, keypoint=name)
    person.press(Qt.Key.Key_I, CONTROL)
    assert session.document.keypoint("k4").source == "fitted"


def test_the_other_solution_by_key(person, session):
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name not in ("k4", "k5"):
            session.place(position_um, keypoint=name)
    first, other = session.tool_fit.pose, session.tool_fit.alternatives[0]
    person.press(Qt.Key.Key_O, CONTROL | ALT)
    assert session.settled_pose == other
    # Link 2 is closed in it, so that both explain all six keypoints still: the key leads back.
    person.press(Qt.Key.Key_O, CONTROL | ALT)
    np.testing.assert_allclose(
        matrix(session.settled_pose.rotation_wxyz), matrix(first.rotation_wxyz), atol=1e-3
    )


@pytest.mark.parametrize(("key", "accepted"), [(Qt.Key.Key_Return, True), (Qt.Key.Key_Escape, False)])
def test_refining_by_key(qtbot, person, posed, monkeypatch, key, accepted):
    found = Refinement(ToolPose((3100.0, 4000.0, 2000.0), POSE.rotation_wxyz), {}, {}, 2.0, 1.0, "")
    monkeypatch.setattr(refine, "refine_pose", lambda *_, **__: found)
    before = posed.document
    person.press(Qt.Key.Key_R, CONTROL)
    qtbot.waitUntil(lambda: posed.view.refinement is not None)
    person.slice(2).setFocus()
    person.press(key)
    assert posed.view.refinement is None
    assert (posed.document is not before) == accepted
    assert posed.view.mode == "pose"


def test_every_relabelling_by_key(qtbot, person, posed):
    qtbot.waitUntil(lambda: not posed.is_searching_mistakes)
    person.press(Qt.Key.Key_K, CONTROL)
    assert posed.is_searching_mistakes
    qtbot.waitUntil(lambda: not posed.is_searching_mistakes)


class TestDeriving:
    def place(self, session, pose):
        for name, position_um in keypoints_um(pose, session.tool).items():
            session.place(position_um, keypoint=name)

    def test_by_key_where_the_roll_shows(self, qtbot, person, posed):
        with qtbot.waitSignal(posed.volume_changed):
            person.press(Qt.Key.Key_E, CONTROL)
        assert posed.document.method == "boxes"
        assert not person.has_dialog()

    def test_the_sense_of_the_hinge_is_chosen(self, qtbot, person, session):
        self.place(session, ToolPose(POSE.position_um, POSE.rotation_wxyz, {"theta1": 40.0}))
        person.press(Qt.Key.Key_E, CONTROL)
        dialog = person.dialog(RollChoiceDialog)
        number = next(
            number for number, meaning in enumerate(dialog._meanings) if meaning.angles_deg["theta1"] > 0
        )
        with qtbot.waitSignal(session.volume_changed):
            person.click(dialog, f"roll_{number}")
        assert session.document.derived_from.roll_deg == pytest.approx(30.0)

    def test_the_roll_of_a_straight_tool_is_typed(self, qtbot, person, session):
        self.place(session, ToolPose(POSE.position_um, POSE.rotation_wxyz))
        person.press(Qt.Key.Key_E, CONTROL)
        dialog = person.dialog(RollEntryDialog)
        qtbot.keyClicks(dialog.findChild(QLineEdit, "roll_field"), "65")
        with qtbot.waitSignal(session.volume_changed):
            person.click(dialog, "roll_ok")
        assert session.document.derived_from.roll_deg == 65.0

    def test_deriving_nothing_leaves_all_as_it_is(self, person, session):
        self.place(session, ToolPose(POSE.position_um, POSE.rotation_wxyz))
        person.press(Qt.Key.Key_E, CONTROL)
        person.click(person.dialog(RollEntryDialog), "roll_cancel")
        assert session.document.method == "keypoints"
        assert not session.annotation_path.with_name("v001.npy.boxes.json").exists()

    def test_an_annotation_that_is_there_is_said(self, qtbot, person, posed):
        with qtbot.waitSignal(posed.volume_changed):
            person.press(Qt.Key.Key_E, CONTROL)
        with qtbot.waitSignal(posed.volume_changed):
            person.press(Qt.Key.Key_K, CONTROL | SHIFT)
        person.press(Qt.Key.Key_E, CONTROL)
        person.click(person.dialog(ErrorDialog), "error_close")
        assert posed.document.method == "keypoints"
        assert set(load_annotation(posed.annotation_path)[0].positions_um) == set(posed.tool.keypoint_names)


class TestCalibrating:
    def test_the_new_specification_is_written(self, qtbot, person, session, options):
        session.place((100.0, 200.0, 300.0), keypoint="k0")
        session.place((10_600.0, 200.0, 300.0), keypoint="k1")
        session.set_status("done")
        document = session.document
        person.press(Qt.Key.Key_C, CONTROL | ALT)
        dialog = person.dialog(CalibrationDialog)
        table = dialog.findChild(QTableWidget, "calibration_table")
        assert [table.item(0, column).text() for column in (0, 1, 3)] == ["link0", "length", "10500.0"]
        person.click(dialog, "calibration_ok")
        written = load_tool(options.user_tool_folder / "magnetic-forceps-calibrated.toml")
        assert written.link("link0").length_um == 10_500.0
        assert "is written to" in person.window.status.currentMessage()
        assert session.document is document

    def test_nothing_is_written_without_finished_annotations(self, person, session, options):
        person.press(Qt.Key.Key_C, CONTROL | ALT)
        dialog = person.dialog(CalibrationDialog)
        assert not dialog.findChild(QTableWidget, "calibration_table").isHidden()
        person.click(dialog, "calibration_cancel")
        assert not options.user_tool_folder.exists()
