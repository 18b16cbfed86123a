"""A new study is described in one dialog, which says at once what cannot be."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QTableWidget,
    QTreeWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.study import STUDY_FILE
from annotations.geometry.tool_library import shipped_tools
from annotator.dialogs.study_dialog import StudyDialog
from annotator.session.studies import StudyProposal

Make = Callable[..., StudyDialog]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "Phantom"
    folder.mkdir()
    return folder


@pytest.fixture
def make(qtbot: QtBot, folder: Path) -> Make:
    def make(annotator: str = "anna", count: int = 12) -> StudyDialog:
        paths = tuple(folder / f"scan {number}.npy" for number in range(count))
        proposal = StudyProposal(folder, paths, shipped_tools(), 7)
        dialog = StudyDialog(proposal, annotator, "needle")
        qtbot.addWidget(dialog)
        with qtbot.waitActive(dialog):
            dialog.show()
            dialog.activateWindow()
        return dialog

    return make


def problem(dialog: StudyDialog) -> str:
    label = dialog.findChild(QLabel, "study_problem")
    assert label.isHidden() == (not label.text())
    assert dialog.findChild(QPushButton, "study_ok").isEnabled() == label.isHidden()
    assert (dialog.study is None) == bool(label.text())
    return label.text()


def add(qtbot: QtBot, dialog: StudyDialog, names: str) -> None:
    entry = dialog.findChild(QLineEdit, "study_new_annotator")
    entry.setFocus()
    qtbot.keyClicks(entry, names)
    qtbot.keyClick(entry, Qt.Key.Key_Return)


def test_volumes_and_what_is_most_likely_stand_there(make: Make, folder: Path) -> None:
    dialog = make()
    assert dialog.findChild(QLabel, "study_heading").text() == "A study of 12 volumes"
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    assert volumes.topLevelItemCount() == 12
    assert (volumes.topLevelItem(3).text(0), volumes.topLevelItem(3).text(1)) == ("scan-3", "scan 3.npy")
    assert problem(dialog) == ""
    study = dialog.study
    assert (study.title, study.tool, study.methods) == ("Phantom", "needle", ("keypoints",))
    assert (study.annotators, study.order, study.seed, study.blind) == (("anna",), "shuffled", 7, False)
    assert dialog.folder == folder
    assert dialog.tool == shipped_tools()["needle"]


def test_everything_can_be_said_by_keyboard_and_mouse(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    title = dialog.findChild(QLineEdit, "study_title")
    assert title.hasFocus()
    qtbot.keyClicks(title, "Needles")
    dialog.findChild(QComboBox, "study_tool").setCurrentIndex(0)
    add(qtbot, dialog, "ben, cara")
    for name in ("study_boxes", "study_blind", "study_shuffled", "study_may_look"):
        qtbot.keyClick(dialog.findChild(QCheckBox, name), Qt.Key.Key_Space)
    table = dialog.findChild(QTableWidget, "study_annotators")
    table.item(1, 1).setCheckState(Qt.CheckState.Unchecked)
    dialog.findChild(QSpinBox, "study_repeats").setValue(3)
    dialog.findChild(QComboBox, "study_others").setCurrentIndex(1)
    qtbot.keyClicks(dialog.findChild(QLineEdit, "study_reviewers"), "rita, Otto Weiß")
    assert problem(dialog) == ""
    study = dialog.study
    assert (study.title, study.tool) == ("Needles", next(iter(shipped_tools())))
    assert study.methods == ("keypoints", "boxes")
    assert study.annotators == ("anna", "ben", "cara")
    assert study.assignments == {"ben": ("boxes",)}
    assert (study.blind, study.order) == (True, "listed")
    assert sum(volume.repeats for volume in study.volumes) == 3
    assert (study.viewing.others, study.viewing.may_look) == ("never", True)
    assert study.viewing.reviewers == ("rita", "Otto Weiß")


def test_return_in_the_field_of_names_adds_them_and_only_then_ends_the_dialog(
    qtbot: QtBot, make: Make
) -> None:
    dialog = make()
    add(qtbot, dialog, "ben")
    assert dialog.isVisible()
    assert dialog.study.annotators == ("anna", "ben")
    with qtbot.waitSignal(dialog.accepted):
        qtbot.keyClick(dialog.findChild(QLineEdit, "study_new_annotator"), Qt.Key.Key_Return)
    assert dialog.result() == QDialog.DialogCode.Accepted


def test_annotators_are_renamed_and_removed(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    add(qtbot, dialog, "ben")
    table = dialog.findChild(QTableWidget, "study_annotators")
    remove = dialog.findChild(QPushButton, "study_remove_annotator")
    assert not remove.isEnabled()
    table.item(0, 0).setText("Anna Meyer")
    table.selectRow(1)
    qtbot.mouseClick(remove, Qt.MouseButton.LeftButton)
    assert dialog.study.annotators == ("Anna Meyer",)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("Anna", "Annotator 'anna' stands more than once (capitals do not count)."),
        ("a/b", "An annotator's name is also a folder's"),
        ("consensus", "No annotator can be called 'consensus'"),
    ],
)
def test_a_name_that_cannot_be_is_said_at_once(qtbot: QtBot, make: Make, names: str, said: str) -> None:
    dialog = make()
    add(qtbot, dialog, names)
    assert problem(dialog).startswith(said)
    table = dialog.findChild(QTableWidget, "study_annotators")
    table.item(1, 0).setText("ben")
    assert problem(dialog) == ""


def test_a_study_needs_a_title_and_a_method(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    dialog.findChild(QLineEdit, "study_title").setText("  ")
    assert problem(dialog) == "The study needs a title."
    dialog.findChild(QLineEdit, "study_title").setText("Trial")
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_keypoints"), Qt.Key.Key_Space)
    assert problem(dialog) == "Choose what is placed: keypoints, boxes or both."


def test_whoever_is_to_annotate_by_nothing_is_said(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_boxes"), Qt.Key.Key_Space)
    table = dialog.findChild(QTableWidget, "study_annotators")
    for column in (1, 2):
        table.item(0, column).setCheckState(Qt.CheckState.Unchecked)
    assert problem(dialog) == "No method is checked for anna: check one, or remove the name."


def test_marks_per_method_are_there_only_where_there_are_two(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    table = dialog.findChild(QTableWidget, "study_annotators")
    assert table.isColumnHidden(1)
    assert table.isColumnHidden(2)
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_boxes"), Qt.Key.Key_Space)
    assert not table.isColumnHidden(1)
    assert not table.isColumnHidden(2)


def test_no_more_volumes_come_twice_than_there_are(make: Make) -> None:
    dialog = make(count=3)
    repeats = dialog.findChild(QSpinBox, "study_repeats")
    repeats.setValue(99)
    assert repeats.value() == 3


def test_the_study_may_be_kept_elsewhere(
    qtbot: QtBot, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dialog = make()
    chosen = tmp_path / "studies"
    chosen.mkdir()
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(chosen))
    qtbot.mouseClick(dialog.findChild(QPushButton, "study_choose_folder"), Qt.MouseButton.LeftButton)
    assert dialog.folder == chosen
    assert dialog.study.volumes[0].path == "../Phantom/scan 0.npy"
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / STUDY_FILE).write_text("")
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(tmp_path / "taken"))
    qtbot.mouseClick(dialog.findChild(QPushButton, "study_choose_folder"), Qt.MouseButton.LeftButton)
    assert problem(dialog) == "There is a study in this folder already: choose another one."


def test_volumes_on_another_drive_are_said_in_words(
    qtbot: QtBot, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_common_root(*_: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    dialog = make()
    monkeypatch.setattr("os.path.relpath", no_common_root)
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(tmp_path / "elsewhere"))
    qtbot.mouseClick(dialog.findChild(QPushButton, "study_choose_folder"), Qt.MouseButton.LeftButton)
    assert "it lies on another drive than the study's folder" in problem(dialog)


def test_every_field_has_a_name_and_fits_a_small_screen(make: Make) -> None:
    dialog = make()
    for kind in (QLineEdit, QComboBox, QSpinBox, QTableWidget, QTreeWidget):
        for field in dialog.findChildren(kind):
            if field.objectName().startswith("study_"):
                assert field.accessibleName(), field.objectName()
    smallest = dialog.minimumSizeHint()
    assert smallest.width() <= 1000
    assert smallest.height() <= 660
