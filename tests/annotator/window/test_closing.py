"""Nothing that is open is left before it is saved, or before the person says so."""

import errno
import shutil
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractSpinBox, QFileDialog, QLabel

from annotations.documents.files import load_annotation
from annotations.documents.recovery import find_recoveries
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.files.overwrite_dialog import OverwriteDialog
from annotator.dialogs.files.recovery_dialog import RecoveryDialog
from annotator.dialogs.files.unsaved_dialog import UnsavedDialog
from annotator.session import Session

A_UM = (200.0, 300.0, 250.0)
CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def full_disk(monkeypatch):
    """A disk without room for annotations; the journal, on another one, still works."""
    replace = Path.replace

    def fail(self: Path, target: Path) -> Path:
        if "annotations" in self.parts:
            raise OSError(errno.ENOSPC, "No space left on device")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", fail)
    return monkeypatch


@pytest.fixture
def two_volumes(qtbot, person, session, volume_path):
    """A second volume beside the first, both in the list."""
    for name in ("v001.npy", "v001.npy.volume.toml"):
        shutil.copy(volume_path.with_name(name), volume_path.with_name(name.replace("v001", "v002")))
    person.window.open_path(volume_path.parent)
    qtbot.waitUntil(lambda: len(session.items) == 2 and session.volume is not None)


def test_closing_saves(window, session):
    session.place(A_UM)
    path = session.annotation_path
    window.close()
    assert not window.isVisible()
    assert load_annotation(path)[0].positions_um == {"k0": A_UM}


def test_quitting_by_key_closes(person, session):
    person.press(Qt.Key.Key_Q, CONTROL)
    assert not person.window.isVisible()


def test_full_disk_keeps_the_window_open_until_there_is_room(person, session, full_disk):
    session.place(A_UM)
    person.window.close()
    dialog = person.dialog(UnsavedDialog)
    assert "No space left" in dialog.findChild(QLabel, "unsaved_problem").text()
    assert person.window.isVisible()
    person.click(dialog, "unsaved_retry")
    dialog = person.dialog(UnsavedDialog)
    full_disk.undo()
    path = session.annotation_path
    person.click(dialog, "unsaved_retry")
    assert not person.window.isVisible()
    assert load_annotation(path)[0].positions_um == {"k0": A_UM}


def test_staying_changes_nothing(qtbot, person, session, full_disk):
    session.place(A_UM)
    person.window.close()
    person.click(person.dialog(UnsavedDialog), "unsaved_cancel")
    qtbot.waitUntil(lambda: not person.has_dialog())
    assert person.window.isVisible()
    assert session.document.positions_um == {"k0": A_UM}
    assert session.unsaved


def test_saving_elsewhere_lets_go(person, session, full_disk, tmp_path):
    session.place(A_UM)
    other = tmp_path / "other" / "mine.json"
    full_disk.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(other), ""))
    person.window.close()
    person.click(person.dialog(UnsavedDialog), "unsaved_save_elsewhere")
    assert not person.window.isVisible()
    assert load_annotation(other)[0].positions_um == {"k0": A_UM}


def test_quitting_anyway_leaves_the_edits_to_recovery(
    qtbot, person, session, full_disk, options, make_window
):
    session.place(A_UM)
    person.window.close()
    person.click(person.dialog(UnsavedDialog), "unsaved_leave")
    assert not person.window.isVisible()
    (recovery,) = find_recoveries(options.recovery_folder)
    assert recovery.document.positions_um == {"k0": A_UM}
    full_disk.undo()

    later = Session(options)
    again = make_window(later)
    later.offer_recoveries()
    person.window = again
    person.click(person.dialog(RecoveryDialog), "recovery_recover")
    qtbot.waitUntil(lambda: later.document is not None)
    assert later.document.positions_um == {"k0": A_UM}
    assert later.unsaved
    assert later.save()
    later.shut_down()


def test_saving_by_key_says_each_time_that_it_failed(qtbot, person, session, full_disk):
    session.place(A_UM)
    for _ in range(2):
        person.press(Qt.Key.Key_S, CONTROL)
        person.click(person.dialog(UnsavedDialog), "unsaved_cancel")
        qtbot.waitUntil(lambda: not person.has_dialog())
    full_disk.undo()
    person.press(Qt.Key.Key_S, CONTROL)
    assert not session.unsaved


def test_autosave_that_fails_asks_once(qtbot, person, session, full_disk):
    session.place(A_UM)
    session.save()
    person.click(person.dialog(UnsavedDialog), "unsaved_leave")
    qtbot.waitUntil(lambda: not person.has_dialog())
    assert session.document.positions_um == {"k0": A_UM}
    session.place(A_UM)
    session.save()
    assert not person.has_dialog()


@pytest.fixture
def changed_meanwhile(session) -> Path:
    """The open document's file, after another program has written it."""
    session.place(A_UM)
    assert session.save()
    path = session.annotation_path
    path.write_text(path.read_text().replace('"sure"', '"unsure"'))
    session.place((400.0, 400.0, 200.0))
    return path


def test_file_changed_by_another_program_is_not_overwritten_unasked(person, session, changed_meanwhile):
    theirs = changed_meanwhile.read_text()
    person.press(Qt.Key.Key_S, CONTROL)
    dialog = person.dialog(OverwriteDialog)
    assert changed_meanwhile.read_text() == theirs
    person.click(dialog, "overwrite_overwrite")
    saved = load_annotation(changed_meanwhile)[0]
    assert len(saved.positions_um) == 2
    assert changed_meanwhile.with_name(changed_meanwhile.name + ".bak").read_text() == theirs


def test_their_version_can_be_taken(qtbot, person, session, changed_meanwhile):
    person.press(Qt.Key.Key_S, CONTROL)
    person.click(person.dialog(OverwriteDialog), "overwrite_reload")
    qtbot.waitUntil(lambda: session.document is not None and not session.jobs.running)
    assert session.document.keypoint("k0").certainty == "unsure"
    assert len(session.document.positions_um) == 1


def test_taking_theirs_on_closing_leaves_ours_to_recovery(person, session, changed_meanwhile, options):
    theirs = changed_meanwhile.read_text()
    person.window.close()
    person.click(person.dialog(OverwriteDialog), "overwrite_reload")
    assert not person.window.isVisible()
    assert changed_meanwhile.read_text() == theirs
    (recovery,) = find_recoveries(options.recovery_folder)
    assert len(recovery.document.positions_um) == 2


def test_number_that_is_being_typed_is_saved_on_closing(person, session):
    session.place(A_UM)
    session.activate("k0")
    path = session.annotation_path
    box = person.window.findChild(QAbstractSpinBox, "position_x")
    box.setFocus()
    box.selectAll()
    person.type_text("321")
    person.window.close()
    assert not person.window.isVisible()
    assert load_annotation(path)[0].positions_um["k0"][0] == 321.0


def test_closing_over_a_changed_file_asks_and_then_closes(person, session, changed_meanwhile):
    person.window.close()
    dialog = person.dialog(OverwriteDialog)
    assert person.window.isVisible()
    person.click(dialog, "overwrite_overwrite")
    assert not person.window.isVisible()
    assert len(load_annotation(changed_meanwhile)[0].positions_um) == 2


def test_next_volume_saves_first(qtbot, person, session, two_volumes):
    session.place(A_UM)
    path = session.annotation_path
    person.press(Qt.Key.Key_PageDown, CONTROL)
    qtbot.waitUntil(lambda: session.current_index == 1 and session.volume is not None)
    assert load_annotation(path)[0].positions_um == {"k0": A_UM}
    assert session.document.positions_um == {}
    person.press(Qt.Key.Key_PageUp, CONTROL)
    qtbot.waitUntil(lambda: session.current_index == 0 and session.volume is not None)
    assert session.document.positions_um == {"k0": A_UM}


def test_next_volume_can_be_gone_to_although_saving_fails(
    qtbot, person, session, two_volumes, full_disk, options
):
    session.place(A_UM)
    for choice in ("unsaved_cancel", "unsaved_leave"):
        person.press(Qt.Key.Key_PageDown, CONTROL)
        person.click(person.dialog(UnsavedDialog), choice)
        qtbot.waitUntil(lambda: not person.has_dialog())
    qtbot.waitUntil(lambda: session.current_index == 1 and session.volume is not None)
    (recovery,) = find_recoveries(options.recovery_folder)
    assert recovery.document.positions_um == {"k0": A_UM}


def test_unexpected_error_is_shown_with_the_log(person):
    person.window.questions.show_error(RuntimeError("volume on fire"))
    dialog = person.dialog(ErrorDialog)
    assert "volume on fire" in dialog.findChild(QLabel, "error_problem").text()
    person.click(dialog, "error_close")
    assert not person.has_dialog()
