"""The errors of checkpoints into files: the same from the command line and the application."""

from collections.abc import Callable, Sequence
from pathlib import Path

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.html_report import html_bytes
from annotations.agreement.report.written_files import check_places, write_files
from annotations.errors import Cancelled
from annotations.prediction.report.csv_report import FILES, csv_files
from annotations.prediction.report.json_report import json_bytes
from annotations.prediction.report.material import ReportMaterial
from annotations.prediction.report.outline import outline
from annotations.prediction.report.text_report import latex_of, text_of
from annotations.prediction.report.thumbnails import thumbnails

_PICTURES_SHARE, _HTML_SHARE = 0.5, 0.95


def export_errors(
    material: ReportMaterial,
    folder: Path | None,
    *,
    html: Path | None = None,
    csv: Path | None = None,
    json: Path | None = None,
    text: Path | None = None,
    latex: Path | None = None,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[Path, ...]:
    """Write the errors of checkpoints in the wished formats.

    Everything is made in memory before the first file is written. Each file, and the folder of CSV files as
    a whole, then takes its place in one step: whatever fails or is killed, what is there is whole, old or
    new.

    Parameters
    ----------
    material : ReportMaterial
        Of at least one checkpoint.
    folder : Path or None
        The study's: annotations and volumes are read from it for the pictures of the worst volumes; None
        where there is none, so that there are no such pictures.
    html, json, text, latex : Path, optional
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
    UserError
        The study cannot be read.
    Cancelled
        `cancelled` returned true; nothing was written.
    SaveError
        A file could not be written; what stood there before is untouched.
    """
    check_places((html, csv, json, text, latex), csv, FILES)
    files: dict[Path, bytes] = {}
    if html is not None:
        pictures: Sequence[Sequence[Photo]] = ()
        if folder is not None:
            pictures = thumbnails(
                material, folder, lambda share: progress(_PICTURES_SHARE * share), cancelled
            )
        files[html] = html_bytes(
            outline(material, pictures),
            lambda share: progress(_PICTURES_SHARE + (_HTML_SHARE - _PICTURES_SHARE) * share),
            cancelled,
        )
    if json is not None:
        files[json] = json_bytes(material)
    if text is not None:
        files[text] = text_of(material).encode("utf-8", "backslashreplace")
    if latex is not None:
        files[latex] = latex_of(material).encode("utf-8", "backslashreplace")
    tables = {} if csv is None else csv_files(material)
    if cancelled():
        raise Cancelled
    progress(_HTML_SHARE)
    written = write_files(files, csv, tables)
    progress(1.0)
    return written
