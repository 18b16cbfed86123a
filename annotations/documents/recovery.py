"""Recovery journals: every finished edit on disk before the next event, read back after a crash.

A journal is a file of JSON lines: a header that names the document's file, then the whole document after each
edit. Whole documents, not differences: a line of 2 kB is written in microseconds, and any last whole line is
enough to recover. A journal is locked by its writer; one that is not locked was left by a program that died.
"""

import contextlib
import json
import os
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from annotations.documents.annotation import Annotation, without_stamps
from annotations.documents.files import FileIdentity, load_annotation, parse_annotation
from annotations.durable_files import SaveError, sync_folder
from annotations.errors import UserError

_SCHEMA = "oct-recovery/1"
_SUFFIX = ".journal"


@dataclass(frozen=True)
class Recovery:
    """What a dead program left behind.

    Attributes
    ----------
    journal_path : Path
    annotation_path : Path
        The file that the document belongs to.
    expected : str
        Identity of that file's content when the document was last read or saved.
    document : Annotation
        After the last edit that was written whole.
    edits : int
        Number of edits since then.
    changed_at : float
        When the journal was last written, seconds since the epoch.
    """

    journal_path: Path
    annotation_path: Path
    expected: FileIdentity
    document: Annotation
    edits: int
    changed_at: float


class RecoveryJournal:
    """The journal of one open document; create it, `record` each edit, `restart` after each save, `remove` it.

    Parameters
    ----------
    folder : Path
        Where journals are kept, on this machine; created if absent.
    annotation_path : Path
        The file that the document belongs to.
    expected : str
        Identity of that file's present content.

    Raises
    ------
    SaveError
        The journal cannot be written.
    """

    def __init__(self, folder: Path, annotation_path: Path, expected: FileIdentity) -> None:
        self.path = folder / f"{uuid.uuid4().hex}{_SUFFIX}"
        self._annotation_path = annotation_path
        self._written_unsynced = False
        with _failures_named(self.path):
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = FileLock(_lock_path(self.path))
            self._lock.acquire(timeout=0)
            self._descriptor = os.open(self.path, os.O_CREAT | os.O_RDWR | os.O_APPEND, 0o600)
            self._begin(expected)
            os.fsync(self._descriptor)
            sync_folder(folder)

    def record(self, document: Annotation) -> None:
        """Write the document after an edit. On return the operating system has it: a killed program loses nothing."""
        line = json.dumps({"document": document.model_dump(mode="json", by_alias=True, exclude_none=True)})
        with _failures_named(self.path):
            self._append(line)
        self._written_unsynced = True

    def sync(self) -> None:
        """Bring what was recorded to the disk itself, so that a power cut loses nothing either."""
        if self._written_unsynced:
            self._written_unsynced = False
            with _failures_named(self.path):
                os.fsync(self._descriptor)

    def restart(self, annotation_path: Path, expected: FileIdentity) -> None:
        """Forget the edits: they are saved, and the document's file is what ``expected`` says."""
        self._annotation_path = annotation_path
        with _failures_named(self.path):
            os.ftruncate(self._descriptor, 0)
            self._begin(expected)
        self._written_unsynced = True

    def remove(self) -> None:
        """Close the journal and delete it: nothing is left to recover."""
        self.leave()
        discard(self.path)

    def leave(self) -> None:
        """Close the journal and leave it on disk, to be offered at the next start."""
        self.sync()
        os.close(self._descriptor)
        self._lock.release()

    def _begin(self, expected: FileIdentity) -> None:
        self._append(
            json.dumps(
                {"schema": _SCHEMA, "annotation_path": str(self._annotation_path), "expected": expected}
            )
        )

    def _append(self, line: str) -> None:
        content = line.encode() + b"\n"
        begin = os.fstat(self._descriptor).st_size
        written = 0
        try:
            while written < len(content):
                written += os.write(self._descriptor, content[written:])
        except OSError:
            # Half a line on a full disk would swallow the next one.
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, begin)
            raise


def find_recoveries(folder: Path) -> tuple[Recovery, ...]:
    """Return what dead programs left in a folder, oldest first; journals that are in use are not.

    A last line that was cut off by the crash is passed over: its edit was not finished. A journal whose last
    edit is in the document's file, or that has no edit, has nothing to give back and is deleted.
    """
    found = []
    for path in sorted(folder.glob(f"*{_SUFFIX}")):
        lock = FileLock(_lock_path(path))
        try:
            lock.acquire(timeout=0)
        except (Timeout, OSError):
            continue
        try:
            recovery = _read(path)
        finally:
            lock.release()
        if recovery is None or _is_saved(recovery):
            discard(path)
        else:
            found.append(recovery)
    return tuple(sorted(found, key=lambda recovery: recovery.changed_at))


def discard(journal_path: Path) -> None:
    """Delete a journal that is not in use."""
    journal_path.unlink(missing_ok=True)
    _lock_path(journal_path).unlink(missing_ok=True)


def _read(path: Path) -> Recovery | None:
    """Read a journal; None if it holds no finished edit."""
    header, *edits = [line for line in path.read_bytes().split(b"\n")[:-1] if line] or [b""]
    try:
        fields: dict[str, Any] = json.loads(header)
        annotation_path, expected = Path(fields["annotation_path"]), str(fields["expected"])
    except (ValueError, KeyError, TypeError):
        return None
    for line in reversed(edits):
        with contextlib.suppress(UserError, ValueError, KeyError, TypeError):
            document = parse_annotation(json.dumps(json.loads(line)["document"]).encode(), path)
            return Recovery(path, annotation_path, expected, document, len(edits), path.stat().st_mtime)
    return None


def _is_saved(recovery: Recovery) -> bool:
    """Say whether the program died between saving the document and forgetting its edits."""
    with contextlib.suppress(UserError):
        saved, _ = load_annotation(recovery.annotation_path)
        return without_stamps(saved) == without_stamps(recovery.document)
    return False


def _lock_path(journal_path: Path) -> Path:
    return journal_path.with_suffix(".lock")


@contextlib.contextmanager
def _failures_named(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SaveError(
            f"the recovery journal could not be written ({error.strerror or error})",
            where=path,
            remedy="Save your work now, then free some space",
        ) from error
