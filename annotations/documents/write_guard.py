"""A folder's files changed by one program at a time, so that what was looked at is what is replaced."""

import contextlib
import logging
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from filelock import FileLock, Timeout

from annotations.durable_files import SaveError, make_folder

GUARD_NAME = ".writing.lock"
"""An empty file that says nothing; the lock on it is the operating system's, and goes with its process."""

# Writing a document takes milliseconds: who waits so long waits for a program that hangs.
_PATIENCE_S = 10.0
_LOG = logging.getLogger(__name__)


@contextlib.contextmanager
def writing_beside(path: Path, *, tidied: Sequence[Path] = ()) -> Iterator[None]:
    """Look at a file and change it, or those beside it, while no other program does; not to be nested.

    The file's folder is created if absent. A program that dies lets go at once. Where the share knows no
    locks, or the folder cannot be written, the work is done all the same: each file is still replaced as a
    whole, and two programs could only be at odds within the same milliseconds.

    Parameters
    ----------
    tidied : sequence of Path
        Folders, the innermost first, that are removed in the end if nothing is left in them.

    Raises
    ------
    SaveError
        Another program has not let go of the folder for ten seconds.
    """
    folder = Path(os.path.realpath(path)).parent
    guard = FileLock(folder / GUARD_NAME, thread_local=False)
    try:
        _acquire(guard, folder)
    except Timeout as error:
        raise SaveError(
            f"another program has been writing in its folder for {_PATIENCE_S:.0f} seconds",
            where=path,
            remedy="Try again; if nobody else is writing there, restart the program that hangs",
        ) from error
    except (OSError, NotImplementedError) as error:
        _LOG.info("the folder %s is written without a guard: %s", folder, error)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            if folder in tidied and [each.name for each in folder.iterdir()] == [GUARD_NAME]:
                # Whoever waits for it notices that it is gone, and makes another one.
                (folder / GUARD_NAME).unlink()
        guard.release()
        with contextlib.suppress(OSError):
            for each in tidied:
                each.rmdir()


def _acquire(guard: FileLock, folder: Path) -> None:
    try:
        make_folder(folder)
        guard.acquire(timeout=_PATIENCE_S, poll_interval=0.01)
    except FileNotFoundError:
        # Whoever had nothing to keep there has just tidied the folder away.
        make_folder(folder)
        guard.acquire(timeout=_PATIENCE_S, poll_interval=0.01)
