"""Typing and stepping the active box: live, exact where nothing was typed, and one step of undo."""

import math
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QCheckBox, QDoubleSpinBox, QLabel, QLineEdit, QPushButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry.boxes import Box
from annotations.geometry.rotations import from_yaw_pitch_roll, yaw_pitch_roll_deg
from annotator.panels.annotation.box_editor import BoxEditor
from annotator.session import Session

# Nothing of it is what two decimals can say.
LINK0 = Box(
    (300.123456, 400.654321, 200.555555),
    (11000.123456, 4000.0, 4000.0),
    from_yaw_pitch_roll(31.234567, -12.345678, 7.654321),
)


class Frame(QWidget):
    """Stands for the window: notes the keys that nobody wanted."""

    def __init__(self) -> None:
        super().__init__()
        self.keys: list[int] = []

    def keyPressEvent(self, event: QKeyEvent) -> None:
        self.keys.append(event.key())


@pytest.fixture
def session(boxes_session: Session) -> Session:
    """A session with the box of link0 placed and active."""
    boxes_session.type_box("link0", LINK0)
    boxes_session.activate("link0")
    return boxes_session


@pytest.fixture
def frame(qtbot: QtBot, session: Session) -> Frame:
    """The editor, and another field to leave it for."""
    frame = Frame()
    qtbot.addWidget(frame)
    layout = QVBoxLayout(frame)
    layout.addWidget(BoxEditor(session))
    layout.addWidget(QLineEdit())
    with qtbot.waitActive(frame):
        frame.show()
        frame.activateWindow()
    return frame


def field(frame: QWidget, name: str) -> QDoubleSpinBox:
    found = frame.findChild(QDoubleSpinBox, f"box_{name}")
    assert isinstance(found, QDoubleSpinBox)
    return found


def component(frame: QWidget, letter: str) -> QLineEdit:
    found = frame.findChild(QLineEdit, f"quaternion_{letter}")
    assert isinstance(found, QLineEdit)
    return found


def title(frame: QWidget) -> str:
    found = frame.findChild(QLabel, "box_title")
    assert isinstance(found, QLabel)
    return found.text()


def leave(frame: QWidget) -> None:
    frame.findChildren(QLineEdit, options=Qt.FindChildOption.FindDirectChildrenOnly)[0].setFocus()


def type_text(qtbot: QtBot, target: QDoubleSpinBox | QLineEdit, text: str) -> None:
    target.setFocus()
    target.selectAll()
    qtbot.keyClicks(target, text)


def enter(qtbot: QtBot, target: QWidget) -> None:
    qtbot.keyClick(target, Qt.Key.Key_Return)


def placed(session: Session, link: str = "link0") -> Box | None:
    assert session.document is not None
    return session.document.placed_boxes.get(link)


def angles(box: Box | None) -> tuple[float, float, float]:
    assert box is not None
    return yaw_pitch_roll_deg(box.rotation_wxyz)


def turn_between_deg(first: Box | None, second: Box | None) -> float:
    assert first is not None
    assert second is not None
    cosine = (np.trace(first.axes.T @ second.axes) - 1) / 2
    return math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))


def test_the_fields_show_the_active_box(frame: QWidget) -> None:
    shown = [field(frame, name).text() for name in ("x", "y", "z", "length", "width", "height")]
    assert shown == ["300.12", "400.65", "200.56", "11000.12", "4000.00", "4000.00"]
    assert [field(frame, name).text() for name in ("yaw", "pitch", "roll")] == ["31.23", "-12.35", "7.65"]
    assert component(frame, "w").text() == f"{LINK0.rotation_wxyz[0]:.5f}"


@pytest.mark.parametrize(
    "name", ["x", "y", "z", "length", "yaw", "pitch", "roll", "quaternion_w", "quaternion_z"]
)
def test_enter_on_what_is_shown_changes_nothing(
    qtbot: QtBot, session: Session, frame: QWidget, name: str
) -> None:
    steps = session.undo_stack.count
    target = (
        component(frame, name.removeprefix("quaternion_"))
        if name.startswith("quaternion_")
        else field(frame, name)
    )
    target.setFocus()
    enter(qtbot, target)
    leave(frame)
    assert placed(session) == LINK0
    assert session.undo_stack.count == steps


def test_a_typed_centre_is_previewed_and_kept_by_enter_in_one_step(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    steps = session.undo_stack.count
    type_text(qtbot, field(frame, "y"), "512.5")
    moved = replace(LINK0, center_um=(LINK0.center_um[0], 512.5, LINK0.center_um[2]))
    assert session.active_box() == moved
    assert session.view.crosshair_um[1] == 512.5
    assert placed(session) == LINK0
    assert "Enter keeps it" in title(frame)
    enter(qtbot, field(frame, "y"))
    assert placed(session) == moved
    assert session.view.draft is None
    assert session.undo_stack.count == steps + 1
    assert session.undo_stack.undo_text == "Type link0"
    session.undo_stack.undo()
    assert placed(session) == LINK0
    assert field(frame, "y").text() == "400.65"


def test_escape_drops_what_was_typed_and_then_leaves(qtbot: QtBot, session: Session, frame: Frame) -> None:
    type_text(qtbot, field(frame, "length"), "5000")
    qtbot.keyClick(field(frame, "length"), Qt.Key.Key_Escape)
    assert session.view.draft is None
    assert placed(session) == LINK0
    assert field(frame, "length").text() == "11000.12"
    assert frame.keys == []
    qtbot.keyClick(field(frame, "length"), Qt.Key.Key_Escape)
    assert frame.keys == [Qt.Key.Key_Escape]


def test_numbers_of_a_group_typed_in_a_row_are_one_step(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    steps = session.undo_stack.count
    for name, text in (("x", "100"), ("y", "200"), ("z", "150")):
        type_text(qtbot, field(frame, name), text)
    assert placed(session) == LINK0
    leave(frame)
    qtbot.waitUntil(lambda: placed(session) == replace(LINK0, center_um=(100.0, 200.0, 150.0)))
    assert session.undo_stack.count == steps + 1


def test_saving_keeps_what_is_being_typed(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    type_text(qtbot, field(frame, "length"), "9000")
    assert session.save()
    assert placed(session) == replace(LINK0, size_um=(9000.0, 4000.0, 4000.0))


def test_what_is_typed_back_is_no_edit(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    session.type_box("link0", replace(LINK0, size_um=(11000.0, 4000.0, 4000.0)))
    steps = session.undo_stack.count
    type_text(qtbot, field(frame, "length"), "9000")
    type_text(qtbot, field(frame, "length"), "11000")
    enter(qtbot, field(frame, "length"))
    assert session.undo_stack.count == steps


def test_arrows_step_by_a_voxel_and_by_a_degree(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    session.type_box("link0", Box((300.0, 400.0, 200.0), (11000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    session.free_cross_section("link0", True)
    assert [field(frame, name).singleStep() for name in ("x", "y", "z")] == [15.9, 13.5, 9.4]
    sizes = [field(frame, name).singleStep() for name in ("length", "width", "height")]
    assert sizes == pytest.approx([15.9, 13.5, 9.4])
    steps = session.undo_stack.count
    field(frame, "yaw").setFocus()
    for _ in range(3):
        qtbot.keyClick(field(frame, "yaw"), Qt.Key.Key_Up)
    shown = session.active_box()
    assert angles(shown) == pytest.approx((3.0, 0.0, 0.0))
    qtbot.waitUntil(lambda: session.view.draft is None)
    assert session.undo_stack.count == steps + 1
    assert placed(session) == shown


def test_sizes_step_by_a_voxel_along_the_boxs_own_axes(session: Session, frame: QWidget) -> None:
    quarter = from_yaw_pitch_roll(90.0, 0.0, 0.0)
    session.type_box("link0", replace(LINK0, rotation_wxyz=quarter))
    assert field(frame, "length").singleStep() == pytest.approx(13.5)
    assert field(frame, "width").singleStep() == pytest.approx(15.9)


@pytest.mark.parametrize(("name", "place"), [("yaw", 0), ("pitch", 1), ("roll", 2)])
def test_one_angle_is_typed_and_the_others_stay_exact(
    qtbot: QtBot, session: Session, frame: QWidget, name: str, place: int
) -> None:
    type_text(qtbot, field(frame, name), "40")
    enter(qtbot, field(frame, name))
    wanted = list(angles(LINK0))
    wanted[place] = 40.0
    box = placed(session)
    assert angles(box) == pytest.approx(tuple(wanted), abs=1e-9)
    assert box is not None
    assert (box.center_um, box.size_um) == (LINK0.center_um, LINK0.size_um)


def test_angles_typed_beyond_the_vertical_go_on_being_shown(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    type_text(qtbot, field(frame, "pitch"), "90")
    enter(qtbot, field(frame, "pitch"))
    upright = placed(session)
    # Yaw and roll are turns about one axis there, and could be read otherwise.
    assert [field(frame, name).text() for name in ("yaw", "pitch", "roll")] == ["31.23", "90.00", "7.65"]
    field(frame, "pitch").setFocus()
    qtbot.keyClick(field(frame, "pitch"), Qt.Key.Key_Up)
    assert turn_between_deg(upright, session.active_box()) == pytest.approx(1.0, abs=1e-6)
    assert field(frame, "yaw").text() == "31.23"
    qtbot.keyClick(field(frame, "pitch"), Qt.Key.Key_Escape)
    assert placed(session) == upright
    assert field(frame, "yaw").text() == "31.23"


@pytest.mark.parametrize("pitch_deg", [90.0, -90.0, 90.0 - 1e-7, 89.9999])
@pytest.mark.parametrize("name", ["yaw", "pitch", "roll"])
def test_near_the_vertical_a_step_of_a_degree_turns_the_box_by_a_degree(
    qtbot: QtBot, session: Session, frame: QWidget, pitch_deg: float, name: str
) -> None:
    session.type_box("link0", replace(LINK0, rotation_wxyz=from_yaw_pitch_roll(50.0, pitch_deg, 20.0)))
    before = placed(session)
    field(frame, name).setFocus()
    qtbot.keyClick(field(frame, name), Qt.Key.Key_Down)
    # The field goes on from what it shows, rounded to 0.01°.
    assert turn_between_deg(before, session.active_box()) == pytest.approx(1.0, abs=0.006)


def test_undo_after_typed_angles_shows_the_angles_of_the_box(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    type_text(qtbot, field(frame, "yaw"), "200")
    enter(qtbot, field(frame, "yaw"))
    assert field(frame, "yaw").text() == "200.00"
    session.undo_stack.undo()
    assert field(frame, "yaw").text() == "31.23"


def test_a_quaternion_of_any_length_is_normalised_when_it_is_kept(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    steps = session.undo_stack.count
    for letter, text in zip("wxyz", ("2", "0", "0", "-2"), strict=True):
        type_text(qtbot, component(frame, letter), text)
    assert placed(session) == LINK0
    assert component(frame, "w").text() == "2"
    enter(qtbot, component(frame, "z"))
    box = placed(session)
    half = math.sqrt(0.5)
    assert box is not None
    assert box.rotation_wxyz == pytest.approx((half, 0.0, 0.0, -half))
    assert [component(frame, letter).text() for letter in "wxyz"] == [
        "0.70711",
        "0.00000",
        "0.00000",
        "-0.70711",
    ]
    assert field(frame, "yaw").text() == "-90.00"
    assert session.undo_stack.count == steps + 1


def test_leaving_the_quaternion_keeps_it(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    for letter, text in zip("wxyz", "0100", strict=True):
        type_text(qtbot, component(frame, letter), text)
    field(frame, "x").setFocus()
    box = placed(session)
    assert box is not None
    assert box.rotation_wxyz == (0.0, 1.0, 0.0, 0.0)


def test_one_component_is_typed_and_the_others_keep_their_share(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    type_text(qtbot, component(frame, "w"), "0.5")
    enter(qtbot, component(frame, "w"))
    _, *rest = LINK0.rotation_wxyz
    box = placed(session)
    assert box is not None
    ratio = np.asarray(box.rotation_wxyz[1:]) / np.asarray(rest)
    assert ratio == pytest.approx([ratio[0]] * 3, rel=1e-12)
    assert box.rotation_wxyz[0] / ratio[0] == pytest.approx(0.5, rel=1e-12)


def test_four_zeros_are_refused_with_a_reason(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    reasons: list[str] = []
    editor = frame.findChild(BoxEditor)
    assert isinstance(editor, BoxEditor)
    editor.refused.connect(reasons.append)
    steps = session.undo_stack.count
    for letter in "wxyz":
        type_text(qtbot, component(frame, letter), "0")
    enter(qtbot, component(frame, "z"))
    assert "All four are zero" in reasons[-1]
    assert component(frame, "z").text() == "0"
    leave(frame)
    assert "Nothing was changed." in reasons[-1]
    assert component(frame, "w").text() == f"{LINK0.rotation_wxyz[0]:.5f}"
    assert placed(session) == LINK0
    assert session.view.draft is None
    assert session.undo_stack.count == steps


@pytest.mark.parametrize("wrong", ["abc", "", "1,5", "nan", "inf"])
def test_a_component_that_is_no_number_is_refused(
    qtbot: QtBot, session: Session, frame: QWidget, wrong: str
) -> None:
    reasons: list[str] = []
    editor = frame.findChild(BoxEditor)
    assert isinstance(editor, BoxEditor)
    editor.refused.connect(reasons.append)
    type_text(qtbot, component(frame, "x"), "0.9")
    component(frame, "x").selectAll()
    qtbot.keyClick(component(frame, "x"), Qt.Key.Key_Delete)
    qtbot.keyClicks(component(frame, "x"), wrong)
    enter(qtbot, component(frame, "x"))
    assert "Nothing was changed yet" in reasons[-1]
    # What was a rotation on the way there is no more.
    assert session.active_box() == LINK0
    qtbot.keyClick(component(frame, "x"), Qt.Key.Key_Escape)
    assert component(frame, "x").text() == f"{LINK0.rotation_wxyz[1]:.5f}"
    assert reasons[-1] == ""
    assert placed(session) == LINK0


def test_width_and_height_wait_for_a_free_cross_section(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    free = frame.findChild(QCheckBox, "box_free_cross_section")
    assert isinstance(free, QCheckBox)
    assert field(frame, "length").isEnabled()
    for name in ("width", "height"):
        assert not field(frame, name).isEnabled()
        assert "Free cross-section" in field(frame, name).toolTip()
    qtbot.mouseClick(free, Qt.MouseButton.LeftButton, pos=free.rect().center() / 4)
    assert session.view.free_links == {"link0"}
    type_text(qtbot, field(frame, "width"), "3000")
    enter(qtbot, field(frame, "width"))
    assert placed(session) == replace(LINK0, size_um=(LINK0.size_um[0], 3000.0, 4000.0))
    session.free_cross_section("link0", False)
    assert not free.isChecked()
    assert not field(frame, "width").isEnabled()


def test_a_size_is_never_zero(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    type_text(qtbot, field(frame, "length"), "0")
    enter(qtbot, field(frame, "length"))
    assert placed(session) == LINK0
    assert field(frame, "length").value() > 0


def test_turning_over_keeps_the_body_and_reverses_the_hinge(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    button = frame.findChild(QPushButton, "box_turn_over")
    assert isinstance(button, QPushButton)
    assert "+y" in button.toolTip()
    assert "anticlockwise" in button.toolTip()
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    box = placed(session)
    assert box is not None
    assert box.axes[:, 0] == pytest.approx(LINK0.axes[:, 0])
    assert box.axes[:, 1] == pytest.approx(-LINK0.axes[:, 1])
    session.undo_stack.undo()
    assert placed(session) == LINK0


def test_a_locked_box_can_be_read_and_not_changed(session: Session, frame: QWidget) -> None:
    session.set_locked("link0", True)
    assert "locked" in title(frame)
    for name in ("x", "length", "yaw", "turn_over", "free_cross_section"):
        control = frame.findChild(QWidget, f"box_{name}")
        assert isinstance(control, QWidget)
        assert not control.isEnabled()
    assert not component(frame, "w").isEnabled()
    assert field(frame, "x").text() == "300.12"


def test_an_unplaced_box_begins_at_the_crosshair_in_the_tools_size(
    qtbot: QtBot, session: Session, frame: QWidget
) -> None:
    session.look(crosshair_um=(159.0, 270.0, 188.0))
    session.activate("link2")
    assert "unplaced" in title(frame)
    assert [field(frame, name).value() for name in ("x", "y", "z")] == [159.0, 270.0, 188.0]
    button = frame.findChild(QPushButton, "box_turn_over")
    assert isinstance(button, QPushButton)
    assert not button.isEnabled()
    assert placed(session, "link2") is None
    type_text(qtbot, field(frame, "yaw"), "30")
    assert placed(session, "link2") is None
    enter(qtbot, field(frame, "yaw"))
    assert session.tool is not None
    link = session.tool.link("link2")
    box = placed(session, "link2")
    assert box is not None
    assert box.center_um == (159.0, 270.0, 188.0)
    assert box.size_um == (link.length_um, *link.cross_section_um)
    assert angles(box) == pytest.approx((30.0, 0.0, 0.0))


def test_a_drag_moves_the_numbers(session: Session, frame: QWidget) -> None:
    session.set_mode("place")
    session.drag_handle("center", (1000.0, 2000.0, 3000.0))
    assert [field(frame, name).value() for name in ("x", "y", "z")] == [1000.0, 2000.0, 3000.0]
    session.drop_preview()
    assert field(frame, "x").text() == "300.12"


def test_without_an_active_link_there_is_nothing_to_type(session: Session, frame: QWidget) -> None:
    session.activate(None)
    assert "number key" in title(frame)
    assert not field(frame, "x").isEnabled()
    assert field(frame, "x").text() == ""
    assert component(frame, "w").text() == ""
    session.activate("link0")
    assert field(frame, "x").text() == "300.12"


def test_a_document_of_keypoints_leaves_it_empty(qtbot: QtBot, session: Session, frame: QWidget) -> None:
    session.set_method("keypoints")
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == "keypoints")
    assert not field(frame, "x").isEnabled()
    assert field(frame, "length").text() == ""
