"""Looking, every few seconds, whether the annotators' files of the open volume are those that were read."""

import contextlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.record import Method
from annotator.session.jobs import Job, Jobs

_EVERY_MS = 3000

FileMark = tuple[str, int, int]
"""A file with the time of its last change in ns and its size in bytes: another one is another file."""

FileMarks = frozenset[FileMark]


def file_marks(paths: Iterable[Path]) -> FileMarks:
    """Return by what a change of files is noticed without reading them; what is gone is not among them."""
    return frozenset(filter(None, (_mark(str(path), path.stat) for path in paths)))


def folder_marks(folders: Iterable[Path]) -> FileMarks:
    """Return the `file_marks` of all JSON files in some folders: for thousands of them in half the time."""
    marks: set[FileMark | None] = set()
    for folder in folders:
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            marks.update(_mark(entry.path, entry.stat) for entry in entries if entry.name.endswith(".json"))
    return frozenset(filter(None, marks))


def _mark(path: str, look: Callable[[], os.stat_result]) -> FileMark | None:
    try:
        found = look()
    except OSError:
        return None
    return path, found.st_mtime_ns, found.st_size


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
