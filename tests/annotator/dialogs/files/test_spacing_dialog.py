"""The spacing is asked for once, with nothing assumed and nothing impossible accepted."""

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QDialog, QLabel, QLineEdit, QPushButton
from pytestqt.qtbot import QtBot

from annotations.volumes import OMES_REALTIME_SPACING_UM, OMES_SPACING_UM, open_volume
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.session.volumes.spacing_answer import SpacingAnswer

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def dialog(qtbot: QtBot, tmp_path: Path) -> SpacingDialog:
    np.save(tmp_path / "v001.npy", np.zeros((100, 200, 300), np.uint8))
    with open_volume(tmp_path / "v001.npy") as volume:
        dialog = SpacingDialog(volume, OMES_SPACING_UM)
    qtbot.addWidget(dialog)
    with qtbot.waitActive(dialog):
        dialog.show()
        dialog.activateWindow()
    return dialog


def field(dialog: SpacingDialog, axis: str) -> QLineEdit:
    found = dialog.findChild(QLineEdit, f"spacing_{axis}")
    assert isinstance(found, QLineEdit)
    return found


def label(dialog: SpacingDialog, name: str) -> QLabel:
    found = dialog.findChild(QLabel, name)
    assert isinstance(found, QLabel)
    return found


def ok(dialog: SpacingDialog) -> QPushButton:
    found = dialog.findChild(QPushButton, "spacing_ok")
    assert isinstance(found, QPushButton)
    return found


def preset(dialog: SpacingDialog) -> QComboBox:
    found = dialog.findChild(QComboBox, "spacing_preset")
    assert isinstance(found, QComboBox)
    return found


def retype(qtbot: QtBot, target: QLineEdit, text: str) -> None:
    target.setFocus()
    target.selectAll()
    qtbot.keyClick(target, Qt.Key.Key_Delete)
    qtbot.keyClicks(target, text)


def test_the_scanners_spacing_is_offered_and_its_extent_shown(qtbot: QtBot, dialog: SpacingDialog) -> None:
    assert dialog.spacing_um == OMES_SPACING_UM
    assert label(dialog, "spacing_extent").text() == "1.59 × 2.7 × 2.82 mm"
    assert "full volume" in preset(dialog).currentText()
    assert any("100 × 200 × 300 voxels, uint8" in text.text() for text in dialog.findChildren(QLabel))
    qtbot.mouseClick(ok(dialog), LEFT)
    assert dialog.result() == QDialog.DialogCode.Accepted
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 2, "file")


def test_the_real_time_spacing_is_a_choice_away(qtbot: QtBot, dialog: SpacingDialog) -> None:
    preset(dialog).setFocus()
    qtbot.keyClick(preset(dialog), Qt.Key.Key_Down)
    assert dialog.spacing_um == OMES_REALTIME_SPACING_UM
    assert label(dialog, "spacing_extent").text() == "62.2 × 2.7 × 2.82 mm"
    qtbot.keyClick(preset(dialog), Qt.Key.Key_Down)
    assert dialog.spacing_um == OMES_REALTIME_SPACING_UM
    assert field(dialog, "x").hasFocus()


def test_another_spacing_is_typed_and_its_extent_follows(qtbot: QtBot, dialog: SpacingDialog) -> None:
    retype(qtbot, field(dialog, "x"), "20.5")
    assert dialog.spacing_um == (20.5, 13.5, 9.4)
    assert preset(dialog).currentText() == "Another spacing"
    assert label(dialog, "spacing_extent").text() == "2.05 × 2.7 × 2.82 mm"
    retype(qtbot, field(dialog, "x"), "15.9")
    assert "full volume" in preset(dialog).currentText()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "Along y: Type a number"),
        ("abc", "Along y: “abc” is not a number"),
        ("13,5", "with a point"),
        ("0", "0 µm, which no voxel can have"),
        ("-4", "-4 µm, which no voxel can have"),
        ("nan", "not a finite number"),
        ("1e999", "not a finite number"),
    ],
)
def test_an_impossible_spacing_is_explained_and_not_accepted(
    qtbot: QtBot, dialog: SpacingDialog, text: str, reason: str
) -> None:
    retype(qtbot, field(dialog, "y"), text)
    assert reason in label(dialog, "spacing_problem").text()
    assert label(dialog, "spacing_problem").isVisible()
    assert not ok(dialog).isEnabled()
    assert dialog.spacing_um is None
    assert label(dialog, "spacing_extent").text() == "—"
    qtbot.keyClick(field(dialog, "y"), Qt.Key.Key_Return)
    assert dialog.isVisible()
    retype(qtbot, field(dialog, "y"), "13.5")
    assert not label(dialog, "spacing_problem").isVisible()
    assert ok(dialog).isEnabled()


def test_an_answer_need_not_be_remembered(qtbot: QtBot, dialog: SpacingDialog) -> None:
    box = dialog.findChild(QComboBox, "spacing_scope")
    assert isinstance(box, QComboBox)
    assert "v001.npy.volume.toml" in box.toolTip()
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 2, "file")
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Down)
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 2, "folder")
    qtbot.keyClick(box, Qt.Key.Key_End)
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 2, "once")


def test_one_of_several_volumes_offers_an_answer_for_all(qtbot: QtBot, tmp_path: Path) -> None:
    np.save(tmp_path / "v001.npy", np.zeros((3, 4, 5), np.uint8))
    with open_volume(tmp_path / "v001.npy") as volume:
        dialog = SpacingDialog(volume, OMES_SPACING_UM, is_one_of_several=True)
    qtbot.addWidget(dialog)
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 2, "folder")


def test_another_scanner_s_depth_axis_is_chosen(qtbot: QtBot, dialog: SpacingDialog) -> None:
    box = dialog.findChild(QComboBox, "spacing_depth_axis")
    assert isinstance(box, QComboBox)
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Home)
    assert dialog.answer == SpacingAnswer(OMES_SPACING_UM, 0, "file")


def test_nothing_need_be_opened(qtbot: QtBot, dialog: SpacingDialog) -> None:
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert dialog.result() == QDialog.DialogCode.Rejected
