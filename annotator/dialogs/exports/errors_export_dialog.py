"""Which forms of the report on a checkpoint's errors are written, and where."""

from collections.abc import Mapping

from annotations.prediction.report.file_names import REPORT_NAMES, ReportForm
from annotator.dialogs.exports.report_export_dialog import Form, ReportExportDialog, ReportWords

_WORDS = ReportWords(
    "errors_export",
    "Export the errors",
    "Predictions or annotations have changed since these figures were computed.",
)
_EXPLAINED: Mapping[ReportForm, tuple[str, str]] = {
    "html": (
        "&HTML, to read",
        "One file with tables, plots and pictures of the worst volumes, for any browser",
    ),
    "csv": (
        "&CSV, to calculate with",
        "A folder of tidy tables, the verdicts among them, with units in their headings",
    ),
    "json": ("&JSON, for programs", "Every number, unrounded"),
    "text": ("&Text, to paste", "The tables in the layout of the published ones"),
    "latex": ("&LaTeX, for a paper", "The table of targets in the layout of the published ones"),
}
_FORMS = tuple(Form(form, title, REPORT_NAMES[form], words) for form, (title, words) in _EXPLAINED.items())


class ErrorsExportDialog(ReportExportDialog[ReportForm]):
    """Asks for the forms of the report on errors, and for its folder."""

    words = _WORDS
    offered = _FORMS
