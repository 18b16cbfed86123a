"""What is drawn of a prediction over the open volume, and why not where it is wanted."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.annotation import Annotation
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.session.editing.seeing import Seeing
from annotator.session.editing.solids import Solid, posed_solids
from annotator.session.jobs import Job
from annotator.session.predictions.checkpoint_fit import tool_unfitness, volume_unfitness
from annotator.session.predictions.passes import Passes
from annotator.session.predictions.predicted import KeypointPair, ShownPrediction
from annotator.session.predictions.prediction_files import KeptPrediction, OpenVolume, read_kept
from annotator.session.remembered import Remembered
from annotator.session.state import SessionState
from annotator.session.viewing.view import View

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.errors.study_errors import Truth
    from annotations.prediction.inference_process import InferenceProcess
    from annotations.prediction.prediction import Prediction
    from annotations.prediction.volume_heatmaps import VolumeHeatmaps

_NO_CHECKPOINT = "No checkpoint is loaded: Predictions ▸ Load Checkpoint…"
_NOTHING_YET = "{} has not predicted this volume yet: Predictions ▸ Predict This Volume"


class PredictionOverlay(QObject):
    """Holds what a checkpoint says of the open volume, and what is true of it.

    Parameters
    ----------
    passes : Passes
    process : callable
        Returns where a checkpoint runs.

    Signals
    -------
    changed
        ``prediction``, ``shown`` or ``reason`` changed.
    """

    changed = Signal()

    def __init__(
        self,
        session: SessionState,
        seeing: Seeing,
        passes: Passes,
        process: "Callable[[Checkpoint], InferenceProcess]",
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._seeing = seeing
        self._passes = passes
        self._process = process
        self._checkpoint: Checkpoint | None = None
        self._truth: Truth | None = None
        self._kept: KeptPrediction | None = None
        self._reading: Job | None = None
        self._heating: Job | None = None
        self._heatmaps: VolumeHeatmaps | None = None
        self._are_heatmaps_refused = False
        self._is_awaited = False
        self._awaited_index: int | None = None
        self._is_shown = False
        self._reason = ""
        self._announced: tuple[Prediction | None, ShownPrediction | None, str] = (None, None, "")
        self._shown: Remembered[ShownPrediction] = Remembered()
        self._true_um: Remembered[Mapping[str, Vector]] = Remembered()
        self._solids: Remembered[tuple[Solid, ...]] = Remembered()
        session.volume_changed.connect(self._on_session_volume_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        seeing.permission_changed.connect(self._follow)

    @property
    def prediction(self) -> "Prediction | None":
        """What the checkpoint says of the open volume, whether it may be shown or not."""
        return self._kept.prediction if self._kept is not None else None

    @property
    def path(self) -> Path | None:
        """Where that is kept, or would be."""
        return self._kept.path if self._kept is not None else None

    @property
    def reason(self) -> str:
        """Why nothing is shown though it is wanted, as a sentence without its full stop; else empty."""
        return self._reason

    @property
    def shown(self) -> ShownPrediction | None:
        """What is drawn."""
        checkpoint, prediction, tool = self._checkpoint, self.prediction, self._session.tool
        if not self._is_shown or checkpoint is None or prediction is None or tool is None:
            return None
        heatmaps = self._heatmaps if "heatmaps" in self._session.view.layers else None
        true_um = self._true_um.result(_true_um, *self._said())
        solids = self._solids.result(_solids, prediction, checkpoint)
        return self._shown.result(
            _shown, prediction, tool, self._whose() if true_um else "", true_um, solids, heatmaps
        )

    def use(self, checkpoint: "Checkpoint | None", truth: "Truth | None") -> None:
        """Show what a checkpoint says, held against whoever's annotations."""
        if checkpoint is not self._checkpoint:
            self._forget()
        self._checkpoint, self._truth = checkpoint, truth
        self.reread()

    def await_prediction(self) -> None:
        """Turn the layer on as soon as there is a prediction of what is open, if it may be seen then.

        Where nothing is open, or it must not be seen of what is, the next volume is meant of which it may;
        and never one further on: whoever is shown a prediction has that written into their document.
        """
        self._is_awaited, self._awaited_index = True, None
        self._tie_awaited()
        self._show_awaited()

    def reread(self) -> None:
        """Read what is kept about the open volume again, in the background."""
        if self._reading is not None:
            self._session.jobs.cancel(self._reading)
            self._reading = None
        opened, checkpoint, truth = self._opened(), self._checkpoint, self._truth
        if opened is not None and checkpoint is not None and truth is not None:
            counts = self._passes.counts(checkpoint.sha256, opened.item)
            self._reading = self._session.jobs.start(
                "Reading the prediction",
                lambda _progress, _cancelled: read_kept(opened, checkpoint, truth, counts=counts),
                done=self._on_job_read,
                failed=self._on_job_reading_failed,
                shown=False,
            )
        self._follow()

    def _opened(self) -> OpenVolume | None:
        session, index = self._session, self._session.current_index
        volume, fingerprint, spacing_um, tool = (
            session.volume,
            session.volume_fingerprint,
            session.spacing_um,
            session.tool,
        )
        if index is None or volume is None or fingerprint is None or spacing_um is None or tool is None:
            return None
        item = session.items[index]
        return OpenVolume(session.worklist, item, volume, fingerprint, spacing_um, tool, session.tool_folders)

    # What is true

    @property
    def _is_live(self) -> bool:
        """Whether it is the open document that speaks for the volume."""
        if self._session.worklist.study is None:
            return True
        spoken = self._kept.spoken if self._kept is not None else None
        return spoken is not None and spoken.path == self._session.annotation_path

    def _said(self) -> tuple[Annotation | None, ToolSpecification | None]:
        """Return the annotation that speaks for the volume, and its tool."""
        if self._is_live:
            return self._session.shown_document, self._session.tool
        spoken = self._kept.spoken if self._kept is not None else None
        return (None, None) if spoken is None else (spoken.annotation, spoken.tool)

    def _whose(self) -> str:
        spoken = self._kept.spoken if self._kept is not None else None
        return self._session.annotator_name if spoken is None else spoken.annotator

    # What is drawn

    def _tie_awaited(self) -> None:
        if self._is_awaited and self._awaited_index is None and not self._seeing.refusal:
            self._awaited_index = self._session.current_index

    def _show_awaited(self) -> None:
        if self._is_awaited and self.prediction is not None and not self._seeing.refusal:
            self._is_awaited = False
            self._session.look(layers=self._session.view.layers | {"prediction"})

    def _follow(self) -> None:
        """Show or put away, by what is wanted and may be seen now."""
        is_wanted = "prediction" in self._session.view.layers and self._session.document is not None
        reason = self._why_not() if is_wanted else ""
        is_shown = is_wanted and not reason and self.prediction is not None and self._is_noted()
        self._is_shown, self._reason = is_shown, reason
        if is_shown:
            self._follow_heatmaps()
        self._announce()

    def _announce(self) -> None:
        # By identity: it is the same object as long as nothing of it has changed.
        before, now = self._announced, (self.prediction, self.shown, self._reason)
        self._announced = now
        if before[0] is not now[0] or before[1] is not now[1] or before[2] != now[2]:
            self.changed.emit()

    def _why_not(self) -> str:
        if self._checkpoint is None:
            return _NO_CHECKPOINT
        if refusal := self._seeing.refusal:
            return refusal
        tool, volume, spacing_um = self._session.tool, self._session.volume, self._session.spacing_um
        if tool is not None and (unfitness := tool_unfitness(self._checkpoint, tool)):
            return _not_for_it(self._checkpoint, unfitness)
        if self._reading is not None or self._kept is None or self.prediction is not None:
            return ""
        if volume is not None and spacing_um is not None:
            unfitness = volume_unfitness(self._checkpoint, volume, spacing_um)
            if unfitness:
                return _not_for_it(self._checkpoint, unfitness)
        return self._kept.problem or _NOTHING_YET.format(self._checkpoint.description.name)

    def _is_noted(self) -> bool:
        """Write down that somebody else's work is shown; False where that failed, and it is not shown."""
        spoken = self._kept.spoken if self._kept is not None else None
        if spoken is not None and not self._is_live and not self._seeing.note_shown("annotations"):
            return False
        return self._seeing.note_shown("predictions")

    def _follow_heatmaps(self) -> None:
        opened, checkpoint = self._opened(), self._checkpoint
        is_wanted = "heatmaps" in self._session.view.layers
        if not is_wanted or self._heatmaps is not None or self._heating is not None:
            return
        if self._are_heatmaps_refused or opened is None or checkpoint is None:
            return
        process = self._process(checkpoint)
        self._heating = self._session.jobs.start(
            "Computing the heatmaps",
            lambda _progress, cancelled: _heatmaps(process, opened, cancelled),
            done=self._on_job_heated,
            failed=self._on_job_heating_failed,
            cancelled=self._on_job_heating_cancelled,
        )

    def _forget(self) -> None:
        for job in (self._reading, self._heating):
            if job is not None:
                self._session.jobs.cancel(job)
        self._reading = self._heating = self._kept = self._heatmaps = None
        self._are_heatmaps_refused = False

    def _on_job_read(self, kept: KeptPrediction) -> None:
        self._reading = None
        # What is the same stays the same object: nothing is drawn anew for it.
        if kept != self._kept:
            if self._kept is not None and kept.prediction == self._kept.prediction:
                kept = replace(kept, prediction=self._kept.prediction)
            self._kept = kept
        self._show_awaited()
        self._follow()

    def _on_job_reading_failed(self, error: Exception) -> None:
        self._reading = None
        self._follow()
        self._raise(error)

    def _on_job_heated(self, heatmaps: "VolumeHeatmaps") -> None:
        self._heating, self._heatmaps = None, heatmaps
        self._follow()

    def _on_job_heating_failed(self, error: Exception) -> None:
        self._heating = None
        # Until they are asked for again: else it would fail with every stroke.
        self._are_heatmaps_refused = True
        self._raise(error)

    def _on_job_heating_cancelled(self) -> None:
        if self._heating is not None and self._heating.state == "cancelled":
            self._heating = None
            self._are_heatmaps_refused = True

    def _raise(self, error: Exception) -> None:
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_session_volume_changed(self) -> None:
        self._tie_awaited()
        self._is_awaited = self._is_awaited and self._awaited_index in (None, self._session.current_index)
        self._forget()
        self._follow()
        # After every view has heard of the new volume: a thread would take Python's lock from them.
        QTimer.singleShot(0, self, self.reread)

    def _on_session_save_state_changed(self) -> None:
        # Whose annotation speaks for the volume may have changed with what was saved.
        is_saved = self._session.volume is not None and not self._session.unsaved
        if is_saved and self._session.worklist.study is not None and self._kept is not None:
            self.reread()

    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._follow_document()

    def _on_session_view_changed(self, before: View, after: View) -> None:
        differing = before.layers ^ after.layers
        if "heatmaps" in differing:
            self._are_heatmaps_refused = False
        if differing & {"prediction", "heatmaps"}:
            # Whoever hides or shows it has said what they want.
            self._is_awaited = self._is_awaited and "prediction" not in differing
            self._follow()
            if "prediction" in differing and self._reason:
                self._session.post_message(self._reason)
        else:
            self._follow_document()

    def _follow_document(self) -> None:
        """Draw what speaks for the volume as it is on its way."""
        if self._is_shown and self._is_live:
            self._announce()


def _heatmaps(
    process: "InferenceProcess", opened: OpenVolume, cancelled: Callable[[], bool]
) -> "VolumeHeatmaps":
    from annotations.prediction.heatmap_cloud import heatmap_cloud  # late: few sessions predict

    heatmaps = process.heatmaps(
        opened.volume.path,
        dataset=opened.volume.dataset,
        spacing_um=opened.spacing_um,
        depth_axis=opened.volume.depth_axis,
        cancelled=cancelled,
    )
    # Kept there: whoever draws them does not wait.
    for name in heatmaps.names:
        heatmap_cloud(heatmaps, name)
    return heatmaps


def _not_for_it(checkpoint: "Checkpoint", unfitness: str) -> str:
    return f"{checkpoint.description.name} does not fit: {unfitness}"


def _true_um(annotation: Annotation | None, tool: ToolSpecification | None) -> Mapping[str, Vector]:
    from annotations.prediction.errors.study_errors import true_positions_um  # late: few sessions predict

    return {} if annotation is None or tool is None else true_positions_um(annotation, tool)


def _solids(prediction: "Prediction", checkpoint: "Checkpoint") -> tuple[Solid, ...]:
    if prediction.pose is None:
        return ()
    return posed_solids(prediction.pose.tool_pose, checkpoint.description.tool, "prediction")


def _shown(
    prediction: "Prediction",
    tool: ToolSpecification,
    whose: str,
    true_um: Mapping[str, Vector],
    solids: tuple[Solid, ...],
    heatmaps: "VolumeHeatmaps | None",
) -> ShownPrediction:
    predicted_um = prediction.positions_um
    confidence = {keypoint.name: keypoint.confidence for keypoint in prediction.keypoints}
    pairs = tuple(
        KeypointPair(name, true_um.get(name), predicted_um.get(name), confidence.get(name))
        for name in tool.keypoint_names
    )
    errors = _errors(predicted_um, true_um, tool)
    return ShownPrediction(prediction.checkpoint.name, whose, pairs, solids, errors, heatmaps)


def _errors(
    predicted_um: Mapping[str, Vector], true_um: Mapping[str, Vector], tool: ToolSpecification
) -> Mapping[str, float]:
    """Return the errors of the open volume by the published formulas."""
    from annotations.prediction.errors.prediction_errors import positions_array_um, prediction_errors

    errors = prediction_errors(
        positions_array_um([predicted_um], tool), positions_array_um([true_um], tool), tool
    )
    return {name: float(values[0]) for name, values in errors.targets.items() if np.isfinite(values[0])}
