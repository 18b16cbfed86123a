"""A file changed by another program: three ways on, and one back."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from annotator.dialogs.files.overwrite_dialog import OverwriteDialog


@pytest.fixture
def dialog(qtbot: QtBot) -> OverwriteDialog:
    dialog = OverwriteDialog("v001.json was changed by another program", Path("/study/anna/v001.json"))
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


@pytest.mark.parametrize("choice", ["overwrite", "reload", "save_elsewhere", "cancel"])
def test_each_way_on_is_one_click(qtbot: QtBot, dialog: OverwriteDialog, choice: str) -> None:
    button = dialog.findChild(QPushButton, f"overwrite_{choice}")
    assert isinstance(button, QPushButton)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert dialog.choice == choice
    assert not dialog.isVisible()


def test_escape_changes_nothing(qtbot: QtBot, dialog: OverwriteDialog) -> None:
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert dialog.choice == "cancel"


def test_enter_by_itself_overwrites_nothing(qtbot: QtBot, dialog: OverwriteDialog) -> None:
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.choice == "cancel"


def test_each_way_says_what_follows(dialog: OverwriteDialog) -> None:
    texts = [label.text() for label in dialog.findChildren(QLabel)]
    assert "v001.json was changed by another program" in texts
    assert sum("backup" in text or "given up" in text or "Both versions" in text for text in texts) == 3
