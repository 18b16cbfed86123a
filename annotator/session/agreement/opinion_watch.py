"""Looking, every few seconds, whether the annotators' files of the open volume are those that were read."""

from collections.abc import Iterable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.record import Method
from annotator.session.jobs import Job, Jobs

_EVERY_MS = 3000

FileMarks = frozenset[tuple[Path, int, int]]
"""Files with the time of their last change in ns and their size in bytes: another one is another file."""


def file_marks(paths: Iterable[Path]) -> FileMarks:
    """Return by what a change of files is noticed without reading them; what is gone is not among them."""
    marks = set()
    for path in paths:
        try:
            found = path.stat()
        except OSError:
            continue
        marks.add((path, found.st_mtime_ns, found.st_size))
    return frozenset(marks)


class OpinionWatch(QObject):
    """Watches what a consensus is made from, in the background, for as long as it is open.

    Signals
    -------
    noticed
        A file was added, changed or removed since the marks were taken.
    """

    noticed = Signal()

    def __init__(self, jobs: Jobs, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._jobs = jobs
        self._watched: tuple[Path, str, Method, FileMarks] | None = None
        self._looking: Job | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(_EVERY_MS)
        self._timer.timeout.connect(self.look)

    def watch(self, folder: Path, volume_id: str, method: Method, marks: FileMarks) -> None:
        """Watch the annotators' files of a volume from now on."""
        self._watched = (folder, volume_id, method, marks)
        self._timer.start()

    def stop(self) -> None:
        """Watch nothing any more."""
        self._watched = None
        self._timer.stop()
        if self._looking is not None:
            self._jobs.cancel(self._looking)
            self._looking = None

    def look(self) -> None:
        """Look at once; ``noticed`` follows where anything has changed."""
        if self._watched is None or self._looking is not None:
            return
        watched = self._watched
        self._looking = self._jobs.start(
            "Looking at the annotators' files",
            lambda _progress, _cancelled: opinion_marks(*watched[:3]) != watched[3],
            done=self._on_job_done,
            failed=self._on_job_failed,
            shown=False,
        )

    def _on_job_done(self, is_changed: bool) -> None:
        self._looking = None
        if is_changed:
            self.stop()
            self.noticed.emit()

    def _on_job_failed(self, _error: Exception) -> None:
        # A share that does not answer now: the next look tells.
        self._looking = None


def opinion_marks(folder: Path, volume_id: str, method: Method) -> FileMarks:
    """Return the marks of the annotators' files of a volume."""
    from annotations.agreement.opinions import opinion_paths  # late: few sessions settle

    return file_marks(opinion_paths(folder, volume_id, method))
