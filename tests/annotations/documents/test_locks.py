"""Locks among real processes, and what their files say where a process is gone, or a computer silent."""

import hashlib
import json
import logging
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil
import pytest

from annotations.documents.annotation import Annotation
from annotations.documents.files import save_annotation
from annotations.documents.locks import (
    STALE_S,
    TAKEOVER_LOG,
    DocumentLock,
    DocumentLocked,
    holder_of,
    lock_path,
)
from annotations.documents.write_guard import GUARD_NAME
from annotations.durable_files import SaveError

SCRIPT = Path(__file__).with_name("sharing_process.py")
ROUNDS = 100
Process = subprocess.Popen[str]
Start = Callable[..., Process]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "annotations" / "anna" / "v001.keypoints.json"


@pytest.fixture
def start() -> Iterator[Start]:
    """Start another program that shares a folder; it is killed in the end."""
    with ExitStack() as processes:

        def start_one(*words: object) -> Process:
            process = subprocess.Popen(
                [sys.executable, str(SCRIPT), *map(str, words)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                bufsize=1,
            )
            processes.enter_context(process)
            processes.callback(process.kill)
            return process

        yield start_one


def hear(process: Process) -> dict[str, Any]:
    assert process.stdout is not None
    line: dict[str, Any] = json.loads(process.stdout.readline())
    return line


def tell(process: Process) -> None:
    assert process.stdin is not None
    process.stdin.write("go on\n")
    process.stdin.flush()


def write_lock(path: Path, *, age_s: float = 0.0, **fields: object) -> None:
    """Put a lock file of another computer beside a document, written some time ago."""
    said = {
        "schema": "oct-lock/1",
        "person": "bob",
        "host": "another-computer",
        "process_id": 4711,
        "process_started": 1.0,
        "token": "bob's",
        "since": "2026-11-22T05:00:00Z",
        "renewed": "2026-11-22T05:10:00Z",
    }
    lock_path(path).parent.mkdir(parents=True, exist_ok=True)
    lock_path(path).write_text(json.dumps(said | fields), encoding="utf-8")
    set_age(path, age_s)


def set_age(path: Path, age_s: float) -> None:
    written = time.time() - age_s
    os.utime(lock_path(path), (written, written))


def test_a_lock_says_in_plain_text_who_has_the_document_open(path: Path) -> None:
    lock = DocumentLock.acquire(path, "anna")
    said = json.loads(lock_path(path).read_text(encoding="utf-8"))
    assert lock_path(path).name == "v001.keypoints.json.lock"
    assert (said["schema"], said["person"], said["host"]) == ("oct-lock/1", "anna", platform.node())
    assert said["process_id"] == os.getpid()
    assert said["since"].endswith("Z")
    assert lock_path(path).read_text(encoding="utf-8").count("\n") > 8
    lock.release()
    assert holder_of(path) is None


def test_a_lock_and_its_end_leave_nothing_behind_where_nothing_was_saved(path: Path, tmp_path: Path) -> None:
    DocumentLock.acquire(path, "anna").release()
    assert not (tmp_path / "annotations").exists()


def test_folders_that_were_there_or_are_in_use_stay(path: Path, tmp_path: Path, document: Annotation) -> None:
    first, second = DocumentLock.acquire(path, "anna"), DocumentLock.acquire(path.with_name("b.json"), "anna")
    first.release()
    assert second.is_held()
    save_annotation(document, path, expected="")
    second.release()
    DocumentLock.acquire(path, "anna").release()
    assert sorted(each.name for each in path.parent.iterdir()) == [GUARD_NAME, path.name]


def test_a_second_window_of_the_same_program_is_refused(path: Path) -> None:
    DocumentLock.acquire(path, "anna")
    with pytest.raises(DocumentLocked, match="anna in another window on this computer, since 20"):
        DocumentLock.acquire(path, "anna")


def test_a_link_to_a_document_is_locked_with_it(path: Path, tmp_path: Path) -> None:
    DocumentLock.acquire(path, "anna")
    link = tmp_path / "link.json"
    link.symlink_to(path)
    with pytest.raises(DocumentLocked):
        DocumentLock.acquire(link, "anna")


def test_another_living_process_keeps_its_lock_whatever_its_age(path: Path, start: Start) -> None:
    other = start("hold", path)
    hear(other)
    set_age(path, 10 * STALE_S)
    with pytest.raises(DocumentLocked) as refused:
        DocumentLock.acquire(path, "anna")
    holder = refused.value.holder
    assert (holder.person, holder.is_here, holder.is_gone, holder.is_stale) == ("bob", True, False, False)
    with pytest.raises(DocumentLocked):
        DocumentLock.take_over(path, "anna", holder)
    tell(other)
    other.wait()
    DocumentLock.acquire(path, "anna")


def test_the_lock_of_a_killed_process_is_taken_over_at_once(path: Path, start: Start) -> None:
    other = start("hold", path)
    hear(other)
    other.kill()
    # Not waited for: until then its number is still in use.
    while psutil.Process(other.pid).status() != psutil.STATUS_ZOMBIE:
        time.sleep(0.001)
    assert DocumentLock.acquire(path, "anna").is_held()
    assert not lock_path(path).with_name(TAKEOVER_LOG).exists()


def test_a_process_that_got_the_number_of_a_dead_one_is_not_taken_for_it(path: Path) -> None:
    DocumentLock.acquire(path, "anna")
    said = json.loads(lock_path(path).read_text(encoding="utf-8"))
    write_lock(path, **said | {"process_started": said["process_started"] - 3600})
    assert DocumentLock.acquire(path, "anna").is_held()


@pytest.mark.parametrize("number", [-1, 0, 10**30])
def test_a_number_that_no_process_has_is_that_of_a_dead_one(path: Path, number: int) -> None:
    write_lock(path, host=platform.node(), process_id=number)
    assert DocumentLock.acquire(path, "anna").is_held()


@pytest.mark.timeout(60)
def test_of_programs_that_want_the_lock_at_once_exactly_one_gets_it(path: Path, start: Start) -> None:
    others = [start("race", path) for _ in range(4)]
    for other in others:
        hear(other)
    for other in others:
        tell(other)
    assert sorted(hear(other)["won"] for other in others) == [False, False, False, True]


def test_another_computers_lock_is_refused_while_it_is_renewed(path: Path) -> None:
    write_lock(path, age_s=STALE_S - 30)
    with pytest.raises(DocumentLocked, match="bob on another-computer") as refused:
        DocumentLock.acquire(path, "anna")
    assert not refused.value.holder.is_stale
    with pytest.raises(DocumentLocked):
        DocumentLock.take_over(path, "anna", refused.value.holder)
    assert not lock_path(path).with_name(TAKEOVER_LOG).exists()


def test_another_computers_silent_lock_is_taken_over_when_asked_for_and_logged(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write_lock(path, age_s=STALE_S + 5)
    with pytest.raises(DocumentLocked) as refused:
        DocumentLock.acquire(path, "anna")
    holder = refused.value.holder
    assert holder.is_stale
    with caplog.at_level(logging.WARNING):
        assert DocumentLock.take_over(path, "anna", holder).is_held()
    write_lock(path.with_name("v002.keypoints.json"), age_s=STALE_S + 5)
    DocumentLock.take_over(path.with_name("v002.keypoints.json"), "anna\nor so", holder)
    first, second = lock_path(path).with_name(TAKEOVER_LOG).read_text(encoding="utf-8").splitlines()
    for part in (
        "Z v001.keypoints.json: ",
        f"by anna on {platform.node()} from bob on another-computer",
        "last renewed 2026-11-22T05:10:00Z",
    ):
        assert part in first
        assert part in caplog.text
    assert "by anna or so on" in second


def test_a_lock_that_was_renewed_since_it_was_offered_is_not_taken_over(path: Path) -> None:
    write_lock(path, age_s=STALE_S + 5)
    holder = holder_of(path)
    assert holder is not None
    set_age(path, 0)
    with pytest.raises(DocumentLocked):
        DocumentLock.take_over(path, "anna", holder)


def test_a_lock_that_somebody_else_took_over_first_is_not_taken_from_them(path: Path) -> None:
    write_lock(path, age_s=STALE_S + 5)
    holder = holder_of(path)
    assert holder is not None
    write_lock(path, age_s=STALE_S + 5, person="carl", token="carl's")
    with pytest.raises(DocumentLocked, match="carl"):
        DocumentLock.take_over(path, "anna", holder)


def test_a_takeover_that_cannot_be_written_down_does_not_happen(path: Path) -> None:
    write_lock(path, age_s=STALE_S + 5)
    lock_path(path).with_name(TAKEOVER_LOG).mkdir()
    holder = holder_of(path)
    assert holder is not None
    with pytest.raises(SaveError, match="could not be written down"):
        DocumentLock.take_over(path, "anna", holder)
    present = holder_of(path)
    assert present is not None
    assert present.person == "bob"


def test_a_renewed_lock_is_young_again(path: Path) -> None:
    lock = DocumentLock.acquire(path, "anna")
    set_age(path, 1000)
    assert lock.renew()
    holder = holder_of(path)
    assert holder is not None
    assert holder.age_s < 500


def test_a_lock_that_was_taken_over_is_not_renewed_nor_given_up(path: Path) -> None:
    lock = DocumentLock.acquire(path, "anna")
    write_lock(path)
    theirs = lock_path(path).read_bytes()
    assert not lock.renew()
    lock.release()
    assert lock_path(path).read_bytes() == theirs
    lock_path(path).unlink()
    assert not lock.renew()
    assert not lock_path(path).exists()


@pytest.mark.parametrize("skew_s", [-7200, 7200])
def test_ages_do_not_depend_on_this_computers_clock(
    path: Path, skew_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_lock(path, age_s=STALE_S - 30)
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + skew_s)
    holder = holder_of(path)
    assert holder is not None
    assert 0 < holder.age_s < STALE_S


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe", b"[]", b'{"schema": "oct-lock/2"}', b'{"schema": "oct-lock/1", "person": 3}'],
)
def test_a_lock_file_that_cannot_be_read_counts_as_anothers_until_it_is_stale(
    path: Path, content: bytes
) -> None:
    path.parent.mkdir(parents=True)
    lock_path(path).write_bytes(content)
    with pytest.raises(DocumentLocked, match="its lock file cannot be read"):
        DocumentLock.acquire(path, "anna")
    set_age(path, STALE_S + 5)
    holder = holder_of(path)
    assert holder is not None
    assert DocumentLock.take_over(path, "anna", holder).is_held()
    assert "did not name" in lock_path(path).with_name(TAKEOVER_LOG).read_text(encoding="utf-8")


def test_a_folder_that_cannot_be_written_says_so_or_who_is_there(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The owner of all files may write anywhere, so permissions alone would not show it to every tester.
    path.parent.mkdir(parents=True)
    make_read_only(monkeypatch)
    with pytest.raises(SaveError, match="could not be written"):
        DocumentLock.acquire(path, "anna")
    monkeypatch.undo()
    write_lock(path)
    make_read_only(monkeypatch)
    with pytest.raises(DocumentLocked):
        DocumentLock.acquire(path, "anna")


def make_read_only(monkeypatch: pytest.MonkeyPatch) -> None:
    opened = Path.open

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    def read_only(path: Path, mode: str = "r", *rest: Any, **more: Any) -> Any:
        return opened(path, mode, *rest, **more) if mode.startswith("r") else refuse()

    monkeypatch.setattr("filelock.FileLock.acquire", refuse)
    monkeypatch.setattr(Path, "open", read_only)


def test_a_share_without_locks_is_written_all_the_same(
    path: Path, document: Annotation, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(37, "No locks available")

    monkeypatch.setattr("filelock.FileLock.acquire", refuse)
    lock = DocumentLock.acquire(path, "anna")
    save_annotation(document, path, expected="")
    assert lock.renew()
    lock.release()
    assert path.exists()
    assert holder_of(path) is None


@pytest.mark.timeout(120)
def test_two_programs_that_save_at_random_lose_nothing(
    tmp_path: Path, document: Annotation, start: Start
) -> None:
    first = {
        name: save_annotation(document, tmp_path / name, expected="")[1]
        for name in ("shared-1.json", "shared-2.json", "own-1.json", "own-2.json")
    }
    programs = [start("save", tmp_path, seed, ROUNDS) for seed in (1, 2)]
    for program in programs:
        hear(program)
    for program in programs:
        tell(program)
    saves: list[dict[str, str]] = []
    told = 0
    for program in programs:
        for _ in range(ROUNDS):
            said = hear(program)
            told += "told" in said
            if "left" in said:
                saves.append(said)
        assert program.wait() == 0
    # A version is safe that is in the file, that somebody had before their eyes when they replaced it, or
    # that is kept beside it.
    kept = {hashlib.sha256(each.read_bytes()).hexdigest() for each in tmp_path.iterdir() if each.is_file()}
    knowingly = {(save["file"], save["replaced"]) for save in saves}
    for name, identity in [*first.items(), *((save["file"], save["left"]) for save in saves)]:
        assert identity in kept or (name, identity) in knowingly
    # There was something to lose: both wrote to the same files, and sometimes at odds.
    assert told > 0
    assert len(saves) > ROUNDS
    assert not any(each.name.endswith(".partial") for each in tmp_path.iterdir())
