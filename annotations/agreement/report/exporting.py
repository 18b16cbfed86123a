"""An agreement into files: the command line and the application write the same ones from here."""

import os
import shutil
import tempfile
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

from annotations.agreement.report.csv_report import FILES, csv_files
from annotations.agreement.report.html_report import html_bytes
from annotations.agreement.report.json_report import json_bytes
from annotations.agreement.report.labels import methods_of
from annotations.agreement.report.outline import outline
from annotations.agreement.report.pdf_report import pdf_bytes
from annotations.agreement.report.thumbnails import thumbnails
from annotations.agreement.results import Agreement
from annotations.durable_files import SaveError, replace_durably, sync_folder
from annotations.errors import Cancelled

_TRY_AGAIN = "Nothing is lost: free space or choose a folder that you may write to, and try again"


def export(
    agreement: Agreement,
    folder: Path,
    *,
    html: Path | None = None,
    csv: Path | None = None,
    json: Path | None = None,
    pdf: Path | None = None,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[Path, ...]:
    """Write an agreement in the wished formats.

    Everything is made in memory before the first file is written. Each file, and the folder of CSV files as
    a whole, then takes its place in one step: whatever fails or is killed, what is there is whole, old or
    new.

    Parameters
    ----------
    agreement : Agreement
    folder : Path
        What was compared; paths in ``agreement.inputs`` are relative to it, and annotations and volumes are
        read from it for the pictures of the worst volumes.
    html, json, pdf : Path, optional
        The file of each.
    csv : Path, optional
        A folder: absent, empty, or one of an earlier export.
    progress : callable
        Told the share of the work that is done, from 0 to 1.
    cancelled : callable
        Asked again and again while pictures are made, and before the first file is written.

    Returns
    -------
    tuple of Path
        What was written.

    Raises
    ------
    Cancelled
        `cancelled` returned true; nothing was written.
    SaveError
        A file could not be written; what stood there before is untouched.
    """
    for path in (html, csv, json, pdf):
        if path is not None:
            _check_writable(path)
    if csv is not None:
        _check_replaceable(csv)
    files: dict[Path, bytes] = {}
    if html is not None or pdf is not None:
        methods = methods_of(agreement)
        pictures = {
            method: thumbnails(
                agreement, method, folder, _part(progress, 0.4, place, len(methods)), cancelled
            )
            for place, method in enumerate(methods)
        }
        contents = outline(agreement, pictures)
        if html is not None:
            files[html] = html_bytes(contents, _between(progress, 0.4, 0.7), cancelled)
        if pdf is not None:
            files[pdf] = pdf_bytes(contents, _between(progress, 0.7, 0.95), cancelled)
    if json is not None:
        files[json] = json_bytes(agreement)
    tables = {} if csv is None else csv_files(agreement)
    if cancelled():
        raise Cancelled
    progress(0.95)
    if csv is not None:
        _replace_folder(csv, tables)
    for path, content in files.items():
        replace_durably(path, content)
    progress(1.0)
    return (*(() if csv is None else (csv,)), *files)


def _between(progress: Callable[[float], None], low: float, high: float) -> Callable[[float], None]:
    return lambda share: progress(low + (high - low) * share)


def _part(progress: Callable[[float], None], whole: float, place: int, count: int) -> Callable[[float], None]:
    return _between(progress, whole * place / count, whole * (place + 1) / count)


def _check_writable(path: Path) -> None:
    """Refuse a place in which nothing can be written, before half a minute is spent on pictures."""
    above = next(each for each in path.absolute().parents if each.exists())
    try:
        with tempfile.TemporaryFile(dir=above):
            pass
    except OSError as error:
        raise _not_written(path, error) from error


def _check_replaceable(folder: Path) -> None:
    """Refuse a folder that holds anything that is no earlier export: it is replaced as a whole."""
    try:
        strangers = sorted(entry.name for entry in folder.iterdir() if entry.name not in FILES)
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
