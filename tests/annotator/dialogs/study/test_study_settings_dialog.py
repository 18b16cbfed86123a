"""A study that people work in grows; what has been handed out stays, and what changes is shown before."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QSpinBox,
    QTableWidget,
    QTreeWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study import Study, StudyVolume, ViewingRules
from annotations.documents.study_building import with_annotators, with_rules
from annotator.dialogs.study.study_settings_dialog import StudySettingsDialog

FOLDER = Path("/studies/pilot")
STUDY = Study(
    title="Pilot",
    tool="needle",
    methods=("boxes", "keypoints"),
    annotators=("anna", "ben"),
    assignments={"ben": ("boxes",)},
    blind=True,
    order="shuffled",
    seed=3,
    viewing=ViewingRules(may_look=True, reviewers=("rita",)),
    volumes=(StudyVolume(id="v1", path="v1.npy", repeats=1), StudyVolume(id="v2", path="v2.npy")),
)


@pytest.fixture
def make(qtbot: QtBot) -> Callable[[], StudySettingsDialog]:
    def make() -> StudySettingsDialog:
        dialog = StudySettingsDialog(STUDY, FOLDER)
        # What a test has chosen would be asked about.
        qtbot.addWidget(dialog, before_close_func=lambda dialog: dialog.done(0))
        with qtbot.waitActive(dialog):
            dialog.show()
            dialog.activateWindow()
        return dialog

    return make


@pytest.fixture
def dialog(make: Callable[[], StudySettingsDialog]) -> StudySettingsDialog:
    return make()


def found(*names: str) -> list[FoundVolume]:
    return [FoundVolume(FOLDER / name) for name in names]


def changes(dialog: StudySettingsDialog) -> list[str]:
    return dialog.findChild(QPlainTextEdit, "study_changes").toPlainText().splitlines()


def ok(dialog: StudySettingsDialog) -> QPushButton:
    return dialog.findChild(QPushButton, "study_ok")


def test_nothing_is_changed_by_looking(dialog: StudySettingsDialog) -> None:
    assert dialog.study == STUDY
    assert changes(dialog) == ["Nothing is changed yet"]
    assert not ok(dialog).isEnabled()


def test_added_annotators_are_shown_before_they_are_written(
    qtbot: QtBot, dialog: StudySettingsDialog
) -> None:
    entry = dialog.findChild(QLineEdit, "study_new_annotator")
    assert entry.hasFocus()
    qtbot.keyClicks(entry, "cara")
    qtbot.keyClick(entry, Qt.Key.Key_Return)
    assert changes(dialog) == ["cara is to annotate by boxes and keypoints"]
    assert ok(dialog).isEnabled()
    assert dialog.study.annotators == ("anna", "ben", "cara")
    assert dialog.study.assignments == {"ben": ("boxes",)}


def test_those_who_annotate_can_neither_be_renamed_nor_removed(
    qtbot: QtBot, dialog: StudySettingsDialog
) -> None:
    table = dialog.findChild(QTableWidget, "study_annotators")
    assert not table.item(0, 0).flags() & Qt.ItemFlag.ItemIsEditable
    table.selectRow(0)
    assert not dialog.findChild(QPushButton, "study_remove_annotator").isEnabled()
    assert not dialog.findChild(QCheckBox, "study_shuffled").isEnabled()
    table.setFocus()
    qtbot.keyClick(table, Qt.Key.Key_Delete)
    assert dialog.study == STUDY
    why = dialog.findChild(QLabel, "study_staying")
    assert why.isVisible()
    assert why.text().startswith("Whoever is in the study already stays")


def test_what_comes_twice_already_is_shown(dialog: StudySettingsDialog) -> None:
    assert dialog.findChild(QLabel, "study_repeats_note").text() == "1 of those there comes twice already"
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    assert [volumes.topLevelItem(row).text(2) for row in range(2)] == ["comes twice", ""]


def test_added_volumes_are_taken_out_again_and_those_of_the_study_are_not(
    qtbot: QtBot, dialog: StudySettingsDialog
) -> None:
    dialog.add_volumes([*found("v3.npy"), FoundVolume(FOLDER / "v4.npy", problem="it is empty")])
    assert [volume.id for volume in dialog.study.volumes] == ["v1", "v2", "v3"]
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    take_out = dialog.findChild(QPushButton, "study_take_out")
    volumes.setCurrentItem(volumes.topLevelItem(0))
    assert not take_out.isEnabled()
    volumes.setFocus()
    qtbot.keyClick(volumes, Qt.Key.Key_Delete)
    assert volumes.topLevelItemCount() == 4
    volumes.selectAll()
    qtbot.mouseClick(take_out, Qt.MouseButton.LeftButton)
    assert volumes.topLevelItemCount() == 2
    assert dialog.study == STUDY


def test_what_somebody_else_has_changed_is_put_below_what_was_typed(
    qtbot: QtBot, dialog: StudySettingsDialog
) -> None:
    entry = dialog.findChild(QLineEdit, "study_new_annotator")
    qtbot.keyClicks(entry, "cara\r")
    dialog.findChild(QLineEdit, "study_title").setText("Main")
    dialog.add_volumes([*found("v3.npy"), FoundVolume(FOLDER / "v4.npy", problem="it is empty")])
    dialog.findChild(QSpinBox, "study_repeats").setValue(1)
    theirs = with_rules(with_annotators(STUDY, ["dora"]), blind=False)
    anew = dialog.on_top_of(theirs)
    qtbot.addWidget(anew, before_close_func=lambda dialog: dialog.done(0))
    assert anew.before == theirs
    assert anew.study.annotators == ("anna", "ben", "dora", "cara")
    assert (anew.study.title, anew.study.blind) == ("Main", False)
    assert [(volume.id, volume.repeats) for volume in anew.study.volumes[2:]] == [("v3", 1)]
    assert "Somebody else has changed the study meanwhile" in anew.findChild(QLabel, "study_problem").text()
    assert ok(anew).isEnabled()
    assert anew.findChild(QTreeWidget, "study_volumes").topLevelItemCount() == 4


def test_added_volumes_are_shown_and_can_come_twice(dialog: StudySettingsDialog) -> None:
    repeats = dialog.findChild(QSpinBox, "study_repeats")
    assert not repeats.isEnabled()
    dialog.add_volumes(found("v2.npy", "more/v3.npy", "more/v4.npy"))
    assert dialog.findChild(QLabel, "study_added").text() == "2 added; 1 is in the list already"
    repeats.setValue(1)
    volumes = dialog.findChild(QTreeWidget, "study_volumes")
    bold = [volumes.topLevelItem(row).font(0).bold() for row in range(4)]
    assert bold == [False, False, True, True]
    assert changes(dialog)[0] == "2 new volumes: v3, v4"
    assert changes(dialog)[1].startswith("A second time: v")
    study = dialog.study
    assert study.volumes[:2] == STUDY.volumes
    assert [volume.batch for volume in study.volumes[2:]] == [1, 1]
    assert sum(volume.repeats for volume in study.volumes[2:]) == 1


def test_folders_and_files_are_asked_for(
    qtbot: QtBot, dialog: StudySettingsDialog, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: "/data/new")
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *_: (["/data/a.npy", "/data/b.npy"], ""))
    for name, paths in (
        ("study_add_folder", [Path("/data/new")]),
        ("study_add_files", [Path("/data/a.npy"), Path("/data/b.npy")]),
    ):
        with qtbot.waitSignal(dialog.volumes_requested) as asked:
            qtbot.mouseClick(dialog.findChild(QPushButton, name), Qt.MouseButton.LeftButton)
        assert asked.args == [paths]


def test_rules_are_changed_and_the_changes_told(qtbot: QtBot, dialog: StudySettingsDialog) -> None:
    dialog.findChild(QLineEdit, "study_title").setText("Main")
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_blind"), Qt.Key.Key_Space)
    qtbot.keyClick(dialog.findChild(QCheckBox, "study_may_look"), Qt.Key.Key_Space)
    dialog.findChild(QLineEdit, "study_reviewers").clear()
    assert changes(dialog) == [
        "The title becomes “Main”",
        "Annotators see the volumes' names",
        "Looking before one's own is done is not possible",
        "Reviewers: everyone who does not annotate",
    ]
    assert (dialog.study.seed, dialog.study.order) == (3, "shuffled")


def test_what_cannot_be_is_said_and_cannot_be_written(qtbot: QtBot, dialog: StudySettingsDialog) -> None:
    dialog.findChild(QLineEdit, "study_reviewers").setText("a/b")
    assert dialog.study is None
    assert (
        dialog.findChild(QLabel, "study_problem").text().startswith("A reviewer's name can become a folder's")
    )
    assert not ok(dialog).isEnabled()


def test_it_fits_a_small_screen(dialog: StudySettingsDialog) -> None:
    dialog.add_volumes(found(*(f"more/scan {number}.npy" for number in range(40))))
    assert dialog.minimumSizeHint().width() <= 1000
    assert dialog.minimumSizeHint().height() <= 660
