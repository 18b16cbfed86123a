import logging
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest

from annotations.documents.annotation import Annotation
from annotations.documents.files import file_identity, save_annotation
from annotations.documents.record import changed
from annotations.documents.recovery import Recovery, RecoveryJournal, discard, find_recoveries

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
def writer(recovery_folder: Path, saved_path: Path) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(recovery_folder), str(saved_path)],
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


def _only(recovery_folder: Path) -> Recovery:
    found = find_recoveries(recovery_folder)
    assert len(found) == 1
    return found[0]


def test_where_nothing_was_left_there_is_nothing(recovery_folder: Path) -> None:
    assert find_recoveries(recovery_folder) == ()
    recovery_folder.mkdir(parents=True)
    assert find_recoveries(recovery_folder) == ()


def test_what_a_dead_program_left_is_found(
    recovery_folder: Path, saved_path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited:
        journal.record(document)
    journal.leave()
    found = _only(recovery_folder)
    assert found.document == edited[-1]
    assert found.edits == 3
    assert found.annotation_path == saved_path
    assert found.expected == file_identity(saved_path)
    assert found.journal_path == journal.path
    assert found.changed_at == journal.path.stat().st_mtime
    # Looking does not take it away.
    assert _only(recovery_folder) == found
    discard(found.journal_path)
    assert find_recoveries(recovery_folder) == ()
    assert list(recovery_folder.iterdir()) == []


def test_a_recovered_document_can_be_saved_where_it_belongs(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[1])
    journal.leave()
    found = _only(recovery_folder)
    save_annotation(found.document, found.annotation_path, expected=found.expected)
    assert find_recoveries(recovery_folder) == ()


def test_a_journal_in_use_is_not_offered(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    assert find_recoveries(recovery_folder) == ()
    journal.record(edited[1])
    journal.leave()
    assert _only(recovery_folder).document == edited[1]


def test_a_journal_in_use_by_another_program_is_offered_when_that_is_killed(
    recovery_folder: Path, writer: subprocess.Popen[str]
) -> None:
    _tell(writer, 17.0)
    assert find_recoveries(recovery_folder) == ()
    _tell(writer, 18.0)
    writer.send_signal(signal.SIGKILL if os.name != "nt" else signal.SIGTERM)
    writer.wait(timeout=60)
    found = _only(recovery_folder)
    assert found.document.positions_um == {"k0": (18.0, 0.0, 0.0)}
    assert found.edits == 2


def test_several_programs_leave_several_recoveries_oldest_first(
    recovery_folder: Path, saved_path: Path, edited: tuple[Annotation, ...]
) -> None:
    journals = [RecoveryJournal(recovery_folder, saved_path, "") for _ in edited]
    for age, (journal, document) in enumerate(zip(journals, edited, strict=True)):
        journal.record(document)
        journal.leave()
        os.utime(journal.path, (0, 1_000_000 - age))
    assert [found.document for found in find_recoveries(recovery_folder)] == list(edited[::-1])


def test_a_journal_cut_anywhere_gives_back_the_last_whole_edit(
    tmp_path: Path, recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
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
    recovery_folder: Path, saved_path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    _, identity = save_annotation(edited[0], saved_path, expected="", overwrite=True)
    journal.restart(saved_path, identity)
    journal.leave()
    assert find_recoveries(recovery_folder) == ()
    assert list(recovery_folder.iterdir()) == []


def test_dying_between_saving_and_forgetting_leaves_nothing(
    recovery_folder: Path, saved_path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited:
        journal.record(document)
    save_annotation(changed(edited[-1], active_seconds=99.0), saved_path, expected="", overwrite=True)
    journal.leave()
    assert find_recoveries(recovery_folder) == ()


def test_edits_after_a_save_are_found_with_the_saved_file(
    tmp_path: Path,
    recovery_folder: Path,
    saved_path: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
) -> None:
    journal.record(edited[0])
    elsewhere = tmp_path / "elsewhere.json"
    _, identity = save_annotation(edited[0], elsewhere, expected="")
    journal.restart(elsewhere, identity)
    journal.record(edited[1])
    journal.leave()
    found = _only(recovery_folder)
    assert (found.annotation_path, found.expected, found.edits) == (elsewhere, identity, 1)
    assert found.document == edited[1]


def test_undoing_everything_leaves_nothing(
    recovery_folder: Path, document: Annotation, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.record(document)
    journal.leave()
    assert find_recoveries(recovery_folder) == ()


def test_a_document_that_was_never_saved_is_found(
    tmp_path: Path, recovery_folder: Path, edited: tuple[Annotation, ...]
) -> None:
    journal = RecoveryJournal(recovery_folder, tmp_path / "never" / "saved.json", "")
    journal.record(edited[0])
    journal.leave()
    assert _only(recovery_folder).document == edited[0]
    assert _only(recovery_folder).expected == ""


def test_a_file_that_was_spoilt_meanwhile_hides_nothing(
    recovery_folder: Path, saved_path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.leave()
    saved_path.write_bytes(b"spoilt")
    assert _only(recovery_folder).document == edited[0]


def test_a_spoilt_path_hides_nothing(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.leave()
    journal.path.write_bytes(journal.path.read_bytes().replace(b"v001", b"v\\u0000", 1))
    assert _only(recovery_folder).document == edited[0]


def test_closing_in_order_leaves_nothing(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    journal.remove()
    assert list(recovery_folder.iterdir()) == []
    journal.leave()
    journal.remove()


def test_a_relative_path_is_found_from_any_folder(
    tmp_path: Path,
    recovery_folder: Path,
    saved_path: Path,
    edited: tuple[Annotation, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(saved_path.parent)
    journal = RecoveryJournal(recovery_folder, Path(saved_path.name), file_identity(saved_path))
    journal.record(edited[0])
    journal.leave()
    monkeypatch.chdir(recovery_folder)
    assert _only(recovery_folder).annotation_path == saved_path


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
    recovery_folder: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    content: bytes,
    caplog: pytest.LogCaptureFixture,
) -> None:
    journal.record(edited[0])
    journal.leave()
    foreign = recovery_folder / "foreign.journal"
    foreign.write_bytes(content)
    (recovery_folder / "folder.journal").mkdir()
    (recovery_folder / "notes.txt").write_text("mine", encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        assert _only(recovery_folder).document == edited[0]
    assert foreign.read_bytes() == content
    assert (recovery_folder / "folder.journal").is_dir()
    assert (recovery_folder / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert str(foreign) in caplog.text
    assert str(recovery_folder / "folder.journal") in caplog.text


@pytest.mark.parametrize("schema", [b"oct-annotation/", b"oct-recovery/"])
def test_the_edits_of_a_newer_program_are_not_thrown_away(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...], schema: bytes
) -> None:
    journal.record(edited[0])
    journal.leave()
    newer = journal.path.read_bytes().replace(schema + b"1", schema + b"2")
    journal.path.write_bytes(newer)
    assert find_recoveries(recovery_folder) == ()
    assert journal.path.read_bytes() == newer


def test_an_edit_that_was_spoilt_on_the_disk_hides_no_other(
    recovery_folder: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    journal.record(edited[0])
    middle = journal.path.stat().st_size
    journal.record(edited[1])
    journal.leave()
    content = journal.path.read_bytes()
    journal.path.write_bytes(content[: middle + 40] + b"\x00" * 60 + content[middle + 100 :])
    assert _only(recovery_folder).document == edited[0]
