"""The session's report on the annotators' agreement, in files."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from annotations.agreement.report.file_names import AGREEMENT_NAMES, AgreementForm
from annotator.session.agreement.agreeing import Agreeing
from annotator.session.agreement.report_writing import ReportWriting
from annotator.session.files.saving import SessionSaving

if TYPE_CHECKING:
    from annotations.agreement.results import Agreement


class AgreementReporting(ReportWriting):
    """Writes the report on what was compared last; signals: see `ReportWriting`."""

    def __init__(self, session: SessionSaving, agreeing: Agreeing, parent: QObject | None = None) -> None:
        super().__init__(session, parent)
        self._agreeing = agreeing

    def export(self, folder: Path, forms: Collection[AgreementForm]) -> None:
        """Write the report of the result into a folder, all of it or nothing; ``exported`` follows."""
        result, source = self._agreeing.result, self._agreeing.folder
        if result is None or source is None or self.is_exporting:
            return
        if self._agreeing.export_refusal:
            self._session.post_message(self._agreeing.export_refusal)
            return
        self._write(
            "Writing the report",
            lambda progress, cancelled: _written(result, source, folder, forms, progress, cancelled),
        )


def _written(
    result: "Agreement",
    source: Path,
    folder: Path,
    forms: Collection[AgreementForm],
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> tuple[Path, ...]:
    from annotations.agreement.report.exporting import export  # late: few sessions export

    places = {form: folder / AGREEMENT_NAMES[form] for form in forms}
    return export(
        result,
        source,
        html=places.get("html"),
        csv=places.get("csv"),
        json=places.get("json"),
        pdf=places.get("pdf"),
        progress=progress,
        cancelled=cancelled,
    )
