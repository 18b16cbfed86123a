"""Which volumes of the list the checkpoint in use has predicted."""

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotator.session.jobs import Job
from annotator.session.predicting import Predicting
from annotator.session.state import SessionState
from annotator.session.worklist import WorkItem

Place = tuple[Path, str | None]
"""A volume: its file, and which of the arrays in there."""


class PredictedVolumes(QObject):
    """Looks in the background which files of predictions there are, each time that some may have come.

    Signals
    -------
    changed
        Of some volumes it is another answer.
    """

    changed = Signal()

    def __init__(self, session: SessionState, predicting: Predicting, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting
        self._places: frozenset[Place] = frozenset()
        self._looked_for: tuple[tuple[Path, ...], str] | None = None
        self._looking: Job | None = None
        predicting.checkpoints_changed.connect(self._on_asked_otherwise)
        predicting.predicted.connect(self._look)
        session.worklist_changed.connect(self._on_asked_otherwise)

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
        """Say whether a file tells what the checkpoint in use says of a volume; it may be outdated by now."""
        return (item.volume_path, item.dataset) in self._places

    def _folders(self) -> tuple[Path, ...]:
        worklist = self._session.worklist
        if worklist.study is not None:
            return (worklist.folder,)
        return tuple(sorted({item.volume_path.parent for item in worklist.items}))

    def _wanted(self) -> tuple[tuple[Path, ...], str] | None:
        checkpoint = self._predicting.current
        return None if checkpoint is None else (self._folders(), checkpoint.sha256)

    def _look(self) -> None:
        from annotations.prediction.prediction_file import predicted_volumes  # late: few sessions predict

        if self._looking is not None:
            self._session.jobs.cancel(self._looking)
            self._looking = None
        self._looked_for = self._wanted()
        checkpoint, folders, items = self._predicting.current, self._folders(), self._session.items
        if checkpoint is None:
            self._take(frozenset())
            return
        name, sha256 = checkpoint.description.name, checkpoint.sha256

        def work(_progress: object, _cancelled: object) -> frozenset[Place]:
            kept = {place for folder in folders for place in predicted_volumes(folder, name, sha256)}
            # Whoever opens a file with one array need not say which.
            kept |= {(path, None) for path, _ in kept}
            return frozenset(
                (item.volume_path, item.dataset)
                for item in items
                if (item.volume_path.resolve(), item.dataset) in kept
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
        # A share that does not answer now: whoever opens a volume will hear of it.
        self._looking = None

    def _on_asked_otherwise(self) -> None:
        if self._wanted() != self._looked_for:
            self._look()
