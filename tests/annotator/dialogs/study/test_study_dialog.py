"""A new study is described in one dialog, which says at once what cannot be."""

import os
from collections.abc import Callable, Sequence
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
    QMessageBox,
    QPushButton,
    QSpinBox,
    QTableWidget,
    QTreeWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study import STUDY_FILE
from annotations.durable_files import SaveError
from annotations.geometry.tool_library import shipped_tools
from annotator.dialogs.study.study_dialog import StudyDialog
from annotator.looks import theme
from annotator.session.studies import StudyProposal

Make = Callable[..., StudyDialog]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "Phantom"
    folder.mkdir()
    return folder


@pytest.fixture
def make(qtbot: QtBot, folder: Path) -> Make:
    def make(
        annotator: str = "anna", count: int = 12, more: Sequence[FoundVolume] = (), belongs_to: str = ""
    ) -> StudyDialog:
        found = (FoundVolume(folder / f"scan {number}.npy") for number in range(count))
        proposal = StudyProposal(folder, (*found, *more), shipped_tools(), 7, belongs_to)
        dialog = StudyDialog(proposal, annotator, "needle")
        # What a test has chosen would be asked about.
        qtbot.addWidget(dialog, before_close_func=lambda dialog: dialog.done(0))
        with qtbot.waitActive(dialog):
            dialog.show()
            dialog.activateWindow()
        return dialog

    return make


def problem(dialog: StudyDialog) -> str:
    label = dialog.findChild(QLabel, "study_problem")
    assert dialog.findChild(QPushButton, "study_ok").isEnabled() == (not label.text())
    assert (dialog.study is None) == bool(label.text())
    return label.text()


def click(qtbot: QtBot, dialog: StudyDialog, name: str) -> None:
    qtbot.mouseClick(dialog.findChild(QPushButton, name), Qt.MouseButton.LeftButton)


def leaving(dialog: StudyDialog) -> QMessageBox | None:
    return dialog.findChild(QMessageBox, "study_leave_question")


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
    with qtbot.waitSignal(dialog.submitted):
        qtbot.keyClick(dialog.findChild(QLineEdit, "study_new_annotator"), Qt.Key.Key_Return)
    dialog.finish()
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
        ("Anna", "'anna' stands more than once (capitals do not count)."),
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


def test_no_more_volumes_come_twice_than_there_are_and_that_is_said(qtbot: QtBot, make: Make) -> None:
    dialog = make(count=3)
    repeats = dialog.findChild(QSpinBox, "study_repeats")
    note = dialog.findChild(QLabel, "study_repeats_note")
    repeats.setFocus()
    repeats.selectAll()
    qtbot.keyClicks(repeats, "99")
    assert repeats.value() == 3
    assert note.text().endswith("are too many: 3 are new")
    assert sum(volume.repeats for volume in dialog.study.volumes) == 3
    repeats.selectAll()
    qtbot.keyClicks(repeats, "1")
    assert (repeats.value(), note.text()) == (1, "")
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    assert [volumes.topLevelItem(row).text(2) for row in range(3)].count("comes twice") == 1


def test_all_that_cannot_be_is_said_and_the_rows_are_marked(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    add(qtbot, dialog, "../x, Anna")
    dialog.findChild(QLineEdit, "study_reviewers").setText("a/b")
    lines = problem(dialog).splitlines()
    assert [line[:12] for line in lines] == ["'anna' stand", "An annotator", "A reviewer's"]
    assert lines[1].count("../x") == 1
    table = dialog.findChild(QTableWidget, "study_annotators")
    marked = [
        table.item(row, 0).foreground().color() == theme.colors(dialog.palette()).error for row in range(3)
    ]
    assert marked == [True, True, True]
    table.selectRow(2)
    table.setFocus()
    qtbot.keyClick(table, Qt.Key.Key_Delete)
    assert dialog.findChild(QLabel, "study_problem").text().startswith("An annotator")
    assert table.item(0, 0).toolTip() == ""


def test_nothing_moves_when_a_problem_is_said(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    table = dialog.findChild(QTableWidget, "study_annotators")
    before = (table.mapTo(dialog, table.rect().bottomLeft()), dialog.size())
    add(qtbot, dialog, "a/b")
    qtbot.wait(1)
    assert problem(dialog)
    assert (table.mapTo(dialog, table.rect().bottomLeft()), dialog.size()) == before


def test_what_cannot_be_read_is_left_out_unless_somebody_keeps_it(
    qtbot: QtBot, make: Make, folder: Path
) -> None:
    broken = FoundVolume(folder / "broken.npy", problem="its content is of no format that can be opened")
    twin = FoundVolume(folder / "twin.npy", same_as=folder / "scan 0.npy")
    dialog = make(count=2, more=[broken, twin])
    assert [volume.id for volume in dialog.study.volumes] == ["scan-0", "scan-1", "twin"]
    remarks = dialog.findChild(QLabel, "study_volume_remarks").text().splitlines()
    assert remarks == [
        "broken.npy: its content is of no format that can be opened. It is left out unless you check it.",
        "twin.npy is the same volume as scan 0.npy.",
    ]
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    volumes.topLevelItem(2).setCheckState(0, Qt.CheckState.Checked)
    assert [volume.id for volume in dialog.study.volumes] == ["scan-0", "scan-1", "broken", "twin"]
    assert dialog.findChild(QSpinBox, "study_repeats").maximum() == 4


def test_volumes_are_taken_out_of_the_list(qtbot: QtBot, make: Make) -> None:
    dialog = make(count=3)
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    volumes.setFocus()
    volumes.setCurrentItem(volumes.topLevelItem(0))
    qtbot.keyClick(volumes, Qt.Key.Key_Delete)
    volumes.setCurrentItem(volumes.topLevelItem(1))
    click(qtbot, dialog, "study_take_out")
    assert [volume.id for volume in dialog.study.volumes] == ["scan-1"]
    assert dialog.findChild(QLabel, "study_heading").text() == "A study of 1 volume"
    volumes.topLevelItem(0).setCheckState(0, Qt.CheckState.Unchecked)
    assert problem(dialog) == "The study needs a volume: check one."


def test_a_failure_leaves_all_that_was_typed_and_says_why(qtbot: QtBot, make: Make, folder: Path) -> None:
    dialog = make()
    add(qtbot, dialog, "ben")
    with qtbot.waitSignal(dialog.submitted):
        click(qtbot, dialog, "study_ok")
    assert not dialog.findChild(QPushButton, "study_ok").isEnabled()
    dialog.show_failure(SaveError("it could not be written", where=folder, remedy="Free space"))
    assert dialog.isVisible()
    said = dialog.findChild(QLabel, "study_problem")
    assert said.text() == f"{folder}: it could not be written. Free space."
    assert dialog.study.annotators == ("anna", "ben")
    assert dialog.findChild(QPushButton, "study_ok").isEnabled()
    add(qtbot, dialog, "cara")
    assert said.text() == ""


def test_a_folder_that_is_read_only_is_said_at_once(
    qtbot: QtBot, make: Make, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert problem(make()) == f"You may not write in {folder}: choose another folder to keep the study in."


def test_that_the_volumes_belong_to_a_study_is_said(make: Make) -> None:
    dialog = make(belongs_to="the study “Pilot”")
    said = dialog.findChild(QLabel, "study_belongs_to").text()
    assert said == "These volumes belong to the study “Pilot” already: this is to be another one."


def test_an_untouched_dialog_is_left_without_a_question(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert not dialog.isVisible()
    assert leaving(dialog) is None


def test_choices_are_not_left_without_a_question(qtbot: QtBot, make: Make) -> None:
    dialog = make()
    add(qtbot, dialog, "ben")
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert dialog.isVisible()
    question = leaving(dialog)
    question.button(QMessageBox.StandardButton.Cancel).click()
    qtbot.waitUntil(lambda: leaving(dialog) is None)
    assert dialog.isVisible()
    click(qtbot, dialog, "study_cancel")
    leaving(dialog).button(QMessageBox.StandardButton.Discard).click()
    assert not dialog.isVisible()
    assert dialog.result() == QDialog.DialogCode.Rejected


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
    inside = tmp_path / "taken" / "inside"
    inside.mkdir()
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(inside))
    qtbot.mouseClick(dialog.findChild(QPushButton, "study_choose_folder"), Qt.MouseButton.LeftButton)
    assert problem(dialog) == "This folder lies inside the study in taken: choose another one."


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
