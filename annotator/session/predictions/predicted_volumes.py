"""Which volumes of the list the checkpoint in use has predicted."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from annotator.session.editing.seeing import Seeing
from annotator.session.jobs import Job
from annotator.session.predictions.predicting import Predicting
from annotator.session.remembered import Remembered
from annotator.session.state import SessionState
from annotator.session.volumes.worklist import WorkItem

# A list comes with a volume, whose pictures a thread that looks for files would hold up.
_PICTURES_FIRST_MS = 150

Place = tuple[Path, str | None, int]
"""A pass over a volume: its file, which of the arrays in there, and which pass."""


@dataclass(frozen=True)
class _Wanted:
    """What is looked for: of which checkpoint, in which folders, and for which passes."""

    sha256: str
    folders: tuple[Path, ...]
    places: frozenset[Place]


class PredictedVolumes(QObject):
    """Looks in the background which files of predictions there are, each time that some may have come.

    Signals
    -------
    changed
        Of some volumes it is another answer.
    """

    changed = Signal()

    def __init__(
        self, session: SessionState, predicting: Predicting, seeing: Seeing, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting
        self._places: frozenset[Place] = frozenset()
        self._looked_for: _Wanted | None = None
        self._looking: Job | None = None
        self._remembered_places = Remembered[frozenset[Place]]()
        self._remembered_folders = Remembered[tuple[Path, ...]]()
        predicting.checkpoints_changed.connect(self._on_asked_otherwise)
        predicting.predicted.connect(self._look)
        seeing.permission_changed.connect(self._on_asked_otherwise)
        self._soon = QTimer(self, singleShot=True, interval=_PICTURES_FIRST_MS)
        self._soon.timeout.connect(self._on_asked_otherwise)
        session.worklist_changed.connect(self._on_session_worklist_changed)

    @property
    def checkpoint_name(self) -> str:
        """What has predicted them; empty where no checkpoint is loaded."""
        current = self._predicting.current
        return "" if current is None else current.description.name

    @property
    def is_any(self) -> bool:
        """Whether any volume of the list is among them."""
        return bool(self._places)

    def has(self, item: WorkItem) -> bool:
        """Say whether a file tells what the checkpoint in use says of a volume; it may be outdated by now.

        In blind work it tells that only of a pass that was asked about: see `Passes`.
        """
        return item.place in self._places

    def _folders(self) -> tuple[Path, ...]:
        worklist = self._session.worklist
        if worklist.study is not None:
            return (worklist.folder,)
        return self._remembered_folders.result(_folders_of, worklist.items)

    def _wanted(self) -> "_Wanted | None":
        checkpoint = self._predicting.current
        if checkpoint is None:
            return None
        # Asked about with each step from volume to volume, while the list stays the same one.
        counting = self._predicting.counting(self._session.items)
        places = self._remembered_places.result(_places_of, counting)
        return _Wanted(checkpoint.sha256, self._folders(), places)

    def _look(self) -> None:
        from annotations.prediction.prediction_file import predicted_volumes  # late: few sessions predict

        if self._looking is not None:
            self._session.jobs.cancel(self._looking)
            self._looking = None
        before, wanted = self._looked_for, self._wanted()
        self._looked_for = wanted
        checkpoint = self._predicting.current
        if checkpoint is None or wanted is None:
            self._take(frozenset())
            return
        if before is not None and before.sha256 != wanted.sha256:
            # What another one has predicted is no answer, not even for a while.
            self._take(frozenset())
        name = checkpoint.description.name

        def work(_progress: object, _cancelled: object) -> frozenset[Place]:
            kept: set[tuple[Path, str | None]] = {
                place for folder in wanted.folders for place in predicted_volumes(folder, name, wanted.sha256)
            }
            # Whoever opens a file with one array need not say which.
            kept |= {(path, None) for path, _ in kept}
            return frozenset(
                (path, dataset, repeat)
                for path, dataset, repeat in wanted.places
                if (path.resolve(), dataset) in kept
            )

        self._looking = self._session.jobs.start(
            "Looking for predictions", work, done=self._on_job_looked, failed=self._on_job_failed, shown=False
        )

    def _take(self, places: frozenset[Place]) -> None:
        if places != self._places:
            self._places = places
            self.changed.emit()

    def _on_job_looked(self, places: frozenset[Place]) -> None:
        self._looking = None
        self._take(places)

    def _on_job_failed(self, _error: Exception) -> None:
        # A share that does not answer now: whoever opens a volume will hear of it. It is asked again with the
        # next change.
        self._looking = self._looked_for = None

    def _on_session_worklist_changed(self) -> None:
        if not self._soon.isActive():
            self._soon.start()

    def _on_asked_otherwise(self) -> None:
        if self._wanted() != self._looked_for:
            self._look()


def _folders_of(items: Sequence[WorkItem]) -> tuple[Path, ...]:
    return tuple(sorted({item.volume_path.parent for item in items}))


def _places_of(items: Sequence[WorkItem]) -> frozenset[Place]:
    return frozenset(item.place for item in items)
