"""The window on a document that somebody else has open: it says so, and offers nothing to change it."""

import json
import os
import time

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QTableView, QToolButton, QWidget

from annotations.documents.locks import STALE_S, lock_path
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.files.takeover_dialog import TakeoverDialog
from annotator.session import Session

HERE_UM = (200.0, 200.0, 200.0)


@pytest.fixture
def first_window(qtbot, options, volume_path):
    """Another window of the same person, which has the document open."""
    session = Session(options)
    with qtbot.waitSignal(session.volume_changed):
        session.open_path(volume_path)
    yield session
    session.shut_down()


@pytest.fixture
def read_only(first_window, person):
    """A person at the second window."""
    return person


def text_of(person, name: str) -> str:
    label = person.window.findChild(QLabel, name)
    assert label is not None
    return label.text() if label.isVisibleTo(person.window) else ""


def test_it_says_so_in_the_title_and_at_its_foot(read_only):
    assert read_only.window.windowTitle().startswith("v001.npy (read-only)")
    assert text_of(read_only, "status_mode") == "Read-only"
    assert text_of(read_only, "status_saved") == ""
    hint = read_only.window.findChild(QWidget, "status_hint")
    assert "in another window on this computer" in hint.toolTip() + hint.text()


def test_what_would_change_the_document_is_disabled(read_only, session):
    session.activate("k1")
    for name in ("place_mode", "pose_mode", "mark_done", "save", "undo", "lock", "clear", "derive"):
        assert not read_only.action(name).isEnabled()
    for name in ("save_as", "copy_pose", "next_unplaced", "keypoint_1", "zoom_fit", "close_volume"):
        assert read_only.action(name).isEnabled()


def test_neither_the_table_nor_the_pose_panel_offers_a_change(read_only, session):
    table = read_only.window.findChild(QTableView, "keypoints_table")
    assert table is not None
    model = table.model()
    changing = Qt.ItemFlag.ItemIsUserCheckable | Qt.ItemFlag.ItemIsEditable
    for column in range(model.columnCount()):
        assert not model.index(0, column).flags() & changing
        assert model.index(0, column).flags() & Qt.ItemFlag.ItemIsSelectable
    assert not read_only.window.findChild(QToolButton, "pose_enter").isEnabled()


def test_clicks_and_drags_change_nothing(read_only, session):
    before = session.document
    session.set_mode("place")
    read_only.click_slice(0, HERE_UM)
    read_only.drag_slice(0, HERE_UM, (200.0, 300.0, 250.0))
    assert session.document is before
    assert session.view.preview is None


def test_it_can_be_changed_once_it_is_closed_elsewhere_and_opened_again(
    qtbot, read_only, session, first_window
):
    first_window.close_volume()
    with qtbot.waitSignal(session.volume_changed):
        session.open_item(0)
    assert "read-only" not in read_only.window.windowTitle()
    assert text_of(read_only, "status_saved") == "Saved"
    assert read_only.action("mark_done").isEnabled()


def test_the_reason_lasts_beside_the_keypoints_with_a_way_to_try_again(
    qtbot, read_only, session, first_window
):
    assert session.read_only_reason in text_of(read_only, "read_only_text")
    first_window.close_volume()
    with qtbot.waitSignal(session.volume_changed):
        read_only.click(read_only.window, "try_again")
    assert text_of(read_only, "read_only_text") == ""
    assert read_only.window.status.currentMessage() == "It is free now: you can go on"


def lock_elsewhere(session: Session, age_s: float) -> None:
    path = lock_path(session.annotation_path)
    said = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(said | {"person": "bob", "host": "lab-3", "token": "theirs"}))
    written = time.time() - age_s
    os.utime(path, (written, written))


def test_a_document_that_is_taken_over_becomes_read_only_and_the_person_is_told(person, session):
    session.place(HERE_UM)
    lock_elsewhere(session, 0)
    session._locks.check()
    person.dialog(ErrorDialog).reject()
    assert "read-only" in person.window.windowTitle()
    assert text_of(person, "status_mode") == "Read-only"
    assert text_of(person, "status_saved") == "Unsaved"
    assert not person.action("undo").isEnabled()


@pytest.mark.parametrize("choice", ["take_over", "cancel"])
def test_a_silent_computers_document_is_taken_over_only_when_asked_for(qtbot, person, session, choice):
    session.place(HERE_UM)
    session.save()
    lock_elsewhere(session, STALE_S + 60)
    path = session._worklist.path
    session.close_volume()
    session.open_path(path)
    dialog = person.dialog(TakeoverDialog)
    assert session.read_only_reason
    person.click(dialog, f"takeover_{choice}")
    if choice == "take_over":
        qtbot.waitUntil(lambda: session.document is not None and not session.read_only_reason)
    else:
        assert session.read_only_reason
