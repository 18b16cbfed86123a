"""Autosave: journal before the next event, disk within a second, file soon; failures are said aloud."""

import errno
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from annotations import durable_files
from annotations.documents import recovery as recovery_module
from annotations.documents.files import load_annotation
from annotator.session import Session
from annotator.session.documents import autosave
from annotator.session.documents.autosave import SYNC_MS
from annotator.session.options import SessionOptions


def journal_edits(options: SessionOptions) -> list[bytes]:
    """Return what the one journal holds of edits."""
    (journal,) = options.recovery_folder.glob("*.journal")
    return [line for line in journal.read_bytes().splitlines() if b'"document"' in line]


def test_an_edit_is_in_the_journal_when_the_call_returns(session: Session, options: SessionOptions) -> None:
    assert journal_edits(options) == []
    session.place((1.25, 2.0, 3.0))
    (edit,) = journal_edits(options)
    assert b"1.25" in edit
    session.undo_stack.undo()
    assert len(journal_edits(options)) == 2


def test_the_journal_reaches_the_disk_within_a_second(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert SYNC_MS < 1000
    synced: list[int] = []
    fsync = os.fsync
    monkeypatch.setattr(
        recovery_module.os, "fsync", lambda descriptor: (synced.append(descriptor), fsync(descriptor))
    )
    session.place((1.0, 2.0, 3.0))
    session.place((1.0, 2.0, 3.0))
    assert synced == []
    qtbot.waitUntil(lambda: len(synced) == 1)


def test_saving_and_closing_leave_nothing_to_recover(session: Session, options: SessionOptions) -> None:
    session.place((1.0, 2.0, 3.0))
    session.save()
    assert journal_edits(options) == []
    session.close_volume()
    assert list(options.recovery_folder.glob("*.journal")) == []


def test_the_file_is_written_some_time_after_the_first_edit(
    qtbot: QtBot, options: SessionOptions, volume_path: Path
) -> None:
    session = Session(replace(options, autosave_s=0.05))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    session.place((1.0, 2.0, 3.0))
    assert session.unsaved
    qtbot.waitUntil(lambda: not session.unsaved)
    assert session.annotation_path is not None
    assert load_annotation(session.annotation_path)[0].positions_um == {"k0": (1.0, 2.0, 3.0)}
    session.shut_down()


def test_a_full_disk_is_said_and_nothing_is_lost(
    qtbot: QtBot, session: Session, options: SessionOptions, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.place((1.0, 2.0, 3.0))
    assert session.save()
    assert session.annotation_path is not None
    saved = session.annotation_path.read_bytes()
    errors: list[Exception] = []
    session.error_raised.connect(errors.append)

    def fail(*_arguments: Any, **_more: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(durable_files.os, "replace", fail)
    session.place((4.0, 5.0, 6.0))
    assert not session.save()
    assert not session.save_as(options.recovery_folder / "elsewhere.json")
    assert len(errors) == 2, "a person who asked to save is answered each time"
    assert "No space left" in str(errors[0])
    assert session.unsaved
    assert session.annotation_path.read_bytes() == saved
    assert b"4.0, 5.0, 6.0" in journal_edits(options)[-1]
    monkeypatch.undo()
    assert session.save()
    assert load_annotation(session.annotation_path)[0].positions_um["k1"] == (4.0, 5.0, 6.0)


def test_the_timer_says_a_full_disk_once_and_tries_again(
    qtbot: QtBot, options: SessionOptions, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(autosave, "_RETRY_MS", 20)
    session = Session(replace(options, autosave_s=0.02))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    errors: list[Exception] = []
    messages: list[str] = []
    session.error_raised.connect(errors.append)
    session.message_posted.connect(messages.append)

    def fail(*_arguments: Any, **_more: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as full_disk:
        full_disk.setattr(durable_files.os, "replace", fail)
        session.place((1.0, 2.0, 3.0))
        qtbot.waitUntil(lambda: len(messages) >= 2)
        assert len(errors) == 1
        assert session.unsaved
    qtbot.waitUntil(lambda: not session.unsaved)
    session.shut_down()


def test_a_journal_that_cannot_be_closed_keeps_nothing_open(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_arguments: Any, **_more: Any) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "unlink", fail)
    with qtbot.waitSignal(session.error_raised):
        assert session.close_volume()
    assert session.document is None
    assert session.current_index is None


def test_a_journal_that_cannot_be_written_is_said_and_the_edit_stands(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_descriptor: int, _content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(recovery_module.os, "write", fail)
    with qtbot.waitSignal(session.error_raised) as raised:
        session.place((1.0, 2.0, 3.0))
    assert "journal" in str(raised.args[0])
    assert session.document is not None
    assert session.document.positions_um == {"k0": (1.0, 2.0, 3.0)}


def test_a_journal_that_cannot_be_begun_opens_nothing(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path, volume_path: Path
) -> None:
    (tmp_path / "occupied").write_text("a file where the folder should be")
    session = Session(replace(options, recovery_folder=tmp_path / "occupied"))
    with qtbot.waitSignal(session.error_raised) as raised:
        session.open_path(volume_path)
    assert "journal" in str(raised.args[0])
    assert session.volume is None
    assert session.document is None
    session.shut_down()


def test_time_at_work_is_stamped_and_no_edit(qtbot: QtBot, session: Session) -> None:
    moment = 0.0
    file = session._file
    assert file is not None
    file._clock = lambda: moment
    file._last_activity = 0.0
    for moment in (10.0, 30.0, 1000.0, 1005.0):
        session.look(crosshair_um=(moment / 100, 0.0, 0.0))
    assert session.active_seconds == pytest.approx(35.0, abs=1.0)
    assert not session.unsaved
    session.place((1.0, 2.0, 3.0))
    session.save()
    assert session.annotation_path is not None
    assert load_annotation(session.annotation_path)[0].active_seconds == pytest.approx(35.0, abs=1.0)
