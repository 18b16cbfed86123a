"""Looks for likely mistakes in the background, a moment after each edit."""

from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.annotation import Annotation
from annotations.fitting.mistakes import Mistake, likely_mistakes
from annotations.geometry.tool import ToolSpecification
from annotator.session.jobs import Job, Jobs

# Several edits in a row, such as nudges by a held key, are looked at once.
_PAUSE_MS = 120


class MistakeSearch(QObject):
    """Keeps what was found in the last document that was looked at.

    Signals
    -------
    found
        A search has ended, and ``mistakes`` is what it found.
    failed : Exception
    """

    found = Signal()
    failed = Signal(object)

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._job: Job | None = None
        self._mistakes: tuple[Mistake, ...] = ()
        self._looked_at: Annotation | None = None
        self._wanted: tuple[Annotation, ToolSpecification, bool] | None = None
        self._pause = QTimer(self)
        self._pause.setSingleShot(True)
        self._pause.setInterval(_PAUSE_MS)
        self._pause.timeout.connect(self._on_pause_timeout)

    @property
    def mistakes(self) -> tuple[Mistake, ...]:
        """What was found last."""
        return self._mistakes

    @property
    def looked_at(self) -> Annotation | None:
        """The document in which that was found."""
        return self._looked_at

    @property
    def is_running(self) -> bool:
        """Whether a search waits or runs."""
        return self._wanted is not None

    def search(
        self, document: Annotation, tool: ToolSpecification, *, every_relabelling: bool = False
    ) -> None:
        """Look at a document; what is being looked at is dropped."""
        self._cancel()
        self._wanted = (document, tool, every_relabelling)
        self._pause.start()

    def clear(self) -> None:
        """Forget what was found: another volume is open, or none."""
        self._cancel()
        self._take((), None)

    def _cancel(self) -> None:
        self._pause.stop()
        self._wanted = None
        if self._job is not None:
            self._jobs.cancel(self._job)
        self._job = None

    def _take(self, mistakes: tuple[Mistake, ...], document: Annotation | None) -> None:
        self._job = self._wanted = None
        self._mistakes, self._looked_at = mistakes, document
        self.found.emit()

    def _on_pause_timeout(self) -> None:
        if self._wanted is None:
            return
        document, tool, thorough = self._wanted
        self._job = self._jobs.start(
            "Trying every order of the keypoints" if thorough else "Checking the keypoints",
            lambda _progress, cancelled: likely_mistakes(
                document, tool, every_relabelling=thorough, cancelled=cancelled
            ),
            done=lambda mistakes: self._take(mistakes, document),
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            shown=thorough,
        )

    def _on_job_failed(self, error: Exception) -> None:
        self._job = self._wanted = None
        self.failed.emit(error)

    def _on_job_cancelled(self) -> None:
        # By a person: where another search takes the place of one, that is no end.
        if self._job is not None and self._job.state == "cancelled":
            self._job = self._wanted = None
