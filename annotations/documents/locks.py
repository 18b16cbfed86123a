"""Lock files: who has an annotation file open, so that nobody else writes to it meanwhile.

The lock of ``v001.keypoints.json`` is ``v001.keypoints.json.lock`` beside it, JSON that a person can read. It
is renewed while the document is open. Locks are taken and given up under the folder's guard, see
`annotations.documents.write_guard`. They keep people from working side by side on one file; that no version
is lost, `save_annotation` makes sure by itself.
"""

import contextlib
import logging
import os
import platform
import sys
import time
import uuid
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal, Self

import psutil
from pydantic import Field, ValidationError

from annotations.documents.json_text import JsonProblem, parse_strictly
from annotations.documents.record import Moment, Record, changed, now
from annotations.documents.write_guard import writing_beside
from annotations.durable_files import SaveError, replace_durably, sync_folder

RENEWAL_S = 30.0
"""How often an open document's lock is renewed."""

STALE_S = 120.0
"""After how long without renewal another computer's lock may be taken over."""

TAKEOVER_LOG = "takeovers.log"

# The system counts a process's start in ticks, and reads it back through a floating-point number.
_START_TOLERANCE_S = 2.0
# Tokens of the locks that this process has: it may have left a lock file where it could not delete it.
_HELD: set[str] = set()
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class LockHolder:
    """Who has a document open.

    Attributes
    ----------
    person, host : str
        Empty where the lock file does not say it: it is damaged, or of a newer program.
    since, renewed : datetime or None
        By the clock of the holder's computer.
    age_s : float
        Seconds since the last renewal, by the clock of the computer that keeps the folder.
    token : str
        Tells this lock from any other, also of the same person in the same process.
    is_here : bool
        Whether the holder is on this computer.
    is_gone : bool
        Whether the holder was a process on this computer that is no more, or this one, which has given the
        lock up.
    is_stale : bool
        Whether the holder is on another computer, or unknown, and has not renewed the lock for `STALE_S`.
    """

    person: str
    host: str
    since: datetime | None
    renewed: datetime | None
    age_s: float
    token: str
    is_here: bool
    is_gone: bool
    is_stale: bool

    @property
    def is_own(self) -> bool:
        """Whether the lock is this very process's."""
        return self.token in _HELD

    def __str__(self) -> str:
        """Say in words who it is, where, and since when by the clock of this computer."""
        if not self.host or self.since is None:
            return "another program (its lock file cannot be read)"
        where = "in another window on this computer" if self.is_here else f"on {self.host}"
        return f"{self.person} {where}, since {self.since.astimezone():%Y-%m-%d %H:%M}"


class DocumentLocked(SaveError):  # noqa: N818 - named for what happened
    """Somebody has the document open.

    Attributes
    ----------
    holder : LockHolder
    """

    def __init__(self, path: Path, holder: LockHolder) -> None:
        super().__init__(
            f"it is open elsewhere: {holder}",
            where=path,
            remedy="Close it there and open it here again, or look at it without changing it",
        )
        self.holder = holder


class _LockFile(Record):
    """What stands in a lock file; ``process_started`` as `_started_s` counts it."""

    schema_id: Literal["oct-lock/1"] = Field(default="oct-lock/1", alias="schema")
    person: str
    host: str
    process_id: int
    process_started: float
    token: str
    since: Moment
    renewed: Moment


class DocumentLock:
    """The lock of one open document; `acquire` it, `renew` it every `RENEWAL_S`, `release` it.

    Attributes
    ----------
    path : Path
        The annotation file, which need not exist yet.
    made : tuple of Path
        Folders, the innermost first, that were made for the lock.
    """

    def __init__(self, path: Path, content: _LockFile, made: tuple[Path, ...] = ()) -> None:
        self.path = path
        self._content = content
        self.made = made

    @classmethod
    def acquire(cls, path: Path, person: str) -> Self:
        """Take the lock; one that a dead process of this computer left is taken over at once.

        Raises
        ------
        DocumentLocked
            Somebody has it.
        SaveError
            Nobody has it, but no lock file can be written here: the folder is read-only, say.
        """
        folder = lock_path(path).parent
        made = tuple(each for each in (folder, *folder.parents) if not each.exists())
        with writing_beside(path):
            holder = holder_of(path)
            if holder is not None and not holder.is_gone:
                raise DocumentLocked(path, holder)
            if holder is not None:
                _LOG.info("%s: the lock of a process that is gone was taken over (%s)", path, holder)
            return cls._begin(path, person, made)

    @classmethod
    def take_over(cls, path: Path, person: str, holder: LockHolder) -> Self:
        """Take a lock that is not renewed any more away from somebody; that is logged beside it.

        Parameters
        ----------
        holder : LockHolder
            From whom, as `DocumentLocked` said.

        Raises
        ------
        DocumentLocked
            The lock was renewed meanwhile, or somebody else has it by now.
        SaveError
            The lock file or the log cannot be written; the lock is still the other one's.
        """
        with writing_beside(path):
            present = holder_of(path)
            if present is not None and not present.is_gone:
                if not present.is_stale or present.token != holder.token:
                    raise DocumentLocked(path, present)
                _log_takeover(path, person, present)
            return cls._begin(path, person)

    @classmethod
    def _begin(cls, path: Path, person: str, made: tuple[Path, ...] = ()) -> Self:
        moment = now()
        content = _LockFile(
            person=person,
            host=_host(),
            process_id=os.getpid(),
            process_started=_started_s(psutil.Process()),
            token=uuid.uuid4().hex,
            since=moment,
            renewed=moment,
        )
        _write(path, content)
        _HELD.add(content.token)
        return cls(path, content, made)

    def renew(self) -> bool:
        """Say that the document is still open; False if the lock is no longer this one.

        SaveError if that cannot be said now: the share is away, perhaps, or the folder was moved.
        """
        self._require_folder()
        with writing_beside(self.path):
            if not self.is_held():
                return False
            self._content = changed(self._content, renewed=now())
            _write(self.path, self._content)
        return True

    def is_held(self) -> bool:
        """Say whether the lock file is still this one; SaveError if it cannot be read."""
        self._require_folder()
        content = _read(self.path)
        return isinstance(content, _LockFile) and content.token == self._content.token

    def disown(self) -> None:
        """Say, without waiting for a disk, that this process is about to `release` the lock.

        From then on it does not take itself for somebody else, and may `acquire` another lock in its place.
        """
        _HELD.discard(self._content.token)

    def tidy_after(self, before: "DocumentLock") -> None:
        """Remove, when this lock is released, also what was made for one that was taken before it.

        That one cannot, as long as this one's file is in its folder.
        """
        folder = lock_path(self.path).parent
        made = {*self.made, *before.made}
        self.made = tuple(each for each in (folder, *folder.parents) if each in made)

    def release(self) -> None:
        """Give the lock up; nothing happens if it is no longer this one. SaveError if that fails.

        Folders that were made for the lock, and in which nothing was saved, are removed.
        """
        # Also where it stays all the same.
        self.disown()
        self._require_folder()
        with writing_beside(self.path, tidied=self.made):
            if not self.is_held():
                return
            try:
                lock_path(self.path).unlink(missing_ok=True)
            except OSError as error:
                raise SaveError(
                    f"it could not be deleted ({error.strerror or error})",
                    where=lock_path(self.path),
                    remedy="It is passed over by whoever opens the document next on this computer",
                ) from error

    def _require_folder(self) -> None:
        """Raise SaveError where the folder has been moved, or its share is away: it is not made anew."""
        folder = lock_path(self.path).parent
        if not folder.is_dir():
            raise SaveError(
                "its folder is not there any more",
                where=folder,
                remedy="Bring it back, or open the document where it is now",
            )


def lock_path(path: Path) -> Path:
    """Return where an annotation file's lock is kept: beside the file itself, where that is linked to."""
    target = Path(os.path.realpath(path))
    return target.with_name(f"{target.name}.lock")


def holder_of(path: Path) -> LockHolder | None:
    """Return who has an annotation file open, None if nobody has; SaveError if that cannot be read."""
    content = _read(path)
    if content is None:
        return None
    age_s = _age_s(lock_path(path))
    if content == "unreadable":
        # A program of this computer that died leaves no such file, for lock files are replaced as a whole.
        return LockHolder("", "", None, None, age_s, "", False, False, age_s >= STALE_S)
    is_here = content.host == _host()
    return LockHolder(
        person=content.person,
        host=content.host,
        since=content.since,
        renewed=content.renewed,
        age_s=age_s,
        token=content.token,
        is_here=is_here,
        is_gone=is_here and not _is_holding(content),
        is_stale=not is_here and age_s >= STALE_S,
    )


def _read(path: Path) -> _LockFile | Literal["unreadable"] | None:
    try:
        content = lock_path(path).read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise SaveError(
            f"it could not be read who has the document open ({error.strerror or error})",
            where=lock_path(path),
            remedy="Check that the folder is there, and that you may read its files",
        ) from error
    try:
        return _LockFile.model_validate(parse_strictly(content.decode()))
    except (UnicodeDecodeError, JsonProblem, ValidationError):
        return "unreadable"


def _write(path: Path, content: _LockFile) -> None:
    replace_durably(lock_path(path), f"{content.model_dump_json(indent=2)}\n".encode())


def _age_s(path: Path) -> float:
    """Return how long ago a file was written, by the clock that also stamps a fresh file in its folder.

    On a shared folder that is the server's clock: those of the people's computers may be minutes apart.
    """
    probe = path.with_name(f".{uuid.uuid4().hex}.probe")
    try:
        probe.write_bytes(b"")
        present = probe.stat().st_mtime
    except OSError:
        # In a folder that cannot be written nobody here takes a lock over.
        present = time.time()
    finally:
        with contextlib.suppress(OSError):
            probe.unlink(missing_ok=True)
    try:
        return max(0.0, present - path.stat().st_mtime)
    except OSError:
        # It was given up in this moment.
        return 0.0


def _log_takeover(path: Path, person: str, holder: LockHolder) -> None:
    whom = f"{holder.person} on {holder.host}" if holder.host else "a holder that the lock file did not name"
    last = f", last renewed {_written(holder.renewed)} by their clock" if holder.renewed else ""
    words = f"{path.name}: taken over by {person} on {_host()} from {whom}{last}, {holder.age_s:.0f} s ago"
    # A name may hold whatever a person typed, and a line stays a line.
    line = " ".join(f"{_written(now())} {words}".split())
    log_path = lock_path(path).with_name(TAKEOVER_LOG)
    try:
        with log_path.open("a", encoding="utf-8", errors="backslashreplace", newline="\n") as log:
            log.write(f"{line}\n")
            log.flush()
            os.fsync(log.fileno())
    except OSError as error:
        raise SaveError(
            f"the takeover could not be written down ({error.strerror or error})",
            where=log_path,
            remedy="Nothing was taken over; free space, or ask for permission to write there",
        ) from error
    sync_folder(log_path.parent)
    _LOG.warning("%s", line)


def _written(moment: datetime) -> str:
    return f"{moment:%Y-%m-%dT%H:%M:%SZ}"


def _host() -> str:
    return platform.node() or "unknown"


def _is_holding(content: _LockFile) -> bool:
    is_own = content.process_id == os.getpid()
    return _is_alive(content.process_id, content.process_started) and (not is_own or content.token in _HELD)


def _is_alive(process_id: int, started_s: float) -> bool:
    """Say whether the process that wrote a lock still runs, and not another one with its number."""
    try:
        process = psutil.Process(process_id)
        if process.status() == psutil.STATUS_ZOMBIE:
            return False
        return abs(_started_s(process) - started_s) < _START_TOLERANCE_S
    except (psutil.NoSuchProcess, ValueError, OverflowError):
        return False
    except psutil.Error:
        # It is there, but somebody else's.
        return True


def _started_s(process: psutil.Process) -> float:
    """Return when a process began: in seconds since the epoch, on Linux since the computer started.

    Linux counts from there, and a clock that is set would make a living process look like another one.
    """
    started = float(process.create_time())
    return started - psutil.boot_time() if sys.platform == "linux" else started
