import errno
import json
import logging
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

import pytest

from annotations.documents.annotation import Annotation, changed, without_stamps
from annotations.documents.edits import place_keypoint, set_status
from annotations.documents.files import annotation_bytes, file_identity, load_annotation, save_annotation
from annotations.documents.recovery import Recovery, RecoveryJournal, discard, find_recoveries
from annotations.durable_files import SaveError

# A program with a document open: each line that it is told is one edit, answered when it is on disk.
WRITER = """
import sys
from pathlib import Path
from annotations.documents.edits import place_keypoint
from annotations.documents.files import load_annotation, file_identity
from annotations.documents.recovery import RecoveryJournal
folder, path = Path(sys.argv[1]), Path(sys.argv[2])
document, identity = load_annotation(path)
journal = RecoveryJournal(folder, path, identity)
print("open", flush=True)
for line in sys.stdin:
    document = place_keypoint(document, "k0", (float(line), 0.0, 0.0), "clicked")
    journal.record(document)
    print("recorded", flush=True)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "state" / "recovery"


@pytest.fixture
def path(tmp_path: Path, document: Annotation) -> Path:
    """The document's file, saved."""
    path = tmp_path / "v001.keypoints.json"
    save_annotation(document, path, expected="")
    return path


@pytest.fixture
def journal(folder: Path, path: Path) -> Iterator[RecoveryJournal]:
    journal = RecoveryJournal(folder, path, file_identity(path))
    yield journal
    journal.leave()


@pytest.fixture
def edited(document: Annotation) -> tuple[Annotation, ...]:
    """The document after each of three edits."""
    first = place_keypoint(document, "k0", (1.0, 2.0, 3.0), "clicked")
    second = place_keypoint(first, "k1", (4.0, 5.0, 6.0), "dragged")
    return first, second, set_status(second, "done")


@pytest.fixture
def writer(folder: Path, path: Path) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(folder), str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert _pipe(process.stdout).readline() == "open\n"
        yield process
        process.kill()


def _pipe(pipe: IO[str] | None) -> IO[str]:
    assert pipe is not None
    return pipe


def _tell(writer: subprocess.Popen[str], number: float) -> None:
    _pipe(writer.stdin).write(f"{number}\n")
    _pipe(writer.stdin).flush()
    assert _pipe(writer.stdout).readline() == "recorded\n"


def _only(folder: Path) -> Recovery:
    found = find_recoveries(folder)
    assert len(found) == 1
    return found[0]


def test_where_nothing_was_left_there_is_nothing(folder: Path) -> None:
    assert find_recoveries(folder) == ()
    folder.mkdir(parents=True)
    assert find_recoveries(folder) == ()


def test_what_a_dead_program_left_is_found(
    folder: Path, path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited:
        journal.record(document)
    journal.leave()
    found = _only(folder)
    assert found.document == edited[-1]
    assert found.edits == 3
    assert found.annotation_path == path
    assert found.expected == file_identity(path)
    assert found.journal_path == journal.path
    assert found.changed_at == journal.path.stat().st_mtime
    # Looking does not take it away.
    assert _only(folder) == found
    discard(found.journal_path)
    assert find_recoveries(folder) == ()
    assert list(folder.iterdir()) == []


def test_a_recovered_document_can_be_saved_where_it_belongs(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[1])
    journal.leave()
    found = _only(folder)
    save_annotation(found.document, found.annotation_path, expected=found.expected)
    assert find_recoveries(folder) == ()


def test_a_journal_in_use_is_not_offered(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    assert find_recoveries(folder) == ()
    journal.record(edited[1])
    journal.leave()
    assert _only(folder).document == edited[1]


def test_a_journal_in_use_by_another_program_is_offered_when_that_is_killed(
    folder: Path, writer: subprocess.Popen[str]
) -> None:
    _tell(writer, 17.0)
    assert find_recoveries(folder) == ()
    _tell(writer, 18.0)
    writer.send_signal(signal.SIGKILL if os.name != "nt" else signal.SIGTERM)
    writer.wait(timeout=60)
    found = _only(folder)
    assert found.document.positions_um == {"k0": (18.0, 0.0, 0.0)}
    assert found.edits == 2


def test_several_programs_leave_several_recoveries_oldest_first(
    folder: Path, path: Path, edited: tuple[Annotation, ...]
) -> None:
    journals = [RecoveryJournal(folder, path, "") for _ in edited]
    for age, (journal, document) in enumerate(zip(journals, edited, strict=True)):
        journal.record(document)
        journal.leave()
        os.utime(journal.path, (0, 1_000_000 - age))
    assert [found.document for found in find_recoveries(folder)] == list(edited[::-1])


def test_a_journal_cut_anywhere_gives_back_the_last_whole_edit(
    tmp_path: Path, folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    # Few keypoints and edits, and so fewer places to cut.
    short = [changed(document, keypoints=document.keypoints[:2]) for document in edited[:2]]
    ends = []
    for document in short:
        journal.record(document)
        ends.append(journal.path.stat().st_size)
    content = journal.path.read_bytes()
    assert len(content) == ends[-1]
    cut_folder = tmp_path / "cut"
    cut_folder.mkdir()
    for length in range(len(content) + 1):
        cut = cut_folder / "cut.journal"
        cut.write_bytes(content[:length])
        found = find_recoveries(cut_folder)
        whole = sum(end <= length for end in ends)
        assert [recovery.document for recovery in found] == ([short[whole - 1]] if whole else []), length
        # One with nothing to give back is cleared away.
        assert cut.exists() == bool(whole)


def test_a_saved_document_leaves_nothing(
    folder: Path, path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    _, identity = save_annotation(edited[0], path, expected=None)
    journal.restart(path, identity)
    journal.leave()
    assert find_recoveries(folder) == ()
    assert list(folder.iterdir()) == []


def test_dying_between_saving_and_forgetting_leaves_nothing(
    folder: Path, path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited:
        journal.record(document)
    save_annotation(edited[-1], path, expected=None, active_seconds=99.0)
    journal.leave()
    assert find_recoveries(folder) == ()


def test_edits_after_a_save_are_found_with_the_saved_file(
    tmp_path: Path, folder: Path, path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    elsewhere = tmp_path / "elsewhere.json"
    _, identity = save_annotation(edited[0], elsewhere, expected="")
    journal.restart(elsewhere, identity)
    journal.record(edited[1])
    journal.leave()
    found = _only(folder)
    assert (found.annotation_path, found.expected, found.edits) == (elsewhere, identity, 1)
    assert found.document == edited[1]


def test_undoing_everything_leaves_nothing(
    folder: Path, document: Annotation, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.record(document)
    journal.leave()
    assert find_recoveries(folder) == ()


def test_a_document_that_was_never_saved_is_found(
    tmp_path: Path, folder: Path, edited: tuple[Annotation, ...]
) -> None:
    journal = RecoveryJournal(folder, tmp_path / "never" / "saved.json", "")
    journal.record(edited[0])
    journal.leave()
    assert _only(folder).document == edited[0]
    assert _only(folder).expected == ""


def test_a_file_that_was_spoilt_meanwhile_hides_nothing(
    folder: Path, path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.leave()
    path.write_bytes(b"spoilt")
    assert _only(folder).document == edited[0]


def test_a_spoilt_path_hides_nothing(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.leave()
    journal.path.write_bytes(journal.path.read_bytes().replace(b"v001", b"v\\u0000", 1))
    assert _only(folder).document == edited[0]


def test_closing_in_order_leaves_nothing(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.remove()
    assert list(folder.iterdir()) == []
    journal.leave()
    journal.remove()


def test_a_relative_path_is_found_from_any_folder(
    tmp_path: Path, folder: Path, path: Path, edited: tuple[Annotation, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(path.parent)
    journal = RecoveryJournal(folder, Path(path.name), file_identity(path))
    journal.record(edited[0])
    journal.leave()
    monkeypatch.chdir(folder)
    assert _only(folder).annotation_path == path


@pytest.mark.parametrize(
    "content",
    [
        b"\x00" * 100 + b"\n" + b"\xff\xfe\n",
        b"Dear diary,\n",
        b"[]\n5\n",
        b"[" * 100_000 + b"\n",
        b'{"schema": "another-journal/1"}\n{"entry": 1}\n',
        b'{"schema": "oct-recovery/2", "annotation_path": "/a.json", "expected": ""}\n{"document": {}}\n',
        b'{"schema": "oct-recovery/1", "annotation_path": 5, "expected": ""}\n{"document": {}}\n',
        b'{"schema": "oct-recovery/1", "annotation_path": "/a.json", "expected": ""}\n{"document": {}}\n',
        b'{"schema": "oct-recovery/1", "annotation_path": "/a.json", "expected": ""}\n{"draft": {}}\n',
        b'{"schema": "oct-recovery/1", "annotation_path": "/a.json", "expected": ""}\n\xff\xff\n',
    ],
)
def test_what_cannot_be_read_is_left_alone_and_logged(
    folder: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    content: bytes,
    caplog: pytest.LogCaptureFixture,
) -> None:
    journal.record(edited[0])
    journal.leave()
    foreign = folder / "foreign.journal"
    foreign.write_bytes(content)
    (folder / "folder.journal").mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        assert _only(folder).document == edited[0]
    assert foreign.read_bytes() == content
    assert (folder / "folder.journal").is_dir()
    assert (folder / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert str(foreign) in caplog.text
    assert str(folder / "folder.journal") in caplog.text


def test_the_edits_of_a_newer_program_are_not_thrown_away(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.leave()
    newer = journal.path.read_bytes().replace(b"oct-annotation/1", b"oct-annotation/2")
    journal.path.write_bytes(newer)
    assert find_recoveries(folder) == ()
    assert journal.path.read_bytes() == newer


def test_an_edit_that_was_spoilt_on_the_disk_hides_no_other(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    middle = journal.path.stat().st_size
    journal.record(edited[1])
    journal.leave()
    content = journal.path.read_bytes()
    journal.path.write_bytes(content[: middle + 40] + b"\x00" * 60 + content[middle + 100 :])
    assert _only(folder).document == edited[0]


@pytest.fixture
def fill_disk(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Leave space for so many bytes: the next write comes up against the end."""

    def fill(space: int) -> None:
        original, left = os.write, space

        def write(descriptor: int, content: bytes) -> int:
            nonlocal left
            if left == 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            written = original(descriptor, content[:left])
            left -= written
            return written

        monkeypatch.setattr(os, "write", write)

    return fill


@pytest.mark.parametrize("space", [0, 1, 300])
def test_a_full_disk_keeps_earlier_edits_and_takes_later_ones(
    folder: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    fill_disk: Callable[[int], None],
    monkeypatch: pytest.MonkeyPatch,
    space: int,
) -> None:
    journal.record(edited[0])
    before = journal.path.read_bytes()
    fill_disk(space)
    with pytest.raises(SaveError, match="No space left on device") as refused:
        journal.record(edited[1])
    assert refused.value.remedy
    assert journal.path.read_bytes() == before
    monkeypatch.undo()
    journal.record(edited[2])
    journal.leave()
    assert _only(folder).document == edited[2]


def test_half_a_line_that_cannot_be_taken_back_swallows_no_later_edit(
    folder: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    fill_disk: Callable[[int], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    journal.record(edited[0])
    monkeypatch.setattr(os, "ftruncate", refuse)
    fill_disk(300)
    with pytest.raises(SaveError):
        journal.record(edited[1])
    monkeypatch.undo()
    journal.record(edited[2])
    journal.leave()
    assert _only(folder).document == edited[2]


def test_a_disk_that_is_full_after_a_save_spoils_no_later_edit(
    folder: Path,
    path: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    fill_disk: Callable[[int], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    journal.record(edited[0])
    _, identity = save_annotation(edited[0], path, expected=None)
    fill_disk(0)
    journal.restart(path, identity)
    with pytest.raises(SaveError):
        journal.record(edited[1])
    monkeypatch.undo()
    journal.record(edited[2])
    journal.leave()
    assert _only(folder).document == edited[2]
    assert _only(folder).expected == identity


def test_a_journal_that_cannot_be_begun_is_an_error_and_leaves_nothing(
    folder: Path, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = os.open

    def refuse(name: object, *args: object, **kwargs: object) -> int:
        if str(name).endswith(".journal"):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return original(name, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(SaveError, match="Read-only file system"):
        RecoveryJournal(folder, path, "")
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path: Path, path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SaveError, match="the recovery journal could not be written"):
        RecoveryJournal(tmp_path / "file" / "recovery", path, "")


def test_syncing_brings_edits_to_the_disk_once(
    journal: RecoveryJournal, edited: tuple[Annotation, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    journal.sync()
    assert synced == []
    journal.record(edited[0])
    journal.record(edited[1])
    assert synced == []
    journal.sync()
    journal.sync()
    assert len(synced) == 1


def test_a_sync_that_failed_is_tried_again(
    journal: RecoveryJournal, edited: tuple[Annotation, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    journal.record(edited[0])
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", fail)
        for _ in range(2):
            with pytest.raises(SaveError):
                journal.sync()
    journal.sync()


def test_a_journal_that_cannot_be_deleted_is_named(
    folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    journal.record(edited[0])
    journal.restart(folder / "x.json", "")
    journal.leave()
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(SaveError, match="could not be deleted") as refused:
        discard(journal.path)
    assert refused.value.where == journal.path
    assert find_recoveries(folder) == ()


def test_a_journal_is_for_its_owners_eyes(journal: RecoveryJournal) -> None:
    if os.name != "nt":
        assert journal.path.stat().st_mode & 0o077 == 0


def test_a_journal_is_a_header_and_whole_documents(
    path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited[:2]:
        journal.record(document)
    header, *lines = [json.loads(line) for line in journal.path.read_text(encoding="utf-8").splitlines()]
    assert header == {
        "schema": "oct-recovery/1",
        "annotation_path": str(path),
        "expected": file_identity(path),
    }
    assert [line["document"]["keypoints"][0]["position_um"] for line in lines] == [[1.0, 2.0, 3.0]] * 2
    saved, _ = load_annotation(path)
    assert annotation_bytes(without_stamps(saved)) != annotation_bytes(without_stamps(edited[0]))
