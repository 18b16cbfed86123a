"""The reason of a flag: asked for, changed, taken back, and never longer than a document holds."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QLabel, QPlainTextEdit
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import LONGEST_FLAG
from annotator.dialogs.annotating.flag_dialog import FlagDialog


def shown(qtbot: QtBot, flag: str | None) -> FlagDialog:
    dialog = FlagDialog(flag)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def field(dialog: FlagDialog) -> QPlainTextEdit:
    reason = dialog.findChild(QPlainTextEdit, "flag_reason")
    assert isinstance(reason, QPlainTextEdit)
    return reason


def button(dialog: FlagDialog, name: str) -> QAbstractButton:
    found = dialog.findChild(QAbstractButton, name)
    assert isinstance(found, QAbstractButton)
    return found


def test_a_flag_needs_a_reason_of_a_length_that_a_document_holds(qtbot: QtBot) -> None:
    dialog = shown(qtbot, None)
    assert dialog.findChild(QAbstractButton, "flag_remove") is None
    for text, is_possible in (("", False), ("   ", False), ("x" * LONGEST_FLAG, True), ("too dark", True)):
        field(dialog).setPlainText(text)
        assert button(dialog, "flag_ok").isEnabled() == is_possible
    field(dialog).setPlainText("x" * (LONGEST_FLAG + 2))
    assert not button(dialog, "flag_ok").isEnabled()
    problem = dialog.findChild(QLabel, "flag_problem")
    assert isinstance(problem, QLabel)
    assert "Too long by 2" in problem.text()
    field(dialog).setPlainText("  too dark \n")
    with qtbot.waitSignal(dialog.accepted):
        button(dialog, "flag_ok").click()
    assert dialog.reason == "too dark"


def test_control_return_flags_the_volume_once_there_is_a_reason(qtbot: QtBot) -> None:
    dialog = shown(qtbot, None)
    with qtbot.waitActive(dialog):
        dialog.activateWindow()
    control = Qt.KeyboardModifier.ControlModifier
    with qtbot.assertNotEmitted(dialog.accepted):
        qtbot.keyClick(field(dialog), Qt.Key.Key_Return, control)
    qtbot.keyClicks(field(dialog), "too dark")
    with qtbot.waitSignal(dialog.accepted):
        qtbot.keyClick(field(dialog), Qt.Key.Key_Return, control)
    assert dialog.reason == "too dark"


def test_a_flag_can_be_changed_or_taken_back(qtbot: QtBot) -> None:
    dialog = shown(qtbot, "too dark")
    assert field(dialog).toPlainText() == "too dark"
    assert dialog.reason == "too dark"
    with qtbot.waitSignal(dialog.accepted):
        button(dialog, "flag_remove").click()
    assert dialog.reason is None
