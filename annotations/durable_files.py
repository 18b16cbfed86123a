"""Files written so that a crash or a full disk leaves either the old or the new content, whole."""

import contextlib
import os
from pathlib import Path

from annotations.errors import UserError


class SaveError(UserError):
    """A file could not be written; what stood there before is untouched."""


def replace_durably(path: Path, content: bytes, *, backup: Path | None = None) -> None:
    """Replace a file's content atomically and durably.

    The content goes to a temporary file in the same folder, is synced to the disk, and takes the
    file's name in one step; then the folder is synced, so that the new name survives a power cut.

    Parameters
    ----------
    path : Path
        The file to write; its folder is created if absent.
    content : bytes
        The whole new content.
    backup : Path, optional
        Where the previous content is kept, if there was any.

    Raises
    ------
    SaveError
        The folder or file cannot be written (no permission, full disk); the old file is whole.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _write_synced(temporary, content)
        if backup is not None and path.exists():
            kept = backup.with_name(f".{backup.name}.{os.getpid()}.partial")
            _write_synced(kept, path.read_bytes())
            os.replace(kept, backup)
        os.replace(temporary, path)
        sync_folder(path.parent)
    except OSError as error:
        raise SaveError(
            f"it could not be written ({error.strerror or error})",
            where=path,
            remedy="Nothing was lost: free some space or choose a folder that you may write to, and save again",
        ) from error
    finally:
        # After a failure only; what is left of a temporary file is of no use to anyone.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, where the operating system can (not on Windows)."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _write_synced(path: Path, content: bytes) -> None:
    with path.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
