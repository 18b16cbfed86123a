"""Locks that no open document has: of the one to come, taken ahead, and of the one before, to be given up."""

import contextlib
import logging
import threading
from pathlib import Path

from annotations.documents.locks import DocumentLock, DocumentLocked
from annotations.durable_files import SaveError

_LOG = logging.getLogger(__name__)


class FolderReadOnly(SaveError):  # noqa: N818 - named for what is the case
    """Nothing can be written beside a document."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            "this folder cannot be written", where=path.parent, remedy="Choose one that you may write to"
        )


Claim = DocumentLock | DocumentLocked | FolderReadOnly | None
"""What came of asking for a lock; None where a document must do without one."""


class SpareLocks:
    """What was claimed for no open document, from whatever thread, and what one has left.

    To look after a lock takes a few milliseconds, and on a network share that does not answer ten seconds: so
    the window leaves it to the threads that read and write.
    """

    def __init__(self) -> None:
        self._mutex = threading.Lock()
        self._claims: dict[tuple[Path, str], Claim] = {}
        self._left: list[DocumentLock] = []
        self._is_closed = False

    def __contains__(self, asked: tuple[Path, str]) -> bool:
        with self._mutex:
            return asked in self._claims

    def put(self, path: Path, person: str, claim: Claim) -> None:
        """Keep what came of a person's asking for a document's lock, until it is taken or given up."""
        with self._mutex:
            if not self._is_closed:
                # Of two who asked at once, the one that has it.
                kept, other = self._claims.get((path, person)), claim
                if not isinstance(kept, DocumentLock):
                    self._claims[path, person], other = claim, kept
                if isinstance(other, DocumentLock):
                    other.disown()
                    self._left.append(other)
                return
        give_up(claim)

    def take(self, path: Path, person: str) -> tuple[Claim] | None:
        """Return, in a tuple, what came of a person's asking for a document's lock; None if nobody asked."""
        with self._mutex:
            return (self._claims.pop((path, person)),) if (path, person) in self._claims else None

    def leave(self, lock: DocumentLock) -> None:
        """Take over the lock of a document that is open no more; without waiting for the disk."""
        # Whoever asks for it from now on in this process gets another one.
        lock.disown()
        with self._mutex:
            self._left.append(lock)

    def give_up(self) -> None:
        """Give up what was left, and what nobody has taken; may wait for the disk."""
        with self._mutex:
            spare = [*self._left, *self._claims.values()]
            self._left.clear()
            self._claims.clear()
            for claim in spare:
                if isinstance(claim, DocumentLock):
                    claim.disown()
        with contextlib.ExitStack() as each:
            # One after the other, whatever happens to any of them.
            for claim in spare:
                each.callback(give_up, claim)

    def close(self) -> None:
        """Give all up, and whatever comes yet."""
        with self._mutex:
            self._is_closed = True
        self.give_up()


def give_up(claim: Claim) -> None:
    """Give a lock up, if it is one; what stands against it is logged."""
    if isinstance(claim, DocumentLock):
        try:
            claim.release()
        except SaveError as error:
            # It is passed over once this process is gone.
            _LOG.warning("A lock could not be given up: %s", error)
