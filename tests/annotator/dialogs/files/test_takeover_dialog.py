"""A computer that says nothing: what is known of it, one way on, and one that changes nothing."""

from datetime import UTC, datetime

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from annotations.documents.locks import LockHolder
from annotator.dialogs.files.takeover_dialog import TakeoverDialog


def holder(age_s: float, host: str = "lab-3") -> LockHolder:
    moment = datetime(2026, 11, 22, 5, tzinfo=UTC)
    return LockHolder("bob", host, moment if host else None, moment, age_s, "token", False, False, True)


@pytest.fixture
def dialog(qtbot: QtBot) -> TakeoverDialog:
    dialog = TakeoverDialog(holder(300))
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def words(dialog: TakeoverDialog) -> str:
    return " ".join(label.text() for label in dialog.findChildren(QLabel))


@pytest.mark.parametrize("choice", ["take_over", "cancel"])
def test_each_way_on_is_one_click(qtbot: QtBot, dialog: TakeoverDialog, choice: str) -> None:
    button = dialog.findChild(QPushButton, f"takeover_{choice}")
    assert isinstance(button, QPushButton)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert dialog.choice == choice
    assert not dialog.isVisible()


@pytest.mark.parametrize("key", [Qt.Key.Key_Escape, Qt.Key.Key_Return])
def test_no_key_alone_takes_anything_over(qtbot: QtBot, dialog: TakeoverDialog, key: Qt.Key) -> None:
    qtbot.keyClick(dialog, key)
    assert dialog.choice == "cancel"


def test_it_says_who_it_is_and_what_may_be_left_over_there(dialog: TakeoverDialog) -> None:
    text = words(dialog)
    assert "bob on lab-3, since 2026-11-2" in text
    assert "last heard of 5 minutes ago" in text
    assert "recovery file" in text
    assert "takeovers.log" in text


@pytest.mark.parametrize(
    ("age_s", "said"), [(125, "2 minutes ago"), (3 * 3600, "3 hours ago"), (5 * 86_400, "5 days ago")]
)
def test_long_silence_is_told_in_fitting_units(qtbot: QtBot, age_s: float, said: str) -> None:
    dialog = TakeoverDialog(holder(age_s))
    qtbot.addWidget(dialog)
    assert said in words(dialog)


def test_a_holder_that_the_file_does_not_name_is_called_a_program(qtbot: QtBot) -> None:
    dialog = TakeoverDialog(holder(300, host=""))
    qtbot.addWidget(dialog)
    assert "another program (its lock file cannot be read)" in words(dialog)
