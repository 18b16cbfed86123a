"""The session's export for training: the targets of the open study in one file."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents.permission import check_may_see_all
from annotations.documents.study import Study
from annotations.errors import UserError
from annotator.session.agreement.agreeing import Agreeing
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import Job

if TYPE_CHECKING:
    from annotations.interchange.training_file import Exported, ExportOptions

_NO_STUDY = "Training files are made of a study: open one"
_REVIEWERS = "Training files of this study are exported by its reviewers"
_UNDER_WAY = "A training file is being written already"
_UNFINISHED = "the file would show what the others found in volumes that are not done by you"


class Exporting(QObject):
    """Writes training files in the background, for those who may see everybody's work.

    Signals
    -------
    exported : Exported
        A file is written, and this is what is in it and what is not.
    failed : UserError
        None is.
    ended
        ``is_exporting`` is false again, whatever became of it.
    """

    exported = Signal(object)
    failed = Signal(object)
    ended = Signal()

    def __init__(self, session: SessionSaving, agreeing: Agreeing, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._agreeing = agreeing
        self._job: Job | None = None

    @property
    def refusal(self) -> str:
        """Why the person may not export, as a sentence without its full stop; empty where they may."""
        study = self._session.worklist.study
        if study is None:
            return _NO_STUDY
        return self._agreeing.refusal if study.is_reviewer(self._session.person) else _REVIEWERS

    @property
    def is_exporting(self) -> bool:
        """Whether a file is being written."""
        return self._job is not None

    def export(self, output: Path, options: "ExportOptions") -> None:
        """Write a training file, after what is open has been saved; ``exported`` or ``failed`` follows."""
        study, folder, person = (
            self._session.worklist.study,
            self._session.worklist.folder,
            self._session.person,
        )
        reason = self.refusal or (_UNDER_WAY if self.is_exporting else "")
        if study is None or reason:
            self._session.post_message(reason)
            return
        if self._session.unsaved and not self._session.save():
            return
        self._job = self._session.jobs.start(
            "Exporting for training",
            lambda progress, cancelled: _written(study, folder, person, output, options, progress, cancelled),
            done=self._on_job_done,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            writes=True,
        )

    def cancel(self) -> None:
        """Give up what is being written: no file is left of it, unless it is written by now."""
        if self._job is not None:
            self._session.jobs.cancel(self._job)

    def _end(self) -> None:
        self._job = None
        self.ended.emit()

    def _on_job_done(self, exported: "Exported") -> None:
        self._end()
        self.exported.emit(exported)

    def _on_job_failed(self, error: Exception) -> None:
        self._end()
        if not isinstance(error, UserError):
            raise error
        self.failed.emit(error)

    def _on_job_cancelled(self) -> None:
        self._end()
        self._session.post_message("Cancelled: nothing was written")


def _written(
    study: Study,
    folder: Path,
    person: str,
    output: Path,
    options: "ExportOptions",
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> "Exported":
    from annotations.interchange.training_file import export_targets  # late: few sessions export

    # The open list tells of one method alone.
    check_may_see_all(study, folder, person, _UNFINISHED, cancelled)
    return export_targets(folder, output, options, progress, cancelled)
