"""An agreement into files: the command line and the application write the same ones from here."""

from collections.abc import Callable
from pathlib import Path

from annotations.agreement.report.csv_report import FILES, csv_files
from annotations.agreement.report.html_report import html_bytes
from annotations.agreement.report.json_report import json_bytes
from annotations.agreement.report.labels import methods_of
from annotations.agreement.report.outline import outline
from annotations.agreement.report.pdf_report import pdf_bytes
from annotations.agreement.report.thumbnails import thumbnails
from annotations.agreement.report.written_files import check_places, write_files
from annotations.agreement.results import Agreement
from annotations.errors import Cancelled


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
    check_places((html, csv, json, pdf), csv, FILES)
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
    written = write_files(files, csv, tables)
    progress(1.0)
    return written


def _between(progress: Callable[[float], None], low: float, high: float) -> Callable[[float], None]:
    return lambda share: progress(low + (high - low) * share)


def _part(progress: Callable[[float], None], whole: float, place: int, count: int) -> Callable[[float], None]:
    return _between(progress, whole * place / count, whole * (place + 1) / count)
