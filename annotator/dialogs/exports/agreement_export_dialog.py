"""Which forms of the report on the annotators' agreement are written, and where."""

from collections.abc import Mapping

from annotations.agreement.report.file_names import AGREEMENT_NAMES, AgreementForm
from annotator.dialogs.exports.report_export_dialog import Form, ReportExportDialog, ReportWords

_WORDS = ReportWords(
    "agreement_export",
    "Export the agreement",
    "Annotations have changed since these figures were computed.",
)
_EXPLAINED: Mapping[AgreementForm, tuple[str, str]] = {
    "html": ("&HTML, to read", "One file with tables, plots and definitions, for any browser"),
    "pdf": ("&PDF, to print", "The same on pages"),
    "csv": ("&CSV, to calculate with", "A folder of tidy tables, with units in their headings"),
    "json": ("&JSON, for programs", "Every number, unrounded"),
}
_FORMS = tuple(Form(form, title, AGREEMENT_NAMES[form], words) for form, (title, words) in _EXPLAINED.items())


class AgreementExportDialog(ReportExportDialog[AgreementForm]):
    """Asks for the forms of the report on agreement, and for its folder."""

    words = _WORDS
    offered = _FORMS
