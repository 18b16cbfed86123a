"""The session's report on predictions: the errors, the plots, the worst volumes and the verdicts in files."""

from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from annotations.prediction.report.file_names import ReportForm, report_paths
from annotator.session.agreement.agreeing import Agreeing
from annotator.session.agreement.report_writing import ReportWriting
from annotator.session.files.saving import SessionSaving
from annotator.session.predictions.judging import Judging
from annotator.session.predictions.reviewing import Reviewing

if TYPE_CHECKING:
    from annotations.prediction.report.material import ReportMaterial

_NOT_COMPUTED = "Compute the errors first"
_NAMES_VOLUMES = (
    "The report names the volumes, which you are to know by their numbers alone: a reviewer of the study can "
    "export it"
)
_UNDER_WAY = "A report on the errors is being written already"


class Reporting(ReportWriting):
    """Writes the report on the errors that were computed last; signals: see `ReportWriting`."""

    def __init__(
        self,
        session: SessionSaving,
        reviewing: Reviewing,
        judging: Judging,
        agreeing: Agreeing,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(session, parent)
        self._reviewing = reviewing
        self._judging = judging
        self._agreeing = agreeing
        reviewing.changed.connect(self.changed)

    @property
    def refusal(self) -> str:
        """Why nothing can be exported, as a sentence without its full stop; empty where it can."""
        table = self._reviewing.table
        if table is None or not table.rows:
            return self._reviewing.refusal or _NOT_COMPUTED
        # How far a network is off is nobody's work: whoever may see it may have it in files.
        is_to_know_numbers = self._session.is_blind and bool(self._agreeing.export_refusal)
        return self._reviewing.refusal or (_NAMES_VOLUMES if is_to_know_numbers else "")

    def export(self, folder: Path, forms: Collection[ReportForm]) -> None:
        """Write the report into a folder, all of it or nothing; ``exported`` follows."""
        review = self._reviewing.review
        if review is None or self.refusal or self.is_exporting:
            self._session.post_message(self.refusal or _UNDER_WAY)
            return
        judged = zip(review.checkpoints, review.material.checkpoints, strict=True)
        # With the verdicts as they are by now.
        checkpoints = tuple(
            replace(each, verdicts=self._judging.lists.get(checkpoint.sha256, ()))
            for checkpoint, each in judged
            if each.table.rows
        )
        material, source = replace(review.material, checkpoints=checkpoints), review.folder
        self._write(
            "Writing the report on the errors",
            lambda progress, cancelled: _written(material, source, folder, forms, progress, cancelled),
        )


def _written(
    material: "ReportMaterial",
    source: Path,
    folder: Path,
    forms: Collection[ReportForm],
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> tuple[Path, ...]:
    from annotations.prediction.report.exporting import export_errors  # late: few sessions export

    wanted = {form: path for form, path in report_paths(folder).items() if form in forms}
    return export_errors(material, source, wanted, progress=progress, cancelled=cancelled)
