"""The lock of the open document: taken, renewed while it is open, given up."""

import contextlib
import errno
import logging
from collections.abc import Callable, Iterator
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot

from annotations.documents.locks import RENEWAL_S, DocumentLock, DocumentLocked, LockHolder, holder_of
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotator.session.files.spare_locks import Claim, FolderReadOnly, SpareLocks, give_up
from annotator.session.jobs import Jobs

# How long a lock that was taken ahead, or belongs to the document before, is kept: the window is drawn then.
_KEPT_MS = 200
_FORBIDDEN = frozenset({errno.EACCES, errno.EPERM, errno.EROFS})
_LOG = logging.getLogger(__name__)


class LockKeeper(QObject):
    """Holds the lock of one document at a time; where no lock file can be written, none.

    Signals
    -------
    lost : DocumentLocked
        Somebody else has the lock now.
    """

    lost = Signal(object)
    _claimed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._lock: DocumentLock | None = None
        self._person = ""
        self._is_renewing = False
        # Of its own: behind the session's long work a renewal could come too late.
        self._jobs = Jobs(self)
        self._timer = QTimer(self, interval=round(1000 * RENEWAL_S))
        self._timer.timeout.connect(self.renew)
        self._spare = SpareLocks()
        self._spare_timer = QTimer(self, interval=_KEPT_MS, singleShot=True)
        self._spare_timer.timeout.connect(self._on_spare_timer_timeout)
        self._claimed.connect(self._give_up_soon, Qt.ConnectionType.QueuedConnection)

    @property
    def is_holding(self) -> bool:
        """Whether there is a lock, as far as is known here."""
        return self._lock is not None

    def claim(self, path: Path, person: str) -> None:
        """Ask for a document's lock ahead of `hold`, from any thread; given up soon if nobody holds it."""
        lock = self._lock
        if (lock is not None and lock.path == path) or (path, person) in self._spare:
            return
        claim = _claimed(path, person)
        if isinstance(claim, DocumentLocked) and claim.holder.is_own:
            # The open document's, in a folder that was renamed: that is left before another one is held.
            return
        self._spare.put(path, person, claim)
        self._claimed.emit()

    def hold(self, path: Path, person: str) -> None:
        """Take a document's lock, unless it is held, and give up any other, soon.

        DocumentLocked if it is taken, FolderReadOnly if neither it nor the document can be written there.
        """
        if self._lock is not None and self._lock.path == path:
            return
        before = self._lock
        self.leave()
        asked = self._spare.take(path, person)
        (claim,) = asked or (self._acquired(path, person),)
        if isinstance(claim, DocumentLocked | FolderReadOnly):
            raise claim
        if claim is not None and before is not None:
            claim.tidy_after(before)
        self._keep(claim, person)

    def take_over(self, path: Path, person: str, holder: LockHolder) -> None:
        """Take a document's lock from somebody, as `DocumentLock.take_over` does and with its errors."""
        taken = DocumentLock.take_over(path, person, holder)
        self.release()
        self._keep(taken, person)

    @contextlib.contextmanager
    def moving_to(self, path: Path, person: str) -> Iterator[None]:
        """Take another document's lock in place of the present one if what is done meanwhile succeeds.

        DocumentLocked if it is taken.
        """
        if self._lock is not None and self._lock.path == path:
            yield
            return
        fresh = self._acquired(path, person)
        try:
            yield
        except BaseException:
            give_up(fresh)
            raise
        self.release()
        self._keep(fresh, person)

    def look_whether_free(self, path: Path, found: Callable[[], None]) -> None:
        """Look in the background whether nobody has a document open any more, and call back if so."""
        self._jobs.start(
            "Looking whether a document is free",
            lambda _progress, _cancelled: _is_free(path),
            done=lambda is_free: found() if is_free else None,
            failed=self._on_look_failed,
            shown=False,
        )

    def leave(self) -> None:
        """Give the lock up soon, if there is one, without waiting for the disk."""
        lock, self._lock = self._lock, None
        if lock is not None:
            self._timer.stop()
            self._spare.leave(lock)
            self._give_up_soon()

    def release(self) -> None:
        """Give the lock up now, if there is one."""
        self._timer.stop()
        lock, self._lock = self._lock, None
        give_up(lock)

    def renew(self) -> None:
        """Renew the lock in the background; ``lost`` follows if somebody else has it."""
        lock = self._lock
        if lock is None or self._is_renewing:
            return
        self._is_renewing = True
        self._jobs.start(
            "Renewing the lock",
            lambda _progress, _cancelled: lock.renew(),
            done=lambda is_held: self._on_job_done(lock, is_held),
            failed=self._on_job_failed,
            shown=False,
        )

    def check(self) -> None:
        """Look at once whether the lock is still held; ``lost`` comes before the return if it is not."""
        lock = self._lock
        if lock is None:
            return
        with contextlib.suppress(SaveError):
            # Where it cannot be read, neither can the document be written, which says so better.
            self._settle(lock, lock.is_held())

    def close(self) -> None:
        """Give the lock up and end the background work; call it last."""
        self.release()
        self._spare_timer.stop()
        self._spare.close()
        self._jobs.close()

    def _acquired(self, path: Path, person: str) -> DocumentLock | None:
        try:
            return _acquired(path, person)
        except DocumentLocked as error:
            if not error.holder.is_own:
                raise
            # Claimed here under another name, or by another path.
            self._spare.give_up()
            return _acquired(path, person)

    @Slot()
    def _give_up_soon(self) -> None:
        # Not later for whoever goes from volume to volume without a rest: others wait for those left behind.
        if not self._spare_timer.isActive():
            self._spare_timer.start()

    def _keep(self, lock: DocumentLock | None, person: str) -> None:
        self._lock, self._person = lock, person
        if lock is not None:
            self._timer.start()

    def _settle(self, lock: DocumentLock, is_held: bool) -> None:
        if is_held or lock is not self._lock:
            return
        self._timer.stop()
        self._lock = None
        try:
            # Nobody's: it was deleted by hand, or whoever took it over has closed the document again. Saving
            # will notice if the file has been changed.
            self._keep(self._acquired(lock.path, self._person), self._person)
        except DocumentLocked as error:
            self.lost.emit(error)
        except FolderReadOnly as error:
            # Saving says so.
            _LOG.warning("A lock could not be taken again: %s", error)

    def _on_job_done(self, lock: DocumentLock, is_held: bool) -> None:
        self._is_renewing = False
        self._settle(lock, is_held)

    def _on_spare_timer_timeout(self) -> None:
        self._jobs.start(
            "Giving up locks",
            lambda _progress, _cancelled: self._spare.give_up(),
            done=lambda _: None,
            failed=_raise,
            shown=False,
        )

    def _on_look_failed(self, error: Exception) -> None:
        if not isinstance(error, UserError):
            raise error
        _LOG.info("It could not be read who has a document open: %s", error)

    def _on_job_failed(self, error: Exception) -> None:
        self._is_renewing = False
        if not isinstance(error, UserError):
            raise error
        # The share may come back before the next time.
        _LOG.warning("A lock could not be renewed: %s", error)


def _is_free(path: Path) -> bool:
    holder = holder_of(path)
    return holder is None or holder.is_gone


def _claimed(path: Path, person: str) -> Claim:
    try:
        return _acquired(path, person)
    except (DocumentLocked, FolderReadOnly) as refusal:
        return refusal


def _acquired(path: Path, person: str) -> DocumentLock | None:
    try:
        return DocumentLock.acquire(path, person)
    except DocumentLocked:
        raise
    except SaveError as error:
        if isinstance(error.__cause__, OSError) and error.__cause__.errno in _FORBIDDEN:
            raise FolderReadOnly(path) from error
        # The disk may be full, or the share know no locks: if need be, saving says why.
        _LOG.info("A document is open without a lock: %s", error)
        return None


def _raise(error: Exception) -> None:
    raise error
