"""Writing the journal, above all when the disk will not have it. What is found again: `test_recovery.py`."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from annotations.documents.annotation import Annotation, without_stamps
from annotations.documents.files import annotation_bytes, file_identity, load_annotation, save_annotation
from annotations.documents.recovery import RecoveryJournal, discard, find_recoveries
from annotations.durable_files import SaveError


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
    recovery_folder: Path,
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
    (found,) = find_recoveries(recovery_folder)
    assert found.document == edited[2]


def test_half_a_line_that_cannot_be_taken_back_swallows_no_later_edit(
    recovery_folder: Path,
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
    (found,) = find_recoveries(recovery_folder)
    assert found.document == edited[2]


def test_a_disk_that_is_full_after_a_save_spoils_no_later_edit(
    recovery_folder: Path,
    saved_path: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    fill_disk: Callable[[int], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    journal.record(edited[0])
    _, identity = save_annotation(edited[0], saved_path, expected="", overwrite=True)
    fill_disk(0)
    journal.restart(saved_path, identity)
    with pytest.raises(SaveError):
        journal.record(edited[1])
    monkeypatch.undo()
    journal.record(edited[2])
    journal.leave()
    (found,) = find_recoveries(recovery_folder)
    assert found.document == edited[2]
    assert found.expected == identity


def test_a_journal_that_cannot_be_begun_is_an_error_and_leaves_nothing(
    recovery_folder: Path, saved_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = os.open

    def refuse(name: object, *args: object, **kwargs: object) -> int:
        if str(name).endswith(".journal"):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        return original(name, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(SaveError, match="Read-only file system"):
        RecoveryJournal(recovery_folder, saved_path, "")
    assert list(recovery_folder.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path: Path, saved_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(SaveError, match="the recovery journal could not be written"):
        RecoveryJournal(tmp_path / "file" / "recovery", saved_path, "")


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
    recovery_folder: Path,
    journal: RecoveryJournal,
    edited: tuple[Annotation, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    journal.record(edited[0])
    journal.restart(recovery_folder / "x.json", "")
    journal.leave()
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(SaveError, match="could not be deleted") as refused:
        discard(journal.path)
    assert refused.value.where == journal.path
    assert find_recoveries(recovery_folder) == ()


@pytest.mark.skipif(os.name == "nt", reason="permissions as POSIX has them")
def test_a_journal_is_for_its_owners_eyes(journal: RecoveryJournal) -> None:
    assert journal.path.stat().st_mode & 0o077 == 0


def test_a_journal_is_a_header_and_whole_documents(
    saved_path: Path, journal: RecoveryJournal, edited: tuple[Annotation, ...]
) -> None:
    for document in edited[:2]:
        journal.record(document)
    header, *lines = [json.loads(line) for line in journal.path.read_text(encoding="utf-8").splitlines()]
    assert header == {
        "schema": "oct-recovery/1",
        "annotation_path": str(saved_path),
        "expected": file_identity(saved_path),
    }
    assert [line["document"]["keypoints"][0]["position_um"] for line in lines] == [[1.0, 2.0, 3.0]] * 2
    saved, _ = load_annotation(saved_path)
    assert annotation_bytes(without_stamps(saved)) != annotation_bytes(without_stamps(edited[0]))
