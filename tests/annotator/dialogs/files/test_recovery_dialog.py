"""Recovered edits are given back, thrown away after a question, or kept for later."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QDialog, QMessageBox, QPushButton, QTreeWidget
from pytestqt.qtbot import QtBot

from annotations.documents.edits import place_box, place_keypoint
from annotations.documents.recovery import Recovery
from annotations.geometry.boxes import Box
from annotator.dialogs.files.recovery_dialog import RecoveryDialog
from annotator.session import Session

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def recoveries(session: Session) -> list[Recovery]:
    assert session.document is not None
    document = place_keypoint(session.document, "k0", (1.0, 2.0, 3.0), "clicked")
    return [
        Recovery(Path("a.journal"), Path("/study/anna/v001.json"), "x", document, 1, 1_790_000_000.0),
        Recovery(Path("b.journal"), Path("/study/anna/v002.json"), "y", document, 7, 1_790_003_600.0),
    ]


@pytest.fixture
def dialog(qtbot: QtBot, recoveries: list[Recovery]) -> RecoveryDialog:
    dialog = RecoveryDialog(recoveries)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def button(dialog: RecoveryDialog, name: str) -> QPushButton:
    found = dialog.findChild(QPushButton, f"recovery_{name}")
    assert isinstance(found, QPushButton)
    return found


def items(dialog: RecoveryDialog) -> QTreeWidget:
    found = dialog.findChild(QTreeWidget, "recovery_list")
    assert isinstance(found, QTreeWidget)
    return found


def answer(standard: QMessageBox.StandardButton) -> Callable[[], None]:
    """Press a button of the question that is open."""

    def press() -> None:
        question = QApplication.activeModalWidget()
        assert isinstance(question, QMessageBox)
        pressed = question.button(standard)
        assert isinstance(pressed, QAbstractButton)
        pressed.click()

    return press


def test_what_was_recovered_is_told(dialog: RecoveryDialog) -> None:
    item = items(dialog).topLevelItem(1)
    assert item.text(0) == "v002.json"
    assert item.text(2) == "7"
    assert item.text(3) == "1 of 6 keypoints"
    assert "/study/anna/v002.json" in item.toolTip(0)
    assert items(dialog).currentItem() is item


def test_boxes_are_counted_as_boxes(qtbot: QtBot, boxes_session: Session) -> None:
    assert boxes_session.document is not None
    box = Box((1.0, 2.0, 3.0), (11000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
    document = place_box(boxes_session.document, "link1", box, "typed")
    dialog = RecoveryDialog(
        [Recovery(Path("a.journal"), Path("/study/anna/v001.boxes.json"), "x", document, 1, 1_790_000_000.0)]
    )
    qtbot.addWidget(dialog)
    item = items(dialog).topLevelItem(0)
    assert item is not None
    assert item.text(3) == "1 of 3 boxes"


def test_the_chosen_document_is_recovered(
    qtbot: QtBot, dialog: RecoveryDialog, recoveries: list[Recovery]
) -> None:
    items(dialog).setCurrentItem(items(dialog).topLevelItem(0))
    with qtbot.waitSignal(dialog.recover_requested) as asked:
        qtbot.mouseClick(button(dialog, "recover"), LEFT)
    assert asked.args == [recoveries[0]]
    assert dialog.result() == QDialog.DialogCode.Accepted


def test_discarding_asks_first(qtbot: QtBot, dialog: RecoveryDialog, recoveries: list[Recovery]) -> None:
    with qtbot.assertNotEmitted(dialog.discard_requested):
        QTimer.singleShot(0, answer(QMessageBox.StandardButton.Cancel))
        qtbot.mouseClick(button(dialog, "discard"), LEFT)
    assert items(dialog).topLevelItemCount() == 2
    with qtbot.waitSignal(dialog.discard_requested) as asked:
        QTimer.singleShot(0, answer(QMessageBox.StandardButton.Discard))
        qtbot.mouseClick(button(dialog, "discard"), LEFT)
    assert asked.args == [recoveries[1]]
    assert items(dialog).topLevelItemCount() == 1
    assert dialog.isVisible()


def test_the_dialog_closes_when_all_are_discarded(qtbot: QtBot, dialog: RecoveryDialog) -> None:
    for _ in range(2):
        QTimer.singleShot(0, answer(QMessageBox.StandardButton.Discard))
        qtbot.mouseClick(button(dialog, "discard"), LEFT)
    assert dialog.result() == QDialog.DialogCode.Accepted
    assert not dialog.isVisible()


def test_deciding_later_keeps_everything(qtbot: QtBot, dialog: RecoveryDialog) -> None:
    with (
        qtbot.assertNotEmitted(dialog.recover_requested),
        qtbot.assertNotEmitted(dialog.discard_requested),
    ):
        qtbot.mouseClick(button(dialog, "later"), LEFT)
    assert dialog.result() == QDialog.DialogCode.Rejected
