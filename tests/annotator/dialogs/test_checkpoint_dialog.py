"""What is said of a checkpoint."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QLabel, QPlainTextEdit, QPushButton

from annotator.dialogs.checkpoint_dialog import CheckpointDialog, CheckpointFit
from tests.annotations.prediction.tiny_networks import save_tiny


@pytest.fixture
def checkpoint(tmp_path):
    folder = tmp_path / "my networks"
    folder.mkdir()
    return save_tiny(folder / "tiny.onnx")


@pytest.fixture
def make_dialog(qtbot, checkpoint):
    def make(**options):
        dialog = CheckpointDialog(checkpoint, **options)
        qtbot.addWidget(dialog)
        return dialog

    return make


def said(dialog, name):
    return dialog.findChild(QLabel, f"checkpoint_{name}").text()


def test_it_says_what_the_checkpoint_is(make_dialog, checkpoint):
    dialog = make_dialog()
    assert said(dialog, "heading") == "“Tiny” is a checkpoint, a trained network"
    assert said(dialog, "path") == str(checkpoint.path)
    assert said(dialog, "name") == "Tiny"
    assert said(dialog, "tool") == "needle (Needle: tip and shaft)"
    assert said(dialog, "keypoints") == "tip, shaft"
    assert said(dialog, "network") == "test, 18 parameters"
    assert "1,200 synthetic volumes" in said(dialog, "training")
    assert said(dialog, "errors") == "position (mm) 0.31 ± 0.12, on 8 other volumes"


def test_a_new_one_is_called_so(make_dialog):
    assert said(make_dialog(is_new=True), "heading") == "The checkpoint “Tiny” is made"


@pytest.mark.parametrize(("folder", "study"), [(None, "STUDY"), (Path("/data/study"), "/data/study")])
def test_the_commands_that_use_it_can_be_copied(make_dialog, checkpoint, folder, study):
    dialog = make_dialog(study_folder=folder)
    dialog.findChild(QPushButton, "checkpoint_copy").click()
    copied = QApplication.clipboard().text()
    assert copied == dialog.findChild(QPlainTextEdit, "checkpoint_commands").toPlainText()
    path = f"'{checkpoint.path}'"
    assert copied.splitlines() == [
        f"annotations predict {path} VOLUME -o FOLDER",
        f"annotations predict {path} --study {study}",
        f"annotations evaluate {path} {study}",
    ]


def test_enter_uses_it(qtbot, make_dialog):
    dialog = make_dialog()
    with qtbot.waitActive(dialog):
        dialog.show()
        dialog.activateWindow()
    with qtbot.waitSignal(dialog.accepted):
        qtbot.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)


def test_in_what_its_tool_differs_stands_beside_that_it_fits(make_dialog):
    dialog = make_dialog(fit=CheckpointFit(differences="its tool differs: link0 is 3 mm long there"))
    assert said(dialog, "fit") == (
        "The tool of the next annotation; no volume is open. Its tool differs: link0 is 3 mm long there."
    )
