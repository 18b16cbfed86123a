"""Locks from one volume to the next: taken and given up in threads, and none is left behind."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.documents import locks
from annotations.documents.locks import DocumentLock, holder_of
from annotations.volumes import write_sidecar
from annotator.session import Session
from annotator.session.files import lock_keeper
from annotator.session.files.lock_keeper import LockKeeper

HERE_UM = (100.0, 110.0, 120.0)


@pytest.fixture
def volumes(tmp_path: Path) -> Path:
    folder = tmp_path / "volumes"
    folder.mkdir()
    for number in (1, 2, 3):
        path = folder / f"v{number}.npy"
        np.save(path, np.zeros((20, 20, 20), np.uint8))
        write_sidecar(path, (10.0, 10.0, 10.0), 2)
    return folder


@pytest.fixture
def walked(qtbot: QtBot, empty_session: Session, volumes: Path) -> Session:
    """A session with the first of three volumes open."""
    go(qtbot, empty_session, lambda: empty_session.open_path(volumes))
    return empty_session


@pytest.fixture
def keeper(qtbot: QtBot) -> Any:
    made = LockKeeper()
    yield made
    made.close()


def go(qtbot: QtBot, session: Session, step: Callable[[], object]) -> Path:
    """Take a step to another volume, and return where its annotation is kept."""
    before = session.volume
    step()
    qtbot.waitUntil(lambda: session.volume not in (None, before) and not session.jobs.running)
    assert session.annotation_path is not None
    return session.annotation_path


def noted_threads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the threads in which lock files are written or deleted, from now on."""
    threads: list[str] = []
    writing_beside = locks.writing_beside

    def note(*arguments: Any, **named: Any) -> Any:
        threads.append(threading.current_thread().name)
        return writing_beside(*arguments, **named)

    monkeypatch.setattr(locks, "writing_beside", note)
    return threads


def test_from_volume_to_volume_the_window_waits_for_no_lock(
    qtbot: QtBot, walked: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads = noted_threads(monkeypatch)
    first = walked.annotation_path
    assert first is not None
    second = go(qtbot, walked, walked.next_volume)

    assert walked.read_only_reason == ""
    assert holder_of(second) is not None
    qtbot.waitUntil(lambda: holder_of(first) is None)
    assert len(threads) == 2
    assert threading.main_thread().name not in threads
    walked.place(HERE_UM)
    assert walked.save()


def test_whoever_goes_back_at_once_can_change_the_document(qtbot: QtBot, walked: Session) -> None:
    first = walked.annotation_path
    assert first is not None
    for _ in range(3):
        second = go(qtbot, walked, walked.next_volume)
        assert walked.read_only_reason == ""
        assert go(qtbot, walked, walked.previous_volume) == first
        assert walked.read_only_reason == ""
    qtbot.waitUntil(lambda: holder_of(second) is None)
    qtbot.wait(2 * lock_keeper._KEPT_MS)
    holder = holder_of(first)
    assert holder is not None
    assert holder.is_own
    walked.place(HERE_UM)
    assert walked.save()


def test_the_lock_of_a_volume_that_was_passed_over_is_given_up(qtbot: QtBot, walked: Session) -> None:
    walked.next_volume()
    third = go(qtbot, walked, lambda: walked.open_item(2))
    assert third.name.startswith("v3")
    paths = [item.annotation_path for item in walked.items]
    qtbot.waitUntil(lambda: [holder_of(path) is not None for path in paths] == [False, False, True])


def test_what_nobody_holds_is_given_up_by_itself(qtbot: QtBot, keeper: LockKeeper, tmp_path: Path) -> None:
    path = tmp_path / "v.keypoints.json"
    worker = threading.Thread(target=lambda: keeper.claim(path, "anna"))
    worker.start()
    worker.join()
    assert holder_of(path) is not None
    assert not keeper.is_holding
    qtbot.waitUntil(lambda: holder_of(path) is None)


def test_a_refusal_is_told_by_whoever_holds(
    qtbot: QtBot, keeper: LockKeeper, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "v.keypoints.json"
    theirs = DocumentLock.acquire(path, "ben")
    monkeypatch.setattr(locks, "_HELD", set())
    monkeypatch.setattr(locks, "_is_holding", lambda _content: True)
    keeper.claim(path, "anna")
    with pytest.raises(locks.DocumentLocked, match="ben"):
        keeper.hold(path, "anna")
    assert not keeper.is_holding
    theirs.release()
    keeper.hold(path, "anna")
    assert keeper.is_holding


def test_folders_that_were_made_for_looking_alone_are_gone_in_the_end(
    qtbot: QtBot, keeper: LockKeeper, tmp_path: Path
) -> None:
    folder = tmp_path / "annotations" / "anna"
    paths = [folder / f"v{number}.keypoints.json" for number in range(3)]
    keeper.hold(paths[0], "anna")
    for path in paths[1:]:
        keeper.claim(path, "anna")
        keeper.hold(path, "anna")
        qtbot.waitUntil(lambda: not keeper._spare_timer.isActive())
    other = tmp_path / "annotations" / "ben" / "v1.keypoints.json"
    keeper.claim(other, "anna")
    keeper.hold(other, "anna")
    qtbot.waitUntil(lambda: not folder.exists())
    keeper.release()
    assert not (tmp_path / "annotations").exists()


def test_of_two_who_asked_at_once_the_lock_is_kept_and_no_other_is_left(
    qtbot: QtBot, keeper: LockKeeper, tmp_path: Path
) -> None:
    path = tmp_path / "v.keypoints.json"
    keeper.claim(path, "anna")
    holder = holder_of(path)
    assert holder is not None
    keeper._spare.put(path, "anna", locks.DocumentLocked(path, holder))
    keeper.hold(path, "anna")
    assert keeper.is_holding
    keeper.release()
    assert holder_of(path) is None


def test_what_was_claimed_under_another_name_stands_in_nobodys_way(
    qtbot: QtBot, keeper: LockKeeper, tmp_path: Path
) -> None:
    path = tmp_path / "v.keypoints.json"
    keeper.claim(path, "anna")
    keeper.hold(path, "ben")
    assert keeper.is_holding
    holder = holder_of(path)
    assert holder is not None
    assert holder.person == "ben"


def test_closing_gives_all_up_at_once(qtbot: QtBot, tmp_path: Path) -> None:
    keeper = LockKeeper()
    before, present, to_come = (tmp_path / f"{name}.keypoints.json" for name in "abc")
    keeper.hold(before, "anna")
    keeper.hold(present, "anna")
    keeper.claim(to_come, "anna")
    keeper.close()
    assert [holder_of(path) for path in (before, present, to_come)] == [None, None, None]
    keeper.claim(to_come, "anna")
    assert holder_of(to_come) is None
