"""Which forms of the report on the annotators' agreement are written, and where."""

from datetime import datetime
from pathlib import Path

from PySide6.QtWidgets import QWidget

from annotator.dialogs.report_export_dialog import Form, ReportExportDialog, ReportWords
from annotator.session.agreeing import CSV_NAME, HTML_NAME, JSON_NAME, PDF_NAME, Formats

_WORDS = ReportWords(
    "agreement_export",
    "Export the agreement",
    "Annotations have changed since these figures were computed.",
)
_FORMS = (
    Form("html", "&HTML, to read", HTML_NAME, "One file with tables, plots and definitions, for any browser"),
    Form("pdf", "&PDF, to print", PDF_NAME, "The same on pages"),
    Form("csv", "&CSV, to calculate with", CSV_NAME, "A folder of tidy tables, with units in their headings"),
    Form("json", "&JSON, for programs", JSON_NAME, "Every number, unrounded"),
)


class AgreementExportDialog(ReportExportDialog):
    """Asks for the report's forms and its folder.

    Parameters
    ----------
    folder : Path
        Where the report is offered to be.
    computed_at : datetime or None
        When the figures were computed, where annotations have changed since.
    """

    def __init__(
        self, folder: Path, parent: QWidget | None = None, *, computed_at: datetime | None = None
    ) -> None:
        super().__init__(_WORDS, _FORMS, folder, parent, computed_at=computed_at)

    @property
    def formats(self) -> Formats:
        """What is to be written."""
        return Formats(**self.wanted)
