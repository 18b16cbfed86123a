"""The session's predictions: the checkpoints that are loaded, and what they say of volumes."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, Signal

from annotations.documents import edits
from annotations.documents.annotation import Annotation
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.prediction.shipped import shipped_checkpoint
from annotator.session.editing.seeing import Seeing
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import Job
from annotator.session.predictions.checkpoint_fit import tool_differences, tool_unfitness, volume_unfitness
from annotator.session.predictions.networks import Networks
from annotator.session.predictions.passes import Passes
from annotator.session.predictions.predicted import ShownPrediction
from annotator.session.predictions.prediction_overlay import PredictionOverlay
from annotator.session.predictions.prediction_run import (
    KnownSpacing,
    PredictionOutcome,
    PredictionTask,
    failure_of,
    predict_all,
)
from annotator.session.remembered import Remembered
from annotator.session.volumes.opening import OpeningRequest
from annotator.session.volumes.worklist import WorkItem

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.errors.study_errors import Truth
    from annotations.prediction.prediction import Prediction

Edit = Callable[[str, Callable[[Annotation], Annotation]], bool]

_NO_CHECKPOINT = "Load a checkpoint first: Predictions ▸ Load Checkpoint…"
_NO_VOLUME = "No volume is selected in the list"
_UNDER_WAY = "Volumes are being predicted already"
_NO_PREDICTION = "There is no prediction of this volume to start from"
_NOTHING_TO_START = "Nothing was placed: every keypoint that {} has found is placed already, or locked"
_NOTHING_TO_ACCEPT = "No keypoint is where a checkpoint has put it"


class Predicting(QObject):
    """Holds checkpoints, lets the one in use predict in the background, and shows what it says.

    Parameters
    ----------
    edit : callable
        Makes one edit of the open document that can be undone; False where it was refused.
    known_spacing : callable
        See `KnownSpacing`.

    Signals
    -------
    checkpoints_changed
        ``checkpoints`` or ``current`` changed.
    truth_changed
        ``truth`` changed.
    predicted
        Prediction files of ``current`` were written: those that a study or folder keeps have changed.
    running_changed
        ``is_predicting`` changed.
    shown_changed
        ``prediction``, ``shown`` or ``reason`` changed.
    """

    checkpoints_changed = Signal()
    truth_changed = Signal()
    predicted = Signal()
    running_changed = Signal()
    shown_changed = Signal()
    _advanced = Signal(int, str)

    def __init__(
        self,
        session: SessionSaving,
        seeing: Seeing,
        edit: Edit,
        known_spacing: KnownSpacing,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._seeing = seeing
        self._edit = edit
        self._known_spacing = known_spacing
        self._checkpoints: tuple[Checkpoint, ...] = ()
        self._current: Checkpoint | None = None
        self._truth: Truth | None = None
        self._networks = Networks()
        self._shipped: Remembered[Path | None] = Remembered()
        self._job: Job | None = None
        self._tasks: tuple[PredictionTask, ...] = ()
        self._done = 0
        self._passes = Passes(seeing)
        self._overlay = PredictionOverlay(session, seeing, self._passes, self._networks.process_of, self)
        self._overlay.changed.connect(self.shown_changed)
        # It comes from the thread that predicts.
        self._advanced.connect(self._on_self_advanced, Qt.ConnectionType.QueuedConnection)

    # Checkpoints

    @property
    def checkpoints(self) -> "tuple[Checkpoint, ...]":
        """Those that are loaded, in the order of their loading: several stand side by side."""
        return self._checkpoints

    @property
    def current(self) -> "Checkpoint | None":
        """The one in use: it predicts, and its predictions are drawn."""
        return self._current

    @property
    def shipped_path(self) -> Path | None:
        """Where the checkpoint is that ships for the tool in use; None where there is none."""
        tool = self._session.tool
        name = self._session.tool_name if tool is None else tool.name
        return self._shipped.result(shipped_checkpoint, name)

    def unfitness(self, checkpoint: "Checkpoint") -> str:
        """Return why a checkpoint does not fit what is open, without a full stop; empty where it fits.

        Where nothing is open, it is the tool of the next document that counts.
        """
        volume, spacing_um = self._session.volume, self._session.spacing_um
        reason = self.tool_unfitness(checkpoint)
        if reason or volume is None or spacing_um is None:
            return reason
        return volume_unfitness(checkpoint, volume, spacing_um)

    def tool_unfitness(self, checkpoint: "Checkpoint") -> str:
        """Return why its keypoints are not those that are annotated here; then it cannot be used at all."""
        tool = self._tool()
        return "" if tool is None else tool_unfitness(checkpoint, tool)

    def tool_differences(self, checkpoint: "Checkpoint") -> str:
        """Return in what its tool is not the one that is annotated here, though it fits."""
        tool = self._tool()
        return "" if tool is None else tool_differences(checkpoint, tool)

    def load(self, checkpoint: "Checkpoint") -> None:
        """Take a checkpoint into use; what others have predicted stays."""
        loaded = [each.sha256 for each in self._checkpoints]
        if checkpoint.sha256 in loaded:
            place = loaded.index(checkpoint.sha256)
            # The same content, maybe from another file: the one that is there now.
            self._checkpoints = (*self._checkpoints[:place], checkpoint, *self._checkpoints[place + 1 :])
            self._networks.end(checkpoint.sha256)
        else:
            self._checkpoints = (*self._checkpoints, checkpoint)
        self._use(checkpoint)
        self.show_open()
        self._session.post_message(f"{checkpoint.description.name} is in use: Ctrl+P predicts this volume")

    def choose(self, sha256: str) -> None:
        """Use another one of those that are loaded."""
        chosen = next((each for each in self._checkpoints if each.sha256 == sha256), None)
        if chosen is not None and chosen is not self._current:
            self._use(chosen)

    def put_away(self, sha256: str) -> None:
        """Put a checkpoint away; its predictions stay in their files."""
        rest = tuple(each for each in self._checkpoints if each.sha256 != sha256)
        if rest == self._checkpoints:
            return
        self._checkpoints = rest
        self._networks.end(sha256)
        if self._current is not None and self._current.sha256 == sha256:
            self._use(rest[-1] if rest else None)
        else:
            self.checkpoints_changed.emit()

    def close(self) -> None:
        """End the processes in which checkpoints run."""
        self._networks.close()

    # The truth

    @property
    def truth(self) -> "Truth":
        """Whose annotations are taken for the truth."""
        if self._truth is None:
            from annotations.prediction.errors.study_errors import Truth  # late: few sessions predict

            self._truth = Truth()
        return self._truth

    def choose_truth(self, truth: "Truth") -> None:
        """Take other annotations for the truth."""
        if truth == self._truth:
            return
        self._truth = truth
        self._overlay.use(self._current, truth)
        self.truth_changed.emit()

    # The open volume

    @property
    def prediction(self) -> "Prediction | None":
        """What ``current`` says of the open volume; None where it has not said anything yet."""
        return self._overlay.prediction

    @property
    def shown(self) -> ShownPrediction | None:
        """What is drawn over the open volume, where the layer ``prediction`` is shown and may be."""
        return self._overlay.shown

    @property
    def reason(self) -> str:
        """Why nothing is shown though it is wanted, as a sentence without its full stop; else empty."""
        return self._overlay.reason

    def show_open(self) -> None:
        """Draw what ``current`` says of what is open as soon as it has said it, where that may be seen."""
        self._overlay.await_prediction()

    @property
    def start_refusal(self) -> str:
        """Why no annotation may start from a prediction here, without a full stop; empty where one may.

        In blind work none may, not even where one may look: what is begun from a prediction is not one's own.
        In a study that is said whether there is a prediction or not: which are there is not to be known.
        """
        is_asked_for = self.prediction is not None or self._session.worklist.study is not None
        return self._seeing.work_refusal if self._current is not None and is_asked_for else ""

    def start_from_prediction(self) -> None:
        """Put unplaced keypoints where ``current`` has them, as one edit."""
        if refusal := self.start_refusal:
            self._session.post_message(f"{refusal}: in blind work no annotation starts from a prediction")
            return
        prediction, path = self._overlay.prediction, self._overlay.path
        annotation_path, before = self._session.annotation_path, self._session.document
        if prediction is None or path is None or annotation_path is None or before is None:
            self._session.post_message(_NO_PREDICTION)
            return
        if self._session.read_only_reason:
            self._session.post_message(self._session.read_only_reason)
            return
        # Before it is there: whoever corrects a prediction has seen it.
        if not self._seeing.note_shown("predictions"):
            return
        from annotations.prediction.starting_point import start_from  # late: few sessions predict

        name = prediction.checkpoint.name
        is_made = self._edit(
            f"Start from {name}",
            lambda document: start_from(
                document, prediction, prediction_path=path, annotation_path=annotation_path
            ),
        )
        if is_made and self._session.document is before:
            self._session.post_message(_NOTHING_TO_START.format(name))
        elif is_made:
            self._session.post_message(
                f"Placed where {name} has them: correct them, then accept the rest (Ctrl+Enter)"
            )

    def accept_predicted(self) -> None:
        """Count the keypoints that are still where a checkpoint put them as placed, as one edit."""
        before = self._session.document
        is_made = self._edit("Accept what is predicted", edits.accept_predicted)
        after = self._session.document
        if not is_made or before is None or after is None:
            return
        if after is before:
            self._session.post_message(_NOTHING_TO_ACCEPT)
            return
        accepted = [part.name for part in after.parts if part != before.part(part.name)]
        self._session.post_message(f"Accepted: {', '.join(accepted)}")

    # Predicting

    def counts_for(self, item: WorkItem) -> bool:
        """Say whether what ``current`` has said of an item's volume counts for the item: see `Passes`."""
        return bool(self.counting((item,)))

    def counting(self, items: Sequence[WorkItem]) -> Sequence[WorkItem]:
        """Return those of some items for which what ``current`` has said of their volumes counts."""
        return () if self._current is None else self._passes.counting(self._current.sha256, items)

    @property
    def is_predicting(self) -> bool:
        """Whether volumes are being predicted."""
        return self._job is not None

    def predict(self, indices: Sequence[int]) -> None:
        """Predict the items at these places that have no prediction of ``current`` yet."""
        checkpoint = self._current
        reason = "" if checkpoint is not None else _NO_CHECKPOINT
        reason = reason or ("" if indices else _NO_VOLUME) or (_UNDER_WAY if self.is_predicting else "")
        if checkpoint is None or reason:
            self._session.post_message(reason)
            return
        if unfitness := self.tool_unfitness(checkpoint):
            self._session.report(
                UserError(
                    f"{checkpoint.description.name} predicts nothing here: {unfitness}",
                    where=checkpoint.path,
                    remedy="Load a checkpoint that was trained for this tool",
                )
            )
            return
        tasks = tuple(self._task(index) for index in indices)
        process, known_spacing = self._networks.process_of(checkpoint), self._known_spacing
        self._tasks, self._done = tasks, 0

        def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> PredictionOutcome:
            def on_done(count: int, is_predicted: bool) -> None:
                self._advanced.emit(count, checkpoint.sha256 if is_predicted else "")
                progress(count / len(tasks))

            return predict_all(tasks, checkpoint, process, known_spacing, on_done, cancelled)

        self._job = self._session.jobs.start(
            self._job_title(),
            work,
            done=lambda outcome: self._on_job_done(checkpoint, outcome),
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
        )
        self.show_open()
        self.running_changed.emit()

    def cancel(self) -> None:
        """Give up what is being predicted; what is done stays."""
        if self._job is not None:
            self._session.jobs.cancel(self._job)

    def _task(self, index: int) -> PredictionTask:
        session = self._session
        request = OpeningRequest(
            session.worklist, index, session.tool_name, session.tool_folders, session.person
        )
        # What an earlier pass has left is not to be told from what was never predicted.
        is_anew = not self.counts_for(request.item)
        volume = session.volume
        if index != session.current_index or volume is None:
            return PredictionTask(request, is_anew=is_anew)
        # As it is open: of several arrays in one file, somebody has chosen this one.
        request = replace(request, dataset=volume.dataset)
        return PredictionTask(request, session.spacing_um, volume.depth_axis, is_anew)

    def _job_title(self) -> str:
        if len(self._tasks) == 1:
            return f"Predicting {self._tasks[0].request.item.label}"
        return f"Predicting volume {min(self._done + 1, len(self._tasks))} of {len(self._tasks)}"

    def _tool(self) -> ToolSpecification | None:
        if self._session.tool is not None:
            return self._session.tool
        try:
            return self._session.tools().get(self._session.tool_name)
        except UserError:
            # Whoever opens a volume will hear of it.
            return None

    def _use(self, checkpoint: "Checkpoint | None") -> None:
        self._current = checkpoint
        self._overlay.use(checkpoint, self.truth if checkpoint is not None else None)
        self.checkpoints_changed.emit()

    def _finish(self) -> None:
        self._job, self._tasks = None, ()
        self._overlay.reread()
        self.running_changed.emit()
        self.predicted.emit()

    def _is_open(self, item: WorkItem) -> bool:
        index = self._session.current_index
        return index is not None and self._session.items[index].place == item.place

    def _on_self_advanced(self, count: int, predicted_by: str) -> None:
        if self._job is None or not self._tasks:
            return
        item = self._tasks[count - 1].request.item
        if predicted_by:
            self._passes.note_asked(predicted_by, item)
        self._done = count
        self._job.title = self._job_title()
        if self._is_open(item):
            self._overlay.reread()

    def _on_job_done(self, checkpoint: "Checkpoint", outcome: PredictionOutcome) -> None:
        name = checkpoint.description.name
        is_open = any(self._is_open(task.request.item) for task in self._tasks)
        self._finish()
        refusal = self._seeing.refusal if is_open else ""
        failure = failure_of(outcome, name)
        if failure is not None:
            self._session.report(failure)
            return
        count = "1 volume" if outcome.made == 1 else f"{outcome.made} volumes"
        kept = f"; {outcome.kept} had been before" if outcome.kept else ""
        done = f"{name} has predicted {count}{kept}"
        if not outcome.made:
            done = f"Predicted already by {name}: it would say the same again"
        self._session.post_message(f"{done}. {refusal}" if refusal else done)

    def _on_job_failed(self, error: Exception) -> None:
        self._finish()
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_job_cancelled(self) -> None:
        done, count = self._done, len(self._tasks)
        self._finish()
        self._session.post_message(f"Cancelled: {done} of {count} volumes are predicted, and stay so")
