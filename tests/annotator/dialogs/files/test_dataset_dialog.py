"""Which of several arrays is the volume."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QPushButton, QTreeWidget
from pytestqt.qtbot import QtBot

from annotations.volumes import DatasetChoice
from annotator.dialogs.files.dataset_dialog import DatasetDialog

CHOICES = (
    DatasetChoice("/scan/mask", (10, 20, 30), "|b1"),
    DatasetChoice("/scan/volume", (100, 200, 300), ">u2"),
    DatasetChoice("/scan/preview", (10, 20, 30), "<f4"),
)


@pytest.fixture
def dialog(qtbot: QtBot) -> DatasetDialog:
    dialog = DatasetDialog(Path("/recordings/session.h5"), CHOICES)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def items(dialog: DatasetDialog) -> QTreeWidget:
    found = dialog.findChild(QTreeWidget, "dataset_list")
    assert isinstance(found, QTreeWidget)
    return found


def test_all_arrays_are_listed_and_the_largest_one_is_chosen(dialog: DatasetDialog) -> None:
    rows = [[items(dialog).topLevelItem(row).text(column) for column in range(3)] for row in range(3)]
    assert rows[1] == ["/scan/volume", "100 × 200 × 300", "uint16"]
    assert dialog.dataset == "/scan/volume"


def test_another_array_is_chosen_by_key_and_opened(qtbot: QtBot, dialog: DatasetDialog) -> None:
    qtbot.keyClick(items(dialog), Qt.Key.Key_Down)
    assert dialog.dataset == "/scan/preview"
    button = dialog.findChild(QPushButton, "dataset_ok")
    assert isinstance(button, QPushButton)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert dialog.result() == QDialog.DialogCode.Accepted


def test_a_double_click_opens_an_array(qtbot: QtBot, dialog: DatasetDialog) -> None:
    spot = items(dialog).visualItemRect(items(dialog).topLevelItem(0)).center()
    viewport = items(dialog).viewport()
    qtbot.mouseClick(viewport, Qt.MouseButton.LeftButton, pos=spot)
    qtbot.mouseDClick(viewport, Qt.MouseButton.LeftButton, pos=spot)
    assert dialog.dataset == "/scan/mask"
    assert dialog.result() == QDialog.DialogCode.Accepted


def test_without_a_choice_nothing_can_be_opened(qtbot: QtBot) -> None:
    dialog = DatasetDialog(Path("empty.h5"), ())
    qtbot.addWidget(dialog)
    button = dialog.findChild(QPushButton, "dataset_ok")
    assert isinstance(button, QPushButton)
    assert dialog.dataset is None
    assert not button.isEnabled()
