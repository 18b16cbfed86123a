"""An annotation that cannot be saved: several ways out, and none loses an edit."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from annotator.dialogs.files.unsaved_dialog import UnsavedDialog


@pytest.fixture
def dialog(qtbot: QtBot) -> UnsavedDialog:
    dialog = UnsavedDialog("No space left on device", Path("/study/anna/v001.json"), "Quit without saving")
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def button(dialog: UnsavedDialog, choice: str) -> QPushButton:
    found = dialog.findChild(QPushButton, f"unsaved_{choice}")
    assert isinstance(found, QPushButton)
    return found


@pytest.mark.parametrize("choice", ["retry", "save_elsewhere", "leave", "cancel"])
def test_each_way_out_is_one_click(qtbot: QtBot, dialog: UnsavedDialog, choice: str) -> None:
    qtbot.mouseClick(button(dialog, choice), Qt.MouseButton.LeftButton)
    assert dialog.choice == choice
    assert not dialog.isVisible()


def test_what_is_the_matter_and_what_follows_is_said(dialog: UnsavedDialog) -> None:
    texts = [label.text() for label in dialog.findChildren(QLabel)]
    assert "No space left on device" in texts
    assert "/study/anna/v001.json" in texts
    assert button(dialog, "leave").text() == "Quit without saving"
    assert any("recovery file" in text for text in texts)
