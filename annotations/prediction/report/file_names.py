"""What the files of a report on errors are called, in a folder of somebody's choice."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

ReportForm = Literal["html", "csv", "json", "text", "latex"]

REPORT_NAMES: Mapping[ReportForm, str] = {
    "html": "errors.html",
    "csv": "errors-csv",
    "json": "errors.json",
    "text": "errors.txt",
    "latex": "errors.tex",
}
"""By form; that of ``csv`` is a folder."""


def report_paths(folder: Path) -> Mapping[ReportForm, Path]:
    """Return where a report in all forms goes in a folder."""
    return {form: folder / name for form, name in REPORT_NAMES.items()}
