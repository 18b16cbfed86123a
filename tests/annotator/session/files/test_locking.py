"""Two windows, and two computers, on one document: one changes it, the other one says whose it is."""

import errno
import json
import os
import platform
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.documents.edits import place_keypoint
from annotations.documents.files import annotation_bytes, load_annotation
from annotations.documents.locks import (
    STALE_S,
    TAKEOVER_LOG,
    DocumentLock,
    LockHolder,
    holder_of,
    lock_path,
)
from annotations.documents.record import changed
from annotations.documents.recovery import find_recoveries
from annotations.documents.study import Study, StudyVolume, ViewingRules, annotation_path, save_study
from annotator.session import Session
from annotator.session.files import locking
from annotator.session.options import SessionOptions
from tests.annotator.conftest import write_volume

HERE_UM = (100.0, 110.0, 120.0)
THERE_UM = (200.0, 210.0, 220.0)
Window = Callable[..., Session]


def open_and_wait(qtbot: QtBot, session: Session, path: Path) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(path)
    qtbot.waitUntil(lambda: not session.jobs.running)


@pytest.fixture
def window(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> Iterator[Window]:
    """Open the small volume, or another path, in one more window of the same program."""
    opened: list[Session] = []

    def open_window(path: Path | None = None, annotator: str = "anna") -> Session:
        session = Session(replace(options, annotator_name=annotator))
        opened.append(session)
        open_and_wait(qtbot, session, path or volume_path)
        return session

    yield open_window
    for session in opened:
        session.shut_down()


def path_of(session: Session) -> Path:
    assert session.annotation_path is not None
    return session.annotation_path


def positions_of(session: Session) -> dict[str, tuple[float, ...]]:
    assert session.document is not None
    return dict(session.document.positions_um)


def lock_elsewhere(path: Path, *, age_s: float, token: str = "theirs") -> None:
    """Leave the lock file of another computer beside a document, last renewed some time ago."""
    said = {
        "schema": "oct-lock/1",
        "person": "bob",
        "host": "lab-3",
        "process_id": 1,
        "process_started": 1.0,
        "token": token,
        "since": "2026-11-22T05:00:00Z",
        "renewed": "2026-11-22T05:10:00Z",
    }
    lock_path(path).parent.mkdir(parents=True, exist_ok=True)
    lock_path(path).write_text(json.dumps(said), encoding="utf-8")
    written = time.time() - age_s
    os.utime(lock_path(path), (written, written))


class TestSecondWindow:
    def test_it_is_read_only_and_says_whose_the_document_is(self, session, window):
        second = window()
        assert session.read_only_reason == ""
        assert "anna in another window on this computer, since 20" in second.read_only_reason

    def test_every_edit_is_refused_with_the_reason_and_nothing_is_written(
        self, qtbot, session, window, options
    ):
        second = window()
        journals = set(options.recovery_folder.glob("*.journal"))
        before = second.document
        for edit in (
            lambda: second.place(HERE_UM),
            lambda: second.type_position("k0", HERE_UM),
            lambda: second.set_status("done"),
            lambda: second.set_locked("k0", True),
            second.undo,
            second.redo,
            second.deriving.derive,
            lambda: second.begin_preview("k0", HERE_UM, "dragged"),
        ):
            with qtbot.waitSignal(second.message_posted) as posted:
                edit()
            assert "in another window" in posted.args[0]
        assert second.document is before
        assert second.view.preview is None
        assert not second.unsaved
        assert not path_of(second).exists()
        # The first window's, which holds no edit.
        assert set(options.recovery_folder.glob("*.journal")) == journals
        assert len(journals) == 1

    def test_it_looks_around_like_any_other(self, session, window):
        second = window()
        second.look(crosshair_um=HERE_UM)
        second.activate("k3")
        assert second.view.crosshair_um == HERE_UM
        assert second.view.active_part == "k3"

    def test_saving_is_refused_except_under_another_name(self, qtbot, session, window, tmp_path):
        session.place(HERE_UM)
        session.save()
        second = window()
        with qtbot.waitSignal(second.error_raised) as raised:
            assert not second.save(overwrite=True)
        assert "another window" in str(raised.args[0])
        assert second.save_as(tmp_path / "mine.json")
        assert second.read_only_reason == ""
        second.place(THERE_UM)
        assert second.save()
        assert len(load_annotation(tmp_path / "mine.json")[0].positions_um) == 2
        assert len(load_annotation(path_of(session))[0].positions_um) == 1
        assert holder_of(tmp_path / "mine.json") is not None

    def test_the_document_can_be_changed_once_it_is_closed_elsewhere_and_opened_again(
        self, qtbot, session, window
    ):
        second = window()
        session.place(HERE_UM)
        assert session.close_volume()
        assert second.read_only_reason
        with qtbot.waitSignal(second.volume_changed):
            second.reload()
        assert second.read_only_reason == ""
        assert list(positions_of(second).values()) == [HERE_UM]
        second.place(THERE_UM)
        assert second.save()

    def test_closing_it_leaves_the_first_ones_lock(self, session, window):
        path = path_of(session)
        window().close_volume()
        holder = holder_of(path)
        assert holder is not None
        assert session.close_volume()
        assert holder_of(path) is None

    def test_edits_to_be_recovered_wait_until_the_document_can_be_changed(
        self, qtbot, session, window, options
    ):
        session.place(HERE_UM)
        session.abandon()
        (recovery,) = find_recoveries(options.recovery_folder)
        first, second = window(), window()
        with qtbot.waitSignal(second.volume_changed):
            second.recover(recovery)
        assert not positions_of(second)
        assert recovery.journal_path.exists()
        first.close_volume()
        with qtbot.waitSignal(second.volume_changed):
            second.recover(recovery)
        assert list(positions_of(second).values()) == [HERE_UM]

    def test_what_was_saved_while_the_volume_was_read_is_read_again(
        self, qtbot, session, window, monkeypatch
    ):
        session.place(HERE_UM)
        session.save()
        path = path_of(session)
        session.close_volume()
        second = Session(session._options)
        hold = second._locks.hold

        def hold_after_somebody_saved(to_hold: Path, person: str) -> None:
            monkeypatch.undo()
            document, _ = load_annotation(path)
            path.write_bytes(annotation_bytes(place_keypoint(document, "k0", THERE_UM, "typed")))
            hold(to_hold, person)

        monkeypatch.setattr(second._locks, "hold", hold_after_somebody_saved)
        second.open_path(session._worklist.path)
        qtbot.waitUntil(lambda: second.document is not None and not second.read_only_reason)
        assert positions_of(second)["k0"] == THERE_UM
        second.shut_down()

    def test_saving_as_what_another_window_has_open_is_refused(self, qtbot, session, window, tmp_path):
        session.place(HERE_UM)
        other = window(annotator="bob")
        with qtbot.waitSignal(other.error_raised) as raised:
            assert not other.save_as(path_of(session))
        assert "open elsewhere" in str(raised.args[0])
        assert not path_of(session).exists()
        own = holder_of(path_of(other))
        assert own is not None
        assert own.person == "bob"


class TestUnwritableFolder:
    @pytest.fixture
    def unwritable(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Let nothing be written, as where a folder is somebody else's."""

        def refuse(self: Path, *_args: object, **_kwargs: object) -> None:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))

        real_open = Path.open

        def open_to_read(self: Path, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            return refuse(self) if "x" in mode else real_open(self, mode, *args, **kwargs)

        monkeypatch.setattr(Path, "open", open_to_read)

    def test_it_is_said_on_opening_and_nothing_can_be_placed(self, window, unwritable):
        session = window()
        assert session.read_only_reason == "This folder cannot be written"
        session.place(HERE_UM)
        assert not positions_of(session)
        assert not session.unsaved

    def test_once_it_can_be_written_a_second_try_goes_on(self, qtbot, window, unwritable, monkeypatch):
        session = window()
        assert session.may_try_again
        monkeypatch.undo()
        with qtbot.waitSignal(session.volume_changed):
            session.try_again()
        assert not session.read_only_reason


class TestWaiting:
    def test_what_is_closed_elsewhere_can_be_changed_without_a_wish(
        self, qtbot, session, window, monkeypatch
    ):
        session.place(HERE_UM)
        monkeypatch.setattr(locking, "_LOOK_AGAIN_S", 0.05)
        second = window()
        assert second.read_only_reason
        told: list[str] = []
        second.message_posted.connect(told.append)
        assert session.close_volume()
        qtbot.waitUntil(lambda: not second.read_only_reason)
        qtbot.waitUntil(lambda: bool(told))
        assert told == ["It is free now: you can go on"]
        assert list(positions_of(second).values()) == [HERE_UM]

    def test_another_volume_that_is_being_opened_is_opened_though_this_one_becomes_free(
        self, qtbot, session, window, volume_path
    ):
        session.place(HERE_UM)
        other = write_volume(volume_path.with_name("v002.npy"))
        second = window(volume_path.parent)
        assert second.read_only_reason
        assert session.close_volume()
        with qtbot.waitSignal(second.volume_changed):
            second.open_item(1)
            second._on_locks_found_free()
        assert second.volume.path == other

    def test_unsaved_edits_of_what_was_taken_over_are_still_there_when_it_is_free(self, qtbot, session):
        session.place(HERE_UM)
        session.save()
        session.place(THERE_UM)
        lock_elsewhere(path_of(session), age_s=0)
        session._locks.check()
        assert session.read_only_reason
        session.try_again()
        assert session.read_only_reason
        lock_path(path_of(session)).unlink()
        session.try_again()
        assert not session.read_only_reason
        assert len(positions_of(session)) == 2
        assert session.save()


class TestAnotherComputer:
    def test_a_lock_that_is_renewed_is_not_offered(self, qtbot, session, window):
        path = path_of(session)
        session.close_volume()
        lock_elsewhere(path, age_s=STALE_S - 30)
        with qtbot.assertNotEmitted(session.takeover_requested):
            open_and_wait(qtbot, session, session._worklist.path)
        assert "bob on lab-3" in session.read_only_reason

    def test_a_silent_one_is_offered_and_taken_over_when_asked_for(self, qtbot, session):
        session.place(HERE_UM)
        session.save()
        path = path_of(session)
        session.close_volume()
        lock_elsewhere(path, age_s=STALE_S + 5)
        offered: list[LockHolder] = []
        session.takeover_requested.connect(offered.append)
        open_and_wait(qtbot, session, session._worklist.path)
        assert [holder.person for holder in offered] == ["bob"]
        session.place(THERE_UM)
        assert len(positions_of(session)) == 1
        with qtbot.waitSignal(session.volume_changed):
            session.take_over(offered[0])
        assert session.read_only_reason == ""
        assert "by anna" in path.with_name(TAKEOVER_LOG).read_text(encoding="utf-8")
        session.place(THERE_UM)
        assert session.save()

    def test_an_answer_that_comes_too_late_takes_nothing_over(self, qtbot, session):
        path = path_of(session)
        session.close_volume()
        lock_elsewhere(path, age_s=STALE_S + 5)
        offered: list[LockHolder] = []
        session.takeover_requested.connect(offered.append)
        open_and_wait(qtbot, session, session._worklist.path)
        # Meanwhile they are back.
        lock_elsewhere(path, age_s=0)
        with qtbot.waitSignal(session.error_raised):
            session.take_over(offered[0])
        assert session.read_only_reason
        session.close_volume()
        session.take_over(offered[0])
        assert "theirs" in lock_path(path).read_text(encoding="utf-8")

    def test_who_was_taken_over_is_told_once_and_keeps_the_unsaved_edits(
        self, qtbot, session, options, tmp_path
    ):
        session.place(HERE_UM)
        session.save()
        session.place(THERE_UM)
        path = path_of(session)
        lock_elsewhere(path, age_s=0)
        errors: list[Exception] = []
        session.error_raised.connect(errors.append)
        session._locks.renew()
        qtbot.waitUntil(lambda: bool(session.read_only_reason))
        session._locks.renew()
        assert len(errors) == 1
        assert "taken over meanwhile by bob on lab-3" in str(errors[0])
        assert "recovery file" in str(errors[0])
        session.place((1.0, 2.0, 3.0))
        session.undo()
        assert len(positions_of(session)) == 2
        assert not session.save()
        assert len(load_annotation(path)[0].positions_um) == 1
        session.abandon()
        (recovery,) = find_recoveries(options.recovery_folder)
        assert len(recovery.document.positions_um) == 2
        assert "theirs" in lock_path(path).read_text(encoding="utf-8")

    def test_a_takeover_is_noticed_before_the_next_save(self, qtbot, session, tmp_path):
        session.place(HERE_UM)
        lock_elsewhere(path_of(session), age_s=0)
        assert not session.save()
        assert not path_of(session).exists()
        assert session.save_as(tmp_path / "mine.json")
        assert session.read_only_reason == ""
        assert not session.unsaved

    def test_autosave_leaves_a_document_alone_that_was_taken_over(self, qtbot, session):
        session.place(HERE_UM)
        lock_elsewhere(path_of(session), age_s=0)
        session._locks.check()
        with qtbot.assertNotEmitted(session.error_raised):
            session._autosave.save_requested.emit()
        assert not path_of(session).exists()

    def test_a_lock_file_that_was_deleted_by_hand_is_written_again(self, qtbot, session):
        lock_path(path_of(session)).unlink()
        session._locks.renew()
        qtbot.waitUntil(lambda: holder_of(path_of(session)) is not None)
        assert session.read_only_reason == ""
        session.place(HERE_UM)
        assert session.save()


def test_the_lock_is_renewed_as_long_as_the_document_is_open(qtbot, session):
    path = path_of(session)
    written = time.time() - 1000
    os.utime(lock_path(path), (written, written))
    session._locks._timer.setInterval(1)
    qtbot.waitUntil(lambda: lock_path(path).stat().st_mtime > written + 500)
    session.close_volume()
    assert not session._locks._timer.isActive()
    assert holder_of(path) is None


def test_a_document_that_a_dead_process_had_open_can_be_changed_at_once(qtbot, session, options):
    session.place(HERE_UM)
    path = path_of(session)
    session.abandon()
    lock_elsewhere(path, age_s=0)
    said = json.loads(lock_path(path).read_text(encoding="utf-8"))
    lock_path(path).write_text(json.dumps(said | {"host": platform.node(), "process_id": 2**30}))
    open_and_wait(qtbot, session, session._worklist.path)
    assert session.read_only_reason == ""
    with qtbot.waitSignal(session.recovery_requested):
        session.offer_recoveries()


@pytest.fixture
def study_folder(tmp_path: Path, volume_path: Path) -> Path:
    volume = StudyVolume(id="v1", path=f"../volumes/{volume_path.name}", spacing_um=(15.9, 13.5, 9.4))
    study = Study(
        title="Pilot",
        tool="magnetic-forceps",
        annotators=("anna", "bob"),
        volumes=(volume,),
        viewing=ViewingRules(reviewers=("lead",)),
    )
    folder = tmp_path / "study"
    folder.mkdir()
    save_study(study, folder)
    return folder


@pytest.fixture
def annas_document(qtbot: QtBot, window: Window, study_folder: Path) -> Annotation:
    """What anna has saved in the study."""
    session = window(study_folder)
    session.place(HERE_UM)
    assert session.save()
    document = session.document
    assert document is not None
    session.close_volume()
    return document


def keep(document: Annotation, study_folder: Path, annotator: str) -> Path:
    path = annotation_path(study_folder, annotator, "v1", "keypoints")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(annotation_bytes(changed(document, annotator=annotator)))
    return path


class TestStudy:
    def test_another_annotators_document_is_read_only(self, window, study_folder, annas_document):
        session = window(keep(annas_document, study_folder, "anna"), annotator="lead")
        assert "annotation of anna" in session.read_only_reason
        # It is nobody's lock: anna can have it open at the same time.
        assert holder_of(path_of(session)) is None
        assert window(study_folder).read_only_reason == ""

    def test_the_lock_of_what_was_open_goes_without_the_window_waiting_for_it(
        self, qtbot, window, study_folder, annas_document, monkeypatch
    ):
        session = window(annotator="lead")
        left, threads, release = path_of(session), [], DocumentLock.release

        def noted(lock: DocumentLock) -> None:
            threads.append(threading.current_thread())
            release(lock)

        monkeypatch.setattr(DocumentLock, "release", noted)
        assert holder_of(left) is not None
        open_and_wait(qtbot, session, keep(annas_document, study_folder, "anna"))
        assert "annotation of anna" in session.read_only_reason
        qtbot.waitUntil(lambda: not lock_path(left).exists())
        assert threads
        assert threading.main_thread() not in threads

    def test_it_is_not_saved_into_the_study_again_under_another_name(
        self, qtbot, window, study_folder, annas_document, tmp_path
    ):
        session = window(keep(annas_document, study_folder, "anna"), annotator="lead")
        target = annotation_path(study_folder, "lead", "v1", "keypoints")
        with qtbot.waitSignal(session.error_raised):
            assert not session.save_as(target)
        assert not target.exists()
        assert session.save_as(tmp_path / "copy.json")
        assert session.read_only_reason == ""

    @pytest.mark.parametrize(("person", "may_write"), [("lead", True), ("bob", False)])
    def test_the_consensus_is_the_reviewers(self, window, study_folder, annas_document, person, may_write):
        consensus = changed(annas_document, annotator="consensus")
        session = window(study_folder, annotator=person)
        reason = session._reason_by_study(consensus, keep(consensus, study_folder, "consensus"))
        assert (reason == "") is may_write
