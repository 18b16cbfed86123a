"""Recovery journals: every finished edit on disk before the next event, read back after a crash.

A journal is a file of JSON lines: a header that names the document's file, then the whole document after each
edit. Whole documents, not differences: a line of 2 kB is written in microseconds, and any last whole line is
enough to recover. A journal is locked by its writer; one that is not locked was left by a program that died.
"""

import contextlib
import errno
import json
import logging
import os
import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from annotations.documents.annotation import Annotation, without_stamps
from annotations.documents.files import DocumentError, FileIdentity, load_annotation, parse_annotation
from annotations.documents.json_text import parse_strictly
from annotations.durable_files import SaveError, sync_folder
from annotations.errors import UserError

_SCHEMA = "oct-recovery/1"
_SUFFIX = ".journal"
# The system may let go of a dead process's locks a moment after the process itself is gone.
_RELEASE_S = 0.3
# O_BINARY, which Windows alone has, keeps it from rewriting the ends of lines.
_FLAGS = os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0)
_LOG = logging.getLogger(__name__)


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
    """The journal of one open document.

    Create it, `record` each edit, `restart` it after each save, and `remove` it when the document is closed.

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
        self._header = _header(annotation_path, expected)
        self._unsynced = False
        self._torn = False
        self._closed = False
        with _failures_named(self.path):
            folder.mkdir(parents=True, exist_ok=True)
            # Locked before it appears, so that no other program ever sees it unlocked.
            self._lock = _lock(self.path)
            self._lock.acquire(timeout=0)
            try:
                self._descriptor = os.open(self.path, _FLAGS, 0o600)
            except OSError:
                self._lock.release()
                _lock_path(self.path).unlink(missing_ok=True)
                raise
        sync_folder(folder)

    def record(self, document: Annotation) -> None:
        """Write the document after an edit; on return the operating system has it.

        A program that is killed afterwards loses nothing; a computer without power loses what came after the
        last `sync`. SaveError if it cannot be written; what was recorded before is whole.
        """
        line = json.dumps({"document": document.model_dump(mode="json", exclude_none=True)})
        with _failures_named(self.path):
            self._refuse_if_closed()
            self._append(line)
        self._unsynced = True

    def sync(self) -> None:
        """Bring what was recorded to the disk itself, so that a power cut loses nothing either."""
        if self._unsynced:
            with _failures_named(self.path):
                self._refuse_if_closed()
                os.fsync(self._descriptor)
            self._unsynced = False

    def restart(self, annotation_path: Path, expected: FileIdentity) -> None:
        """Forget the edits: they are saved, and the document's file is what ``expected`` says."""
        self._header = _header(annotation_path, expected)
        with _failures_named(self.path):
            self._refuse_if_closed()
            os.ftruncate(self._descriptor, 0)
        self._torn = False
        self._unsynced = True

    def remove(self) -> None:
        """Close the journal and delete it: nothing is left to recover."""
        self.leave()
        discard(self.path)

    def leave(self) -> None:
        """Close the journal and leave it on disk, to be offered at the next start; again does nothing."""
        if self._closed:
            return
        try:
            self.sync()
        finally:
            self._closed = True
            os.close(self._descriptor)
            self._lock.release()

    def _refuse_if_closed(self) -> None:
        # The system gives a closed file's number to the next one: that is somebody else's.
        if self._closed:
            raise OSError(errno.EBADF, "it is closed")

    def _append(self, line: str) -> None:
        begin = os.fstat(self._descriptor).st_size
        # The header comes with the first edit: a restart then needs no space on the disk, and cannot fail
        # halfway and leave a journal that nobody knows how to read.
        before = f"{self._header}\n" if begin == 0 else "\n" if self._torn else ""
        content = f"{before}{line}\n".encode()
        written = 0
        try:
            while written < len(content):
                written += os.write(self._descriptor, content[written:])
        except OSError:
            # Half a line on a full disk would swallow the next one.
            self._torn = True
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, begin)
                self._torn = False
            raise
        self._torn = False


def find_recoveries(folder: Path) -> tuple[Recovery, ...]:
    """Return what dead programs left in a folder, oldest first; journals that are in use are not.

    A last line that was cut off by the crash is passed over: its edit was not finished. A journal whose last
    edit is in the document's file, or that has no edit, has nothing to give back and is deleted. One that
    cannot be read (a newer program's, a damaged or a foreign one) stays where it is, and the log names it.
    """
    found = []
    for path in sorted(folder.glob(f"*{_SUFFIX}")):
        lock = _lock(path)
        try:
            lock.acquire(timeout=_RELEASE_S, poll_interval=0.01)
        except (Timeout, OSError):
            continue
        try:
            recovery = _read(path)
        except (OSError, UserError) as error:
            _LOG.warning("The recovery journal %s was left alone: %s", path, error)
            continue
        finally:
            lock.release()
        if recovery is None or _is_saved(recovery):
            with contextlib.suppress(SaveError):
                discard(path)
        else:
            found.append(recovery)
    return tuple(sorted(found, key=lambda recovery: recovery.changed_at))


def discard(journal_path: Path) -> None:
    """Delete a journal that is not in use; SaveError if that is not possible."""
    try:
        journal_path.unlink(missing_ok=True)
        _lock_path(journal_path).unlink(missing_ok=True)
    except OSError as error:
        raise SaveError(
            f"the recovery journal could not be deleted ({error.strerror or error})",
            where=journal_path,
            remedy="Delete the file yourself, or it will be offered again",
        ) from error


def _header(annotation_path: Path, expected: FileIdentity) -> str:
    # Absolute: the program that reads this may be started in another folder.
    return json.dumps(
        {"schema": _SCHEMA, "annotation_path": str(annotation_path.absolute()), "expected": expected}
    )


def _read(path: Path) -> Recovery | None:
    """Read a journal; None if it holds no finished edit, DocumentError if nobody here can read it."""
    lines = [line for line in path.read_bytes().split(b"\n")[:-1] if line]
    if not lines:
        return None
    try:
        header: dict[str, Any] = parse_strictly(lines[0].decode())
        if header["schema"] != _SCHEMA:
            raise DocumentError(f"its schema is {header['schema']!r}, not {_SCHEMA!r}")
        annotation_path, expected = Path(header["annotation_path"]), str(header["expected"])
    except (ValueError, KeyError, TypeError) as error:
        raise DocumentError("it is no recovery journal") from error
    edits = lines[1:]
    problem: Exception | None = None
    for line in reversed(edits):
        try:
            fields = parse_strictly(line.decode())["document"]
            document = parse_annotation(json.dumps(fields).encode(), path)
        except (UserError, ValueError, KeyError, TypeError) as error:
            problem = problem or error
        else:
            return Recovery(path, annotation_path, expected, document, len(edits), path.stat().st_mtime)
    if problem is None:
        return None
    raise DocumentError(f"none of its {len(edits)} edits can be read ({problem})") from problem


def _is_saved(recovery: Recovery) -> bool:
    """Say whether the program died between saving the document and forgetting its edits."""
    try:
        saved, _ = load_annotation(recovery.annotation_path)
    except UserError:
        return False
    seen = [(document.viewings, document.reopened) for document in (saved, recovery.document)]
    return seen[0] == seen[1] and without_stamps(saved) == without_stamps(recovery.document)


def _lock(journal_path: Path) -> FileLock:
    # Whichever thread closes the journal lets go of the lock.
    return FileLock(_lock_path(journal_path), thread_local=False)


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
