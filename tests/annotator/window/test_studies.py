"""A study is made, opened, changed and checked from the menus."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QLineEdit, QPlainTextEdit, QTreeWidget
from pytestqt.qtbot import QtBot

from annotations.documents import study_building
from annotations.documents.study import STUDY_FILE, ViewingRules, load_study, save_study
from annotations.documents.study_building import with_annotators
from annotations.durable_files import SaveError
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.study.study_check_dialog import StudyCheckDialog
from annotator.dialogs.study.study_dialog import StudyDialog
from annotator.dialogs.study.study_settings_dialog import StudySettingsDialog
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.window.main_window import MainWindow
from tests.annotator.blind_study import write_study
from tests.annotator.conftest import open_and_wait, write_volume

CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "series"
    folder.mkdir()
    for seed, name in enumerate(("a.npy", "b.npy")):
        write_volume(folder / name, seed)
    return folder


@pytest.fixture
def choose(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path], None]:
    """Choose a folder whenever one is asked for."""

    def choose(path: Path) -> None:
        monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(path))

    return choose


@pytest.fixture
def window(make_window: Callable[..., MainWindow], empty_session: Session) -> MainWindow:
    """A window with nothing open."""
    return make_window(empty_session)


@pytest.fixture
def at_study(
    qtbot: QtBot, window: MainWindow, person, folder: Path, choose: Callable[[Path], None]
) -> MainWindow:
    """The window with a study open that was made in it."""
    choose(folder)
    person.press(Qt.Key.Key_N, CONTROL)
    dialog = person.dialog(StudyDialog)
    person.click(dialog, "study_ok")
    qtbot.waitUntil(lambda: window.session.volume is not None and not window.session.jobs.running)
    return window


def test_a_new_study_is_made_and_opened(at_study: MainWindow, folder: Path) -> None:
    study = load_study(folder)
    assert (study.title, study.annotators, study.order) == ("series", ("anna",), "shuffled")
    assert at_study.session.studies.study == study
    assert "series" in at_study.windowTitle()


def test_a_folder_that_is_no_good_is_said_and_leaves_nothing(
    qtbot: QtBot, window: MainWindow, person, tmp_path: Path, choose: Callable[[Path], None]
) -> None:
    (tmp_path / "none").mkdir()
    choose(tmp_path / "none")
    person.action("new_study").trigger()
    dialog = person.dialog(ErrorDialog)
    said = " ".join(label.text() for label in dialog.findChildren(QLabel))
    dialog.reject()
    assert "here is no volume in this folder" in said
    assert not (tmp_path / "none" / STUDY_FILE).exists()


def test_a_new_study_that_cannot_be_written_leaves_the_dialog_as_it_was(
    qtbot: QtBot,
    window: MainWindow,
    person,
    folder: Path,
    choose: Callable[[Path], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise SaveError("it could not be written", where=folder, remedy="Choose another folder")

    monkeypatch.setattr(study_building, "save_study", refuse)
    choose(folder)
    person.action("new_study").trigger()
    dialog = person.dialog(StudyDialog)
    qtbot.keyClicks(dialog.findChild(QLineEdit, "study_new_annotator"), "ben\r")
    person.click(dialog, "study_ok")
    said = dialog.findChild(QLabel, "study_problem")
    qtbot.waitUntil(lambda: "could not be written" in said.text())
    assert dialog.isVisible()
    assert dialog.study.annotators == ("anna", "ben")
    monkeypatch.undo()
    person.click(dialog, "study_ok")
    qtbot.waitUntil(lambda: window.session.volume is not None and not window.session.jobs.running)
    assert load_study(folder).annotators == ("anna", "ben")
    assert not person.has_dialog()


def test_what_somebody_else_changed_and_what_was_typed_are_both_in_the_study(
    qtbot: QtBot, at_study: MainWindow, person, folder: Path
) -> None:
    person.action("study_settings").trigger()
    dialog = person.dialog(StudySettingsDialog)
    qtbot.keyClicks(dialog.findChild(QLineEdit, "study_new_annotator"), "ben\r")
    save_study(with_annotators(load_study(folder), ["dora"]), folder)
    with qtbot.waitSignal(dialog.finished):
        person.click(dialog, "study_ok")
    anew = person.dialog(StudySettingsDialog)
    assert "Somebody else has changed the study" in anew.findChild(QLabel, "study_problem").text()
    person.click(anew, "study_ok")
    qtbot.waitUntil(lambda: at_study.session.studies.study.annotators == ("anna", "dora", "ben"))
    assert load_study(folder).annotators == ("anna", "dora", "ben")


def test_settings_and_check_are_of_an_open_study(window: MainWindow) -> None:
    actions = window.actions_by_name
    assert actions["new_study"].isEnabled()
    assert not actions["study_settings"].isEnabled()
    assert not actions["check_study"].isEnabled()


def test_a_study_grows_in_its_settings_and_what_is_open_stays(
    qtbot: QtBot, at_study: MainWindow, person, folder: Path, tmp_path: Path, choose: Callable[[Path], None]
) -> None:
    session, document = at_study.session, at_study.session.document
    person.action("study_settings").trigger()
    dialog = person.dialog(StudySettingsDialog)
    choose(tmp_path / "gone")
    person.click(dialog, "study_add_folder")
    note = dialog.findChild(QLabel, "study_added")
    qtbot.waitUntil(lambda: "gone" in note.text())
    (tmp_path / "more").mkdir()
    write_volume(tmp_path / "more" / "c.npy", 5)
    choose(tmp_path / "more")
    person.click(dialog, "study_add_folder")
    qtbot.waitUntil(lambda: note.text() == "1 added")
    qtbot.keyClicks(dialog.findChild(QLineEdit, "study_new_annotator"), "ben\r")
    assert dialog.findChild(QPlainTextEdit, "study_changes").toPlainText().splitlines() == [
        "ben is to annotate by keypoints",
        "1 new volume: c",
    ]
    person.click(dialog, "study_ok")
    qtbot.waitUntil(lambda: len(session.items) == 3)
    assert load_study(folder).annotators == ("anna", "ben")
    assert session.document is document


def test_the_check_lists_what_is_missing_and_opens_annotations(
    qtbot: QtBot, at_study: MainWindow, person
) -> None:
    session = at_study.session
    session.set_flag("nothing to see")
    session.set_status("done")
    person.action("check_study").trigger()
    dialog = person.dialog(StudyCheckDialog)
    tree = dialog.findChild(QTreeWidget, "study_check_list")
    rows = [tree.topLevelItem(row) for row in range(tree.topLevelItemCount())]
    assert [item.text(2) for item in rows if item.text(0) == "Missing"] == [
        "anna, by keypoints: of 2, 1 is not begun"
    ]
    [unplaced] = [item for item in rows if item.text(0) == "Keypoint"]
    session.open_item(1)
    qtbot.waitUntil(lambda: session.current_index == 1 and not session.jobs.running)
    dialog.activateWindow()
    tree.setCurrentItem(unplaced)
    qtbot.keyClick(tree, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: session.current_index == 0 and not session.jobs.running)
    assert session.studies.study is not None


def test_who_works_blind_is_shown_neither_settings_nor_check(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    options: SessionOptions,
    person_at,
    tmp_path: Path,
) -> None:
    folder = write_study(tmp_path / "study")
    session = Session(replace(options, annotator_name="anna"))
    window = make_window(session)
    open_and_wait(qtbot, session, folder)
    at_window = person_at(window)
    for name in ("study_settings", "check_study"):
        with qtbot.waitSignal(session.message_posted) as said:
            window.actions_by_name[name].trigger()
        assert "You annotate this study blind" in said.args[0]
        assert ("settings" in said.args[0]) == ("they are for whoever" in said.args[0])
    assert not session.jobs.running
    assert not at_window.has_dialog()
    session.shut_down()


def test_a_list_of_findings_is_not_left_to_somebody_who_works_blind(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    options: SessionOptions,
    person_at,
    tmp_path: Path,
) -> None:
    folder = write_study(tmp_path / "study", viewing=ViewingRules(reviewers=("rita",)))
    session = Session(replace(options, annotator_name="rita"))
    window = make_window(session)
    open_and_wait(qtbot, session, folder)
    window.actions_by_name["check_study"].trigger()
    dialog = person_at(window).dialog(StudyCheckDialog)
    session.set_annotator_name("anna")
    qtbot.waitUntil(lambda: not dialog.isVisible())
    qtbot.waitUntil(lambda: not session.jobs.running)
    session.shut_down()
