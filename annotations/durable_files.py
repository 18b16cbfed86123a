"""Files written so that a crash or a full disk leaves either the old or the new content, whole."""

import contextlib
import errno
import logging
import os
import stat
import uuid
from pathlib import Path

from annotations.errors import UserError

_LOG = logging.getLogger(__name__)


class SaveError(UserError):
    """A file could not be written; what stood there before is untouched."""


def replace_durably(path: Path, content: bytes, *, backup: Path | None = None) -> None:
    """Replace a file's content atomically and durably.

    The content goes to a temporary file in the same folder, is synced to the disk, and takes the
    file's name in one step; then the folder is synced, so that the new name survives a power cut.
    A symbolic link stays one: the file that it points to is replaced. An existing file keeps its
    permissions, and one that the user may not write (made read-only, say) is not replaced.

    Parameters
    ----------
    path : Path
        The file to write; its folder is created if absent.
    content : bytes
        The whole new content.
    backup : Path, optional
        Where the previous content is kept, if there was any; in an existing folder.

    Raises
    ------
    SaveError
        The folder or file cannot be written (no permission, full disk); the old file is whole.
    """
    try:
        target = Path(os.path.realpath(path))
        make_folder(target.parent)
        mode = _writable_mode(target)
        with contextlib.ExitStack() as leftovers:
            fresh = _written_beside(target, content, mode, leftovers)
            if backup is not None and mode is not None:
                _written_beside(backup, target.read_bytes(), mode, leftovers).replace(backup)
            fresh.replace(target)
    except OSError as error:
        raise SaveError(
            f"it could not be written ({error.strerror or error})",
            where=path,
            remedy="Nothing is lost: free space or choose a folder that you may write to, and try again",
        ) from error
    sync_folder(target.parent)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, where the operating system can.

    Windows and some network shares cannot. That is no failure: a file replaced there is still whole, old or
    new, whenever the power is cut.
    """
    if os.name == "nt":
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        _LOG.info("the folder %s could not be synced: %s", folder, error)


def make_folder(folder: Path) -> None:
    """Make a folder durably, with those above it that are absent; OSError if that is not possible."""
    absent = [part for part in (folder, *folder.parents) if not part.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for made in reversed(absent):
        sync_folder(made.parent)


def check_writable(folder: Path) -> None:
    """Look whether files can be written into a folder, or, where it is absent, into the one to make it in.

    Raises
    ------
    SaveError
        They cannot: an empty file was tried, and nothing is left of it.
    """
    nearest = next((each for each in (folder, *folder.absolute().parents) if each.exists()), folder)
    tried = nearest / f".{uuid.uuid4().hex}.partial"
    try:
        tried.touch(exist_ok=False)
    except OSError as error:
        raise SaveError(
            f"nothing can be written there ({error.strerror or error})",
            where=nearest,
            remedy="Get permission to write there, or go on with a copy in a folder where you may",
        ) from error
    _delete(tried)


def _writable_mode(path: Path) -> int | None:
    """Return the permissions of a file that may be written, None if there is no file yet."""
    try:
        mode = stat.S_IMODE(path.stat().st_mode)
    except FileNotFoundError:
        return None
    # Replacing a file asks only for permission to write to its folder, but a person who made the file
    # read-only meant to protect it.
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    return mode


def _written_beside(path: Path, content: bytes, mode: int | None, leftovers: contextlib.ExitStack) -> Path:
    """Write a temporary file in a path's folder and sync it; ``leftovers`` deletes what is left of it."""
    # A name of its own: other windows, and other computers on a shared folder, may be saving the same file.
    temporary = path.with_name(f".{uuid.uuid4().hex}.partial")
    leftovers.callback(_delete, temporary)
    with temporary.open("xb") as stream:
        if mode is not None:
            # Some shared folders know no permissions.
            with contextlib.suppress(OSError):
                temporary.chmod(mode)
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    return temporary


def _delete(temporary: Path) -> None:
    with contextlib.suppress(OSError):
        temporary.unlink(missing_ok=True)
