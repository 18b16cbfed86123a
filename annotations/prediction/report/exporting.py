"""The errors of checkpoints into files: the same from the command line and the application."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from annotations.agreement.report.contents import Photo
from annotations.agreement.report.html_report import html_bytes
from annotations.agreement.report.written_files import check_places, write_files
from annotations.errors import Cancelled
from annotations.prediction.report.csv_report import FILES, csv_files
from annotations.prediction.report.file_names import ReportForm
from annotations.prediction.report.json_report import json_bytes
from annotations.prediction.report.material import ReportMaterial
from annotations.prediction.report.outline import outline
from annotations.prediction.report.text_report import latex_of, text_of
from annotations.prediction.report.thumbnails import thumbnails

_PICTURES_SHARE, _HTML_SHARE = 0.5, 0.95


def export_errors(
    material: ReportMaterial,
    folder: Path | None,
    places: Mapping[ReportForm, Path],
    *,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[Path, ...]:
    """Write the errors of checkpoints in the wished formats.

    As in `annotations.agreement.report.exporting.export`, everything is made before the first file is
    written.

    Parameters
    ----------
    material : ReportMaterial
        Of at least one checkpoint.
    folder : Path or None
        The study's: annotations and volumes are read from it for the pictures of the worst volumes; None
        where there is none, so that there are no such pictures.
    places : mapping of str to Path
        The wished forms, and the file of each, as by `report_paths`; of ``csv`` a folder: absent, empty, or
        one of an earlier export.
    progress, cancelled : callable
        As there.

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
    check_report_places(places)
    contents: dict[Path, bytes] = {}
    for form, place in places.items():
        if form == "html":
            contents[place] = _html(material, folder, progress, cancelled)
        elif form != "csv":
            contents[place] = _PLAIN[form](material)
    csv = places.get("csv")
    tables = {} if csv is None else csv_files(material)
    if cancelled():
        raise Cancelled
    progress(_HTML_SHARE)
    written = write_files(contents, csv, tables)
    progress(1.0)
    return written


def check_report_places(places: Mapping[ReportForm, Path]) -> None:
    """Refuse places in which a report cannot be written, before anything takes long; SaveError."""
    check_places(places.values(), places.get("csv"), FILES)


def _html(
    material: ReportMaterial,
    folder: Path | None,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> bytes:
    pictures: Sequence[Sequence[Photo]] = ()
    if folder is not None:
        pictures = thumbnails(material, folder, lambda share: progress(_PICTURES_SHARE * share), cancelled)
    return html_bytes(
        outline(material, pictures),
        lambda share: progress(_PICTURES_SHARE + (_HTML_SHARE - _PICTURES_SHARE) * share),
        cancelled,
    )


_PLAIN: Mapping[ReportForm, Callable[[ReportMaterial], bytes]] = {
    "json": json_bytes,
    "text": lambda material: text_of(material).encode("utf-8", "backslashreplace"),
    "latex": lambda material: latex_of(material).encode("utf-8", "backslashreplace"),
}
