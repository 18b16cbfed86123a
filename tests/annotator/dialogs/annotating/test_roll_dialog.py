"""Nobody but a person says a roll that keypoints do not show, and nothing is suggested to them."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QLabel, QLineEdit, QPushButton
from pytestqt.qtbot import QtBot

from annotator.dialogs.annotating.roll_dialog import RollChoiceDialog, RollEntryDialog
from annotator.session.files.deriving import RollMeaning

MEANINGS = (
    RollMeaning(30.0, (0.1, 0.2, -0.9), {"theta1": 40.0, "theta2": -3.25}),
    RollMeaning(-150.0, (-0.1, -0.2, 0.9), {"theta1": -40.0, "theta2": 3.25}),
)


@pytest.fixture
def choice(qtbot: QtBot) -> RollChoiceDialog:
    dialog = RollChoiceDialog("link0", MEANINGS)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


@pytest.fixture
def entry(qtbot: QtBot) -> RollEntryDialog:
    dialog = RollEntryDialog("link0")
    qtbot.addWidget(dialog)
    with qtbot.waitActive(dialog):
        dialog.show()
        dialog.activateWindow()
    return dialog


def said(dialog: QDialog) -> str:
    return " ".join(label.text() for label in dialog.findChildren(QLabel))


def button(dialog: QDialog, name: str) -> QPushButton:
    found = dialog.findChild(QPushButton, name)
    assert isinstance(found, QPushButton)
    return found


def test_the_two_senses_are_explained(choice: RollChoiceDialog) -> None:
    text = said(choice)
    assert "line of the hinge, but not its sense" in text
    assert "own +y of link0, looks mostly along −z; theta1 is +40.0° and theta2 is −3.2°." in text
    assert "looks mostly along +z; theta1 is −40.0° and theta2 is +3.2°." in text
    assert button(choice, "roll_0").text() == "Roll +30.0°"
    assert button(choice, "roll_1").text() == "Roll −150.0°"


@pytest.mark.parametrize("number", [0, 1])
def test_a_choice_is_the_roll(qtbot: QtBot, choice: RollChoiceDialog, number: int) -> None:
    assert choice.roll_deg is None
    qtbot.mouseClick(button(choice, f"roll_{number}"), Qt.MouseButton.LeftButton)
    assert choice.result() == QDialog.DialogCode.Accepted
    assert choice.roll_deg == MEANINGS[number].roll_deg


def test_esc_and_return_choose_none(qtbot: QtBot, choice: RollChoiceDialog) -> None:
    qtbot.keyClick(choice, Qt.Key.Key_Return)
    assert choice.roll_deg is None
    qtbot.keyClick(choice, Qt.Key.Key_Escape)
    assert choice.result() == QDialog.DialogCode.Rejected
    assert choice.roll_deg is None


def test_no_roll_is_a_negative_zero(qtbot: QtBot) -> None:
    dialog = RollChoiceDialog("needle", (RollMeaning(-0.01, (0.0, 1.0, 0.0), {}),))
    qtbot.addWidget(dialog)
    assert button(dialog, "roll_0").text() == "Roll +0.0°"


def test_a_tool_without_angles_is_explained_too(qtbot: QtBot) -> None:
    dialog = RollChoiceDialog("needle", (RollMeaning(0.0, (0.0, 1.0, 0.0), {}),))
    qtbot.addWidget(dialog)
    assert "own +y of needle, looks mostly along +y." in said(dialog)


def test_the_roll_of_a_straight_tool_is_typed(qtbot: QtBot, entry: RollEntryDialog) -> None:
    assert "No clear bend" in said(entry)
    field = entry.findChild(QLineEdit, "roll_field")
    assert field.text() == "", "nothing is suggested"
    assert not button(entry, "roll_ok").isEnabled()
    assert entry.roll_deg is None
    qtbot.keyClicks(field, "-12.5°")
    assert entry.roll_deg == -12.5
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert entry.result() == QDialog.DialogCode.Accepted


@pytest.mark.parametrize(
    ("typed", "problem"), [("1,5", "decimals with a point"), ("181", "between"), ("about 3", "not a number")]
)
def test_what_is_no_roll_is_refused_with_a_reason(
    qtbot: QtBot, entry: RollEntryDialog, typed: str, problem: str
) -> None:
    qtbot.keyClicks(entry.findChild(QLineEdit, "roll_field"), typed)
    assert problem in entry.findChild(QLabel, "roll_problem").text()
    assert not button(entry, "roll_ok").isEnabled()
    assert entry.roll_deg is None
