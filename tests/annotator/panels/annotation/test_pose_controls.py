"""Posing by sliders and numbers: live while it moves, one step when it is let go."""

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QLabel, QStyle, QStyleOptionSlider, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import from_yaw_pitch_roll, yaw_pitch_roll_deg
from annotator.panels.annotation.joint_slider import JointSlider
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.panels.widgets.number_fields import NumberField
from annotator.session import Session

LEFT = Qt.MouseButton.LeftButton
POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> PosePanel:
    """The panel in pose mode, with the tool posed."""
    session.set_mode("pose")
    session.pose_tool(POSE)
    panel = PosePanel(session)
    qtbot.addWidget(panel)
    panel.resize(360, 1200)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    return panel


def slider(panel: PosePanel, joint: str = "theta1") -> JointSlider:
    found = panel.findChild(JointSlider, f"pose_{joint}_slider")
    assert isinstance(found, JointSlider)
    return found


def field(panel: PosePanel, name: str) -> NumberField:
    found = panel.findChild(NumberField, f"pose_{name}")
    assert isinstance(found, NumberField)
    return found


def knob(of: JointSlider) -> QPoint:
    option = QStyleOptionSlider()
    of.initStyleOption(option)
    return of.style().subControlRect(
        QStyle.ComplexControl.CC_Slider, option, QStyle.SubControl.SC_SliderHandle, of
    ).center()  # fmt: skip


def angle_deg(session: Session, joint: str = "theta1") -> float:
    assert session.tool_pose is not None
    return session.tool_pose.angles_deg[joint]


def test_the_controls_come_with_pose_mode(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    enter = panel.findChild(QToolButton, "pose_enter")
    assert isinstance(enter, QToolButton)
    assert enter.isChecked()
    assert slider(panel).isVisible()
    qtbot.mouseClick(enter, LEFT)
    assert session.view.mode == "navigate"
    assert not slider(panel).isVisible()
    session.set_mode("pose")
    assert enter.isChecked()
    assert slider(panel).isVisible()


def test_they_show_the_pose_and_follow_a_drag_elsewhere(session: Session, panel: PosePanel) -> None:
    assert slider(panel).value() == 400
    assert (slider(panel).minimum(), slider(panel).maximum()) == (-900, 900)
    assert field(panel, "theta2_number").value() == pytest.approx(25.0)
    assert field(panel, "x").value() == pytest.approx(3000.0)
    assert field(panel, "roll").value() == pytest.approx(30.0)
    session.drag_body("link0", (100.0, 0.0, 0.0))
    assert field(panel, "x").value() == pytest.approx(3100.0)
    session.drop_preview()
    assert field(panel, "x").value() == pytest.approx(3000.0)


def test_a_slider_previews_while_it_is_in_hand_and_is_one_step_when_let_go(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    moved, before, steps = slider(panel), session.document, session.undo_stack.count
    start = knob(moved)
    qtbot.mousePress(moved, LEFT, pos=start)
    for by in (-10, -20, -30):
        qtbot.mouseMove(moved, start + QPoint(by, 0))
        assert session.document is before
    assert angle_deg(session) < 39.0
    assert field(panel, "theta1_number").value() == pytest.approx(angle_deg(session), abs=0.01)
    qtbot.mouseRelease(moved, LEFT, pos=start + QPoint(-30, 0))
    assert session.undo_stack.count == steps + 1
    assert session.view.draft is None
    assert angle_deg(session) == moved.value() / 10
    assert {part.source for part in session.document.parts} == {"posed"}  # type: ignore[union-attr]
    session.undo_stack.undo()
    assert moved.value() == 400


def test_a_slider_in_hand_that_esc_dropped_does_not_come_back(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    moved, before, steps = slider(panel), session.document, session.undo_stack.count
    start = knob(moved)
    qtbot.mousePress(moved, LEFT, pos=start)
    qtbot.mouseMove(moved, start + QPoint(-10, 0))
    assert session.view.draft is not None
    session.drop_preview()
    qtbot.mouseMove(moved, start + QPoint(-20, 0))
    assert session.view.draft is None
    assert moved.value() == 400
    qtbot.mouseRelease(moved, LEFT, pos=start + QPoint(-20, 0))
    assert session.document is before
    assert session.undo_stack.count == steps
    qtbot.mousePress(moved, LEFT, pos=start)
    qtbot.mouseMove(moved, start + QPoint(-10, 0))
    qtbot.mouseRelease(moved, LEFT, pos=start + QPoint(-10, 0))
    assert session.undo_stack.count == steps + 1


def test_a_press_without_a_move_changes_nothing(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    steps = session.undo_stack.count
    qtbot.mouseClick(slider(panel), LEFT, pos=knob(slider(panel)))
    assert session.undo_stack.count == steps


def test_keys_on_a_slider_are_one_step_once_they_rest(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    steps = session.undo_stack.count
    slider(panel).setFocus()
    for _ in range(3):
        qtbot.keyClick(slider(panel), Qt.Key.Key_Right)
    assert session.undo_stack.count == steps
    assert angle_deg(session) == pytest.approx(43.0)
    qtbot.waitUntil(lambda: session.undo_stack.count == steps + 1)
    assert angle_deg(session) == pytest.approx(43.0)


def test_going_on_to_the_next_slider_loses_nothing(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    slider(panel).setFocus()
    qtbot.keyClick(slider(panel), Qt.Key.Key_Right)
    slider(panel, "theta2").setFocus()
    qtbot.keyClick(slider(panel, "theta2"), Qt.Key.Key_Right)
    assert (angle_deg(session), angle_deg(session, "theta2")) == pytest.approx((41.0, 26.0))


def test_saving_keeps_what_has_not_come_to_rest(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    slider(panel).setFocus()
    qtbot.keyClick(slider(panel), Qt.Key.Key_Right)
    assert session.save()
    assert session.view.draft is None
    assert angle_deg(session) == pytest.approx(41.0)
    assert not session.unsaved


@pytest.mark.parametrize(
    ("name", "typed", "index"), [("x", "3500", 0), ("z", "-12.5", 2), ("yaw", "-45", 3), ("roll", "170", 5)]
)
def test_a_typed_number_is_one_step(
    qtbot: QtBot, session: Session, panel: PosePanel, name: str, typed: str, index: int
) -> None:
    steps, number = session.undo_stack.count, field(panel, name)
    number.setFocus()
    number.selectAll()
    qtbot.keyClicks(number, typed)
    qtbot.keyClick(number, Qt.Key.Key_Return)
    assert session.undo_stack.count == steps + 1
    pose = session.tool_pose
    assert pose is not None
    expected = [*POSE.position_um, *yaw_pitch_roll_deg(POSE.rotation_wxyz)]
    expected[index] = float(typed)
    assert [*pose.position_um, *yaw_pitch_roll_deg(pose.rotation_wxyz)] == pytest.approx(expected)
    session.undo_stack.undo()
    assert number.value() == pytest.approx([*POSE.position_um, 20.0, 10.0, 30.0][index])


def test_a_typed_angle_keeps_its_limits(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    number = field(panel, "theta2_number")
    number.setFocus()
    number.selectAll()
    qtbot.keyClicks(number, "60")
    qtbot.keyClick(number, Qt.Key.Key_Return)
    assert angle_deg(session, "theta2") == pytest.approx(60.0)
    assert (number.minimum(), number.maximum()) == (0.0, 90.0)


def test_enter_on_a_rounded_number_is_no_wish_to_round(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    session.pose_tool(ToolPose((3000.12345, 4000.0, 2000.0), POSE.rotation_wxyz, POSE.angles_deg))
    steps = session.undo_stack.count
    field(panel, "x").setFocus()
    qtbot.keyClick(field(panel, "x"), Qt.Key.Key_Return)
    assert session.undo_stack.count == steps


def test_escape_drops_what_is_typed(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    steps, number = session.undo_stack.count, field(panel, "y")
    number.setFocus()
    number.selectAll()
    qtbot.keyClicks(number, "900")
    qtbot.keyClick(number, Qt.Key.Key_Escape)
    assert session.view.draft is None
    assert number.value() == pytest.approx(4000.0)
    assert session.undo_stack.count == steps


def test_locked_keypoints_refuse_and_the_slider_goes_back(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    locked = panel.findChild(QLabel, "pose_locked")
    assert isinstance(locked, QLabel)
    assert not locked.isVisible()
    session.set_locked("k2", True)
    assert "k2" in locked.text()
    assert locked.isVisible()
    steps = session.undo_stack.count
    slider(panel).setFocus()
    with qtbot.waitSignal(session.message_posted) as said:
        qtbot.keyClick(slider(panel), Qt.Key.Key_Right)
    assert "k2 is locked" in said.args[0]
    assert slider(panel).value() == 400
    assert session.undo_stack.count == steps


def test_nothing_of_the_panel_is_cut_off_at_its_usual_width(qtbot: QtBot, panel: PosePanel) -> None:
    content = panel.findChild(QWidget, "pose_scroll")
    assert content is not None
    for name in ("theta1_number", "theta2_number", "yaw", "roll"):
        right = field(panel, name).mapTo(panel, field(panel, name).rect().topRight()).x()
        assert right < panel.width()
