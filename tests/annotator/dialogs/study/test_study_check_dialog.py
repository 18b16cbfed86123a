"""What a check has found is listed, and leads to the annotation that it is about."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QCheckBox, QLabel, QPushButton, QStyleOptionViewItem, QTreeWidget
from pytestqt.qtbot import QtBot

from annotations.documents.checks import Finding
from annotations.documents.study import Study
from annotator.dialogs.study.study_check_dialog import StudyCheckDialog
from annotator.session.studies import StudyReport

STUDY = Study(title="Pilot", tool="needle")


@pytest.fixture
def annotation(tmp_path: Path) -> Path:
    path = tmp_path / "annotations" / "anna" / "v1.keypoints.json"
    path.parent.mkdir(parents=True)
    path.write_text("{}")
    return path


@pytest.fixture
def dialog(qtbot: QtBot, tmp_path: Path, annotation: Path) -> StudyCheckDialog:
    dialog = StudyCheckDialog()
    qtbot.addWidget(dialog)
    findings = (
        (tmp_path / "study.toml", Finding("note", "only anna annotates by keypoints")),
        (tmp_path / "volumes" / "v1.npy", Finding("volume", "it is gone")),
        (annotation, Finding("keypoint", "it is marked as done, but tip are unplaced")),
    )
    dialog.show_report(StudyReport(STUDY, tmp_path, findings))
    with qtbot.waitActive(dialog):
        dialog.show()
        dialog.activateWindow()
    return dialog


def rows(dialog: StudyCheckDialog) -> list[tuple[str, ...]]:
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    items = [tree.topLevelItem(row) for row in range(tree.topLevelItemCount())]
    return [tuple(item.text(column) for column in range(3)) for item in items if not item.isHidden()]


def test_findings_come_before_notes(dialog: StudyCheckDialog) -> None:
    assert dialog.findChild(QLabel, "study_check_heading").text() == "2 findings, 1 note"
    assert rows(dialog) == [
        ("Volume", "volumes/v1.npy", "it is gone"),
        ("Keypoint", "annotations/anna/v1.keypoints.json", "it is marked as done, but tip are unplaced"),
        ("Note", "study.toml", "only anna annotates by keypoints"),
    ]


def test_the_chosen_finding_is_shown_in_full(dialog: StudyCheckDialog, annotation: Path) -> None:
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    tree.setCurrentItem(tree.topLevelItem(1))
    whole = dialog.findChild(QLabel, "study_check_whole").text()
    assert whole == f"{annotation}\nit is marked as done, but tip are unplaced"


def test_notes_can_be_left_out(qtbot: QtBot, dialog: StudyCheckDialog) -> None:
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_check_notes"), Qt.Key.Key_Space)
    assert [row[0] for row in rows(dialog)] == ["Volume", "Keypoint"]


def test_an_annotation_is_opened_by_double_click(
    qtbot: QtBot, dialog: StudyCheckDialog, annotation: Path
) -> None:
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    with qtbot.waitSignal(dialog.open_requested) as asked:
        tree.setCurrentItem(tree.topLevelItem(1))
        middle = tree.visualItemRect(tree.topLevelItem(1)).center()
        qtbot.mouseClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=middle)
        qtbot.mouseDClick(tree.viewport(), Qt.MouseButton.LeftButton, pos=middle)
    assert asked.args == [annotation]


def test_what_is_no_annotation_opens_nothing(qtbot: QtBot, dialog: StudyCheckDialog) -> None:
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    tree.setCurrentItem(tree.topLevelItem(0))
    with qtbot.assertNotEmitted(dialog.open_requested):
        qtbot.keyClick(tree, Qt.Key.Key_Return)
    hint = dialog.findChild(QLabel, "study_check_hint")
    assert hint.text() == ""
    tree.setCurrentItem(tree.topLevelItem(1))
    assert hint.text() == "Return or a double click opens the annotation."


def test_a_long_place_keeps_the_files_name(dialog: StudyCheckDialog) -> None:
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    option = QStyleOptionViewItem()
    option.features |= QStyleOptionViewItem.ViewItemFeature.WrapText
    index = tree.model().index(1, 1)
    tree.itemDelegateForColumn(1).initStyleOption(option, index)
    assert not option.features & QStyleOptionViewItem.ViewItemFeature.WrapText
    assert option.textElideMode == Qt.TextElideMode.ElideLeft


def test_the_list_is_copied_as_a_table(qtbot: QtBot, dialog: StudyCheckDialog) -> None:
    qtbot.mouseClick(dialog.findChild(QPushButton, "study_check_copy"), Qt.MouseButton.LeftButton)
    lines = QGuiApplication.clipboard().text().splitlines()
    assert lines == ["\t".join(row) for row in rows(dialog)]


def test_good_news_is_said(dialog: StudyCheckDialog, tmp_path: Path) -> None:
    dialog.show_report(StudyReport(STUDY, tmp_path, ()))
    assert dialog.findChild(QLabel, "study_check_heading").text() == "Nothing is wrong"
    assert rows(dialog) == []
