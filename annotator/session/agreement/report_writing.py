"""Writing a report in the background, whatever it is about: all of it or nothing."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.errors import UserError
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import Job

Write = Callable[[Callable[[float], None], Callable[[], bool]], tuple[Path, ...]]
"""Takes what is told the share that is done, and what says whether to stop; returns what was written."""


class ReportWriting(QObject):
    """Writes one report at a time.

    Signals
    -------
    changed
        ``is_exporting`` or what may be exported may have changed.
    exported : tuple of Path
        A report is written, all of it.
    """

    changed = Signal()
    exported = Signal(object)

    def __init__(self, session: SessionSaving, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._job: Job | None = None

    @property
    def is_exporting(self) -> bool:
        """Whether a report is being written."""
        return self._job is not None

    def _write(self, title: str, write: Write) -> None:
        self._job = self._session.jobs.start(
            title,
            write,
            done=self._on_job_done,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            writes=True,
        )
        self.changed.emit()

    def _end(self) -> None:
        self._job = None
        self.changed.emit()

    def _on_job_done(self, paths: tuple[Path, ...]) -> None:
        self._end()
        names = ", ".join(path.name for path in paths)
        self._session.post_message(f"The report is in {paths[0].parent}: {names}")
        self.exported.emit(paths)

    def _on_job_failed(self, error: Exception) -> None:
        self._end()
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_job_cancelled(self) -> None:
        self._end()
        self._session.post_message("Cancelled: nothing was written")
