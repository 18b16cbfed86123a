"""Recovery through the session: the right document, its own numbers, and no copy given up too early."""

import errno
import json
import os
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation
from annotations.documents.recovery import Recovery, find_recoveries
from annotations.documents.study import Study, StudyVolume, save_study
from annotations.volumes import sidecar_path, write_sidecar
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.session.volumes import opening
from annotator.session.volumes.spacing_answer import SpacingAnswer


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running)


def die_with_edits(session: Session) -> Annotation:
    """Make unsaved edits and end as a killed program would: without saving."""
    session.place((100.0, 110.0, 120.0))
    session.place((200.0, 210.0, 220.0))
    document = session.document
    assert document is not None
    session.abandon()
    return document


def only_recovery(options: SessionOptions) -> Recovery:
    (recovery,) = find_recoveries(options.recovery_folder)
    return recovery


def recover_and_wait(qtbot: QtBot, session: Session, recovery: Recovery) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.recover(recovery)
    qtbot.waitUntil(lambda: not session.jobs.running)


@pytest.fixture
def other_volume(volume_path: Path) -> Path:
    """A second volume in the folder, of the same shape and another content."""
    path = volume_path.with_name("v002.npy")
    np.save(path, 255 - np.load(volume_path))
    shutil.copy(sidecar_path(volume_path), sidecar_path(path))
    return path


def test_what_the_fit_of_recovered_edits_needs_is_imported_by_the_thread_that_reads(
    qtbot: QtBot, session: Session, options: SessionOptions, monkeypatch: pytest.MonkeyPatch
) -> None:
    die_with_edits(session)
    threads: list[threading.Thread] = []
    monkeypatch.setattr(opening, "prepare_fitting", lambda: threads.append(threading.current_thread()))
    recover_and_wait(qtbot, session, only_recovery(options))
    assert len(threads) == 1
    assert threads[0] is not threading.main_thread()


def test_another_volume_opened_meanwhile_does_not_get_the_edits(
    qtbot: QtBot, session: Session, options: SessionOptions, other_volume: Path
) -> None:
    lost = die_with_edits(session)
    session.recover(only_recovery(options))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(other_volume)
    qtbot.waitUntil(lambda: session.volume is not None and session.volume.path == other_volume)
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert session.document is not None
    assert not session.document.positions_um
    session.abandon()
    assert only_recovery(options).document.keypoints == lost.keypoints


def test_the_edits_of_a_document_that_was_never_saved_keep_their_spacing(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, tmp_path: Path
) -> None:
    path = tmp_path / "bare.npy"
    np.save(path, np.arange(6000, dtype=np.uint8).reshape(20, 30, 10))
    with qtbot.waitSignal(empty_session.spacing_requested):
        empty_session.open_path(path)
    with qtbot.waitSignal(empty_session.volume_changed):
        empty_session.provide_spacing(path, SpacingAnswer((10.0, 20.0, 30.0), 2, "once"))
    lost = die_with_edits(empty_session)
    with qtbot.assertNotEmitted(empty_session.spacing_requested):
        recover_and_wait(qtbot, empty_session, only_recovery(options))
    assert empty_session.spacing_um == (10.0, 20.0, 30.0)
    assert empty_session.document is not None
    assert empty_session.document.keypoints == lost.keypoints
    empty_session.undo_stack.undo()
    assert not empty_session.document.positions_um


def test_a_study_s_own_tool_and_item_come_back(
    qtbot: QtBot, empty_session: Session, options: SessionOptions, tmp_path: Path, volume_path: Path
) -> None:
    folder = tmp_path / "study"
    (folder / "tools").mkdir(parents=True)
    (folder / "tools" / "probe.toml").write_text(
        'schema = "oct-tool/1"\nname = "probe"\nkeypoints = [{ name = "a" }, { name = "b" }]\n'
    )
    shutil.copy(volume_path, folder / "scan.npy")
    volume = StudyVolume(id="first", path="scan.npy", spacing_um=(10.0, 10.0, 10.0))
    save_study(Study(title="Pilot", tool="probe", volumes=(volume,)), folder)
    open_and_wait(qtbot, empty_session, folder)
    lost = die_with_edits(empty_session)
    elsewhere = Session(options)
    recover_and_wait(qtbot, elsewhere, only_recovery(options))
    assert elsewhere.tool is not None
    assert elsewhere.tool.name == "probe"
    assert elsewhere.document is not None
    assert elsewhere.document.keypoints == lost.keypoints
    assert elsewhere.spacing_um == (10.0, 10.0, 10.0)
    elsewhere.shut_down()


def test_a_file_that_changed_since_the_crash_is_not_overwritten(
    qtbot: QtBot, session: Session, options: SessionOptions, volume_path: Path
) -> None:
    session.place((1.0, 2.0, 3.0))
    session.save()
    path = session.annotation_path
    assert path is not None
    lost = die_with_edits(session)
    fields = json.loads(path.read_text())
    fields["keypoints"][0]["position_um"] = [9.0, 9.0, 9.0]
    path.write_text(json.dumps(fields))
    theirs = path.read_bytes()
    recover_and_wait(qtbot, session, only_recovery(options))
    assert session.document is not None
    assert session.document.keypoints == lost.keypoints
    with qtbot.waitSignal(session.overwrite_requested):
        assert not session.save()
    assert path.read_bytes() == theirs


def test_it_is_said_that_undo_takes_all_that_came_back(
    qtbot: QtBot, session: Session, options: SessionOptions
) -> None:
    lost = die_with_edits(session)
    told: list[str] = []
    session.message_posted.connect(told.append)
    recover_and_wait(qtbot, session, only_recovery(options))
    assert told[-1] == "2 edits came back as one step: Undo takes all of it away, Redo brings it back"
    session.undo()
    session.redo()
    assert session.document is not None
    assert session.document.keypoints == lost.keypoints


def test_the_old_journal_stays_where_the_new_one_cannot_be_written(
    qtbot: QtBot, session: Session, options: SessionOptions, monkeypatch: pytest.MonkeyPatch
) -> None:
    lost = die_with_edits(session)
    recovery = only_recovery(options)

    def fail(_descriptor: int, _content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as full_disk:
        full_disk.setattr(os, "write", fail)
        with qtbot.waitSignal(session.error_raised):
            session.recover(recovery)
        qtbot.waitUntil(lambda: session.unsaved)
    assert recovery.journal_path.exists()
    session.abandon()
    assert only_recovery(options).document.keypoints == lost.keypoints


def test_another_shape_is_refused_and_the_journal_stays(
    qtbot: QtBot, session: Session, options: SessionOptions, volume_path: Path
) -> None:
    die_with_edits(session)
    np.save(volume_path, np.zeros((5, 6, 7), np.uint8))
    recovery = only_recovery(options)
    with qtbot.waitSignal(session.error_raised) as raised:
        session.recover(recovery)
    assert "shape" in str(raised.args[0])
    assert session.document is None
    assert recovery.journal_path.exists()


def test_reading_again_gives_up_the_edits_only_when_it_has_succeeded(qtbot: QtBot, session: Session) -> None:
    session.place((1.0, 2.0, 3.0))
    session.save()
    path = session.annotation_path
    assert path is not None
    theirs = path.read_bytes()
    session.place((4.0, 5.0, 6.0))
    mine = session.document
    path.write_bytes(theirs[:100])
    with qtbot.waitSignal(session.error_raised):
        session.reload()
    assert session.document == mine
    assert session.unsaved
    path.write_bytes(theirs)
    with qtbot.waitSignal(session.volume_changed):
        session.reload()
    assert session.document is not None
    assert session.document.positions_um == {"k0": (1.0, 2.0, 3.0)}
    assert not session.unsaved


def test_what_is_being_typed_is_saved_with_the_rest(qtbot: QtBot, session: Session) -> None:
    session.place((1.0, 2.0, 3.0))
    session.save()
    path = session.annotation_path
    assert path is not None
    session.begin_preview("k0", (250.5, 2.0, 3.0), "typed")
    session.close_volume()
    assert load_annotation(path)[0].positions_um == {"k0": (250.5, 2.0, 3.0)}


def test_another_person_s_name_reads_the_list_anew(
    qtbot: QtBot, session: Session, volume_path: Path, other_volume: Path
) -> None:
    session.place((1.0, 2.0, 3.0))
    anna = session.annotation_path
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.set_annotator_name("ben")
    assert anna is not None
    assert load_annotation(anna)[0].annotator == "anna"
    assert session.annotator_name == "ben"
    assert session.document is not None
    assert session.document.annotator == "ben"
    assert not session.document.positions_um
    assert {item.annotation_path.parent.name for item in session.items} == {"ben"}


def test_an_answer_to_a_superseded_question_changes_nothing(
    qtbot: QtBot, empty_session: Session, tmp_path: Path, volume_path: Path
) -> None:
    bare = tmp_path / "bare.npy"
    np.save(bare, np.zeros((4, 5, 6), np.uint8))
    with qtbot.waitSignal(empty_session.spacing_requested):
        empty_session.open_path(bare)
    open_and_wait(qtbot, empty_session, volume_path)
    empty_session.provide_spacing(bare, SpacingAnswer((777.0, 1.0, 1.0)))
    empty_session.decline_opening(bare)
    qtbot.waitUntil(lambda: not empty_session.jobs.running)
    assert not sidecar_path(bare).exists()
    assert empty_session.volume is not None
    assert empty_session.volume.path == volume_path


def test_a_closed_volume_opens_again_from_the_list(qtbot: QtBot, session: Session) -> None:
    session.close_volume()
    assert session.current_index is None
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_item(0)
    assert session.current_index == 0


def test_a_cancelled_opening_leaves_the_list_free(qtbot: QtBot, session: Session, volume_path: Path) -> None:
    session.close_volume()
    session.open_item(0)
    (job,) = session.jobs.running
    session.jobs.cancel(job)
    qtbot.waitUntil(lambda: session.current_index is None)
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_item(0)


def test_the_last_path_asked_for_is_the_one_that_opens(
    qtbot: QtBot, empty_session: Session, volume_path: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "later"
    folder.mkdir()
    shutil.copy(volume_path, folder / "later.npy")
    write_sidecar(folder / "later.npy", (1.0, 1.0, 1.0), 2)
    empty_session.open_path(volume_path)
    open_and_wait(qtbot, empty_session, folder)
    assert empty_session.volume is not None
    assert empty_session.volume.path == folder / "later.npy"


def test_a_detail_that_cannot_be_read_is_said_once(
    qtbot: QtBot, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    from annotator.session.volumes import level_loader

    def fail(*_arguments: Any) -> None:
        raise OSError("the disk is gone")

    monkeypatch.setattr(level_loader, "detail_block", fail)
    errors: list[object] = []
    monkeypatch.setattr(session, "_raise_error", errors.append)
    session.look(detail=True)
    for step in range(20):
        session.look(crosshair_um=(10.0 * step, 0.0, 0.0))
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert len(errors) == 1
    assert not session.view.detail


def test_the_depth_axis_that_a_person_gave_stays_with_the_volume(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bare.npy"
    np.save(path, np.zeros((4, 5, 6), np.uint8))
    answers: dict[str, SpacingAnswer] = {}
    session = Session(replace(options, remembered_spacing=answers.get, remember_spacing=answers.__setitem__))
    from annotations.errors import UserError
    from annotator.session.volumes import volume_opener

    def refuse(*_arguments: Any) -> None:
        raise UserError("the folder is read-only")

    monkeypatch.setattr(volume_opener, "write_sidecar", refuse)
    with qtbot.waitSignal(session.spacing_requested):
        session.open_path(path)
    with qtbot.waitSignal(session.volume_changed):
        session.provide_spacing(path, SpacingAnswer((1.0, 2.0, 3.0), 0))
    session.place((1.0, 2.0, 3.0))
    session.save()
    open_and_wait(qtbot, session, path)
    assert session.spacing_note == "from the annotation"
    assert session.volume is not None
    assert session.volume.depth_axis == 0
    session.shut_down()
