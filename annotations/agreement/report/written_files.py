"""Files that belong together, written so that whatever fails, what is there is whole, old or new."""

import os
import shutil
import tempfile
import uuid
from collections.abc import Container, Iterable, Mapping
from pathlib import Path

from annotations.durable_files import SaveError, replace_durably, sync_folder

_TRY_AGAIN = "Nothing is lost: free space or choose a folder that you may write to, and try again"


def check_places(paths: Iterable[Path | None], folder: Path | None, known: Container[str]) -> None:
    """Refuse places in which nothing can be written, before half a minute is spent on pictures.

    Parameters
    ----------
    paths : iterable of Path or None
        Of all files and the folder; None for one that nobody wants.
    folder : Path or None
        It is replaced as a whole.
    known : container of str
        Names of files that may be in it: those of an earlier export.

    Raises
    ------
    SaveError
        Nothing can be written in a place, or the folder holds anything else.
    """
    for path in paths:
        if path is not None:
            _check_writable(path)
    if folder is not None:
        _check_replaceable(folder, known)


def write_files(
    files: Mapping[Path, bytes], folder: Path | None, in_folder: Mapping[str, bytes]
) -> tuple[Path, ...]:
    """Write files, and a folder of files as a whole; each takes its place in one step.

    Parameters
    ----------
    files : mapping of Path to bytes
    folder : Path or None
        Absent, or one that `check_places` has let pass.
    in_folder : mapping of str to bytes
        What it holds, by the files' names.

    Returns
    -------
    tuple of Path
        What was written.

    Raises
    ------
    SaveError
        A file could not be written; what stood there before is untouched.
    """
    if folder is not None:
        _replace_folder(folder, in_folder)
    for path, content in files.items():
        replace_durably(path, content)
    return (*(() if folder is None else (folder,)), *files)


def _check_writable(path: Path) -> None:
    above = next(each for each in path.absolute().parents if each.exists())
    try:
        with tempfile.TemporaryFile(dir=above):
            pass
    except OSError as error:
        raise _not_written(path, error) from error


def _check_replaceable(folder: Path, known: Container[str]) -> None:
    try:
        strangers = sorted(entry.name for entry in folder.iterdir() if entry.name not in known)
    except FileNotFoundError:
        return
    except NotADirectoryError:
        raise SaveError(
            "it is a file, and the CSV files go into a folder",
            where=folder,
            remedy="Choose another name for the folder",
        ) from None
    except OSError as error:
        raise _not_written(folder, error) from error
    if strangers:
        raise SaveError(
            f"the folder holds other things too, such as {strangers[0]!r}, and it is replaced as a whole",
            where=folder,
            remedy="Choose an empty folder, or one that is not there yet",
        )


def _replace_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put files into a folder: all of them appear at once, in place of those that were there."""
    target = Path(os.path.realpath(folder))
    # Names of their own, hidden, beside the folder: moving is then one step.
    fresh, old = (target.with_name(f".{uuid.uuid4().hex}.{kind}") for kind in ("partial", "old"))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        fresh.mkdir()
        for name, content in files.items():
            replace_durably(fresh / name, content)
        _take_place(fresh, target, old)
    except SaveError as error:
        raise SaveError(error.problem, where=folder, remedy=error.remedy) from error
    except OSError as error:
        raise _not_written(folder, error) from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    # Only now: until the new folder has its place the old one is not thrown away.
    shutil.rmtree(old, ignore_errors=True)
    sync_folder(target.parent)


def _take_place(fresh: Path, target: Path, old: Path) -> None:
    """Give a folder the name of another, which becomes ``old``; whatever fails, one of them has the name."""
    try:
        target.rename(old)
    except FileNotFoundError:
        fresh.rename(target)
        return
    try:
        fresh.rename(target)
    except OSError:
        old.rename(target)
        raise


def _not_written(path: Path, error: OSError) -> SaveError:
    return SaveError(f"it could not be written ({error.strerror or error})", where=path, remedy=_TRY_AGAIN)
