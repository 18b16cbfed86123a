"""Typing and stepping the active keypoint's position: live, and one step of undo."""

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QDoubleSpinBox, QLabel, QLineEdit, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry.frames import Vector
from annotator.panels.annotation.position_editor import PositionEditor
from annotator.session import Session

K0_UM: Vector = (159.0, 135.0, 94.0)


class Frame(QWidget):
    """Stands for the window: notes the keys that nobody wanted."""

    def __init__(self) -> None:
        super().__init__()
        self.keys: list[int] = []

    def keyPressEvent(self, event: QKeyEvent) -> None:
        self.keys.append(event.key())


@pytest.fixture
def frame(qtbot: QtBot, session: Session) -> Frame:
    """The editor with k0 placed and active, and another field to leave it for."""
    session.place(K0_UM, "clicked", "k0")
    session.activate("k0")
    frame = Frame()
    qtbot.addWidget(frame)
    layout = QVBoxLayout(frame)
    layout.addWidget(PositionEditor(session))
    layout.addWidget(QLineEdit())
    with qtbot.waitActive(frame):
        frame.show()
        frame.activateWindow()
    return frame


def box(frame: QWidget, axis: str) -> QDoubleSpinBox:
    found = frame.findChild(QDoubleSpinBox, f"position_{axis}")
    assert isinstance(found, QDoubleSpinBox)
    return found


def type_text(qtbot: QtBot, target: QDoubleSpinBox, text: str) -> None:
    target.setFocus()
    target.selectAll()
    qtbot.keyClicks(target, text)


def placed(session: Session, name: str = "k0") -> Vector | None:
    assert session.document is not None
    return session.document.keypoint(name).position_um


def test_the_boxes_show_the_active_part(session: Session, frame: QWidget) -> None:
    assert [box(frame, axis).value() for axis in "xyz"] == list(K0_UM)
    assert [box(frame, axis).singleStep() for axis in "xyz"] == [15.9, 13.5, 9.4]
    session.nudge(0, 1)
    assert box(frame, "x").value() == pytest.approx(174.9)


def test_typing_moves_everything_and_enter_keeps_it_in_one_step(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    steps = session.undo_stack.count
    type_text(qtbot, box(frame, "x"), "250.5")
    assert session.shown_positions_um()["k0"] == (250.5, 135.0, 94.0)
    assert session.view.crosshair_um == (250.5, 135.0, 94.0)
    assert placed(session) == K0_UM
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Return)
    assert placed(session) == (250.5, 135.0, 94.0)
    assert session.view.preview is None
    assert session.undo_stack.count == steps + 1
    assert session.view.active_part == "k0"
    session.undo_stack.undo()
    assert placed(session) == K0_UM


def test_escape_drops_what_was_typed(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    steps = session.undo_stack.count
    type_text(qtbot, box(frame, "y"), "400")
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Escape)
    assert session.view.preview is None
    assert placed(session) == K0_UM
    assert box(frame, "y").value() == 135.0
    assert session.undo_stack.count == steps


def test_escape_goes_on_to_the_window_when_there_is_nothing_to_drop(qtbot: QtBot, frame: Frame) -> None:
    type_text(qtbot, box(frame, "y"), "400")
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Escape)
    assert frame.keys == []
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Escape)
    assert frame.keys == [Qt.Key.Key_Escape]
    assert box(frame, "y").value() == 135.0


def test_x_y_and_z_typed_in_a_row_are_one_step(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    session.activate("k3")
    steps = session.undo_stack.count
    type_text(qtbot, box(frame, "x"), "100")
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Tab)
    type_text(qtbot, box(frame, "y"), "200")
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Tab)
    type_text(qtbot, box(frame, "z"), "300")
    assert placed(session, "k3") is None
    qtbot.keyClick(box(frame, "z"), Qt.Key.Key_Return)
    assert placed(session, "k3") == (100.0, 200.0, 300.0)
    assert session.undo_stack.count == steps + 1
    assert session.view.active_part == "k3"


def test_leaving_the_boxes_keeps_what_was_typed(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    type_text(qtbot, box(frame, "z"), "200")
    other = frame.findChildren(QLineEdit, options=Qt.FindChildOption.FindDirectChildrenOnly)[0]
    other.setFocus()
    qtbot.waitUntil(lambda: placed(session) == (159.0, 135.0, 200.0))
    assert session.undo_stack.undo_text == "Type k0"


def test_steps_are_one_voxel_and_become_one_edit_when_they_rest(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    steps = session.undo_stack.count
    box(frame, "x").setFocus()
    for _ in range(3):
        qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Up)
    assert placed(session) == K0_UM
    assert session.shown_positions_um()["k0"][0] == pytest.approx(159 + 3 * 15.9)
    qtbot.waitUntil(lambda: session.view.preview is None)
    assert placed(session) == pytest.approx((159 + 3 * 15.9, 135.0, 94.0))
    assert session.undo_stack.count == steps + 1


def test_a_pause_while_typing_keeps_nothing(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    box(frame, "x").setFocus()
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Up)
    type_text(qtbot, box(frame, "x"), "2")
    editor = frame.findChild(PositionEditor)
    assert isinstance(editor, PositionEditor)
    assert not editor._fields.is_resting
    assert placed(session) == K0_UM


def test_voxels_are_typed_where_voxels_are_shown(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    editor = frame.findChild(PositionEditor)
    assert isinstance(editor, PositionEditor)
    editor.set_unit("voxel")
    assert [box(frame, axis).value() for axis in "xyz"] == [10.0, 10.0, 10.0]
    assert box(frame, "x").singleStep() == 1.0
    type_text(qtbot, box(frame, "x"), "20")
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Return)
    assert placed(session) == pytest.approx((318.0, 135.0, 94.0))


def test_an_exact_position_is_not_rounded_by_being_shown(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    exact: Vector = (100.123456, 200.987654, 50.555555)
    session.type_position("k0", exact)
    for axis in "xyz":
        box(frame, axis).setFocus()
        qtbot.keyClick(box(frame, axis), Qt.Key.Key_Return)
    assert placed(session) == exact
    type_text(qtbot, box(frame, "y"), "210")
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Return)
    assert placed(session) == (exact[0], 210.0, exact[2])


def test_a_typed_comma_is_a_point_and_a_pasted_one_is_refused(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    type_text(qtbot, box(frame, "x"), "12,5")
    assert box(frame, "x").text() == "12.5"
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_Return)
    assert placed(session) == (12.5, 135.0, 94.0)
    QApplication.clipboard().setText("1,234")
    box(frame, "x").selectAll()
    qtbot.keyClick(box(frame, "x"), Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert box(frame, "x").value() == 12.5
    assert placed(session) == (12.5, 135.0, 94.0)


@pytest.mark.parametrize("wrong", ["abc", "1e5"])
def test_wrong_characters_are_not_taken(qtbot: QtBot, session: Session, frame: QWidget, wrong: str) -> None:
    target = box(frame, "x")
    target.setFocus()
    target.selectAll()
    qtbot.keyClicks(target, wrong)
    assert set(target.text()) <= set("0123456789.-")


def test_a_locked_keypoint_cannot_be_typed(session: Session, frame: QWidget) -> None:
    session.set_locked("k0", True)
    assert not any(box(frame, axis).isEnabled() for axis in "xyz")
    title = frame.findChild(QLabel, "position_title")
    assert isinstance(title, QLabel)
    assert "locked" in title.text()


def test_without_an_active_part_there_is_nothing_to_type(session: Session, frame: QWidget) -> None:
    session.activate(None)
    assert not box(frame, "x").isEnabled()
    title = frame.findChild(QLabel, "position_title")
    assert isinstance(title, QLabel)
    assert "number key" in title.text()


def test_an_unplaced_keypoint_begins_at_the_crosshair(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    session.look(crosshair_um=(159.0, 270.0, 188.0))
    session.activate("k5")
    assert [box(frame, axis).value() for axis in "xyz"] == [159.0, 270.0, 188.0]
    box(frame, "y").setFocus()
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Down)
    qtbot.keyClick(box(frame, "y"), Qt.Key.Key_Return)
    assert placed(session, "k5") == pytest.approx((159.0, 256.5, 188.0))


def test_the_wheel_passes_over_boxes_without_focus(session: Session, frame: QWidget) -> None:
    target = box(frame, "x")
    target.clearFocus()
    middle = QPointF(target.rect().center())
    event = QWheelEvent(
        middle,
        target.mapToGlobal(middle),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(target, event)
    assert session.view.preview is None
    target.setFocus()
    QApplication.sendEvent(target, event)
    assert session.view.preview is not None


def test_closing_the_volume_empties_the_boxes_and_opening_it_again_fills_them(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    boxes = [frame.findChild(QDoubleSpinBox, f"position_{letter}") for letter in "xyz"]
    shown = [box.text() for box in boxes]
    assert all(shown)
    assert session.volume is not None
    path = session.volume.path
    session.save()
    session.close_volume()
    assert [box.text() for box in boxes] == ["", "", ""]
    session.open_path(path)
    qtbot.waitUntil(lambda: session.volume is not None)
    session.activate("k0")
    assert [box.text() for box in boxes] == shown
