"""A network in a process of its own: whatever it does, the program that asks goes on."""

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from annotations.errors import Cancelled, UserError
from annotations.geometry.frames import vector
from annotations.prediction.inference_child import InferenceChild, InferenceCrashed
from annotations.prediction.inference_messages import Message, error_of, unpacked
from annotations.prediction.live.frame import FrameTimes, LiveFrame
from annotations.prediction.prediction import FittedPose, PredictedKeypoint, Prediction
from annotations.prediction.volume_heatmaps import VolumeHeatmaps
from annotations.volumes import SpacingUm

__all__ = ["InferenceCrashed", "InferenceProcess"]

_LOOK_EVERY_S = 0.05

Result = TypeVar("Result")


class InferenceProcess:
    """Runs a checkpoint's network in another process, which starts when it is needed first.

    Any thread may call; of several, one after the other has its turn. An error of the other process arrives
    as if it had happened here. One that crashes is replaced at the next call, as long as its checkpoint is
    the one that it was at first.

    Parameters
    ----------
    checkpoint_path : Path
    sha256 : str, optional
        Of the checkpoint's file: another one that has its name by then is refused. By default the first one
        that is found there counts.
    threads : int, optional
        How many compute; by default OpenVINO chooses.
    """

    def __init__(
        self, checkpoint_path: Path, *, sha256: str | None = None, threads: int | None = None
    ) -> None:
        self._path = checkpoint_path.absolute()
        self._sha256 = sha256
        self._threads = threads
        self._turn = threading.Lock()
        self._child: InferenceChild | None = None

    @property
    def has_ended(self) -> bool:
        """Whether the other process was started, and has ended since: the next call starts another."""
        return self._child is not None and self._child.has_ended

    def start(self, cancelled: Callable[[], bool]) -> None:
        """Start the other process and wait until it is ready, so that the first volume need not.

        Raises
        ------
        CheckpointError
            The file is no checkpoint, or another one by now; or OpenVINO cannot run its network.
        InferenceCrashed
            The process has ended without an answer.
        Cancelled
            `cancelled` returned true; or it was closed meanwhile.
        """
        self._take_turn(cancelled, lambda: None)

    def predict(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm | None,
        prediction_path: Path,
        cancelled: Callable[[], bool],
        depth_axis: int | None = None,
    ) -> Prediction:
        """Predict the keypoints of a volume, and fit the pose of the tool: `predict_volume` over there.

        Parameters
        ----------
        volume_path : Path
        dataset : str or None
            See `open_volume`.
        spacing_um : (float, float, float) or None
        prediction_path : Path
            Where the prediction will be kept. Nothing is written.
        cancelled : callable
            Asked whether to stop; then the other process is ended, within a few tenths of a second.
        depth_axis : int, optional
            Along which the light travels, whatever the file says; by default as it or its sidecar says.

        Raises
        ------
        VolumeError
            See `open_volume` and `predict_volume`.
        CheckpointError, InferenceCrashed, Cancelled
            See `start`.
        """
        answer = self._ask(
            "predict",
            volume_path,
            dataset,
            spacing_um,
            cancelled,
            prediction=str(prediction_path.absolute()),
            depth_axis=depth_axis,
        )
        return Prediction.model_validate(answer.header["prediction"])

    def heatmaps(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm,
        cancelled: Callable[[], bool],
        depth_axis: int | None = None,
    ) -> VolumeHeatmaps:
        """Return where in a volume the network takes each keypoint to be.

        Parameters and errors are those of `predict`.
        """
        answer = self._ask("heatmaps", volume_path, dataset, spacing_um, cancelled, depth_axis=depth_axis)
        header = answer.header
        [probability] = unpacked(header["arrays"], answer.body)
        return VolumeHeatmaps(
            tuple(header["names"]), probability, vector(header["origin_um"]), vector(header["spacing_um"])
        )

    def look(
        self,
        volume_path: Path,
        *,
        dataset: str | None,
        spacing_um: SpacingUm,
        depth_axis: int,
        cancelled: Callable[[], bool],
    ) -> LiveFrame:
        """Return what a live view shows of a volume, in as little time as possible.

        Parameters
        ----------
        depth_axis : int
            Along which the light travels, whatever the file says.

        Other parameters and errors are those of `predict`.
        """
        answer = self._ask("look", volume_path, dataset, spacing_um, cancelled, depth_axis=depth_axis)
        header = answer.header
        first, second, third = unpacked(header["arrays"], answer.body)
        return LiveFrame(
            volume_path,
            tuple(PredictedKeypoint.model_validate(keypoint) for keypoint in header["keypoints"]),
            None if header["pose"] is None else FittedPose.model_validate(header["pose"]),
            (first, second, third),
            vector(header["origin_um"]),
            vector(header["spacing_um"]),
            depth_axis,
            FrameTimes(**header["times"]),
        )

    def keep(self, folder: Path, cancelled: Callable[[], bool]) -> Path:
        """Write the prediction of the volume that was looked at last, and return where it is.

        Parameters
        ----------
        folder : Path
            It goes into ``predictions/<checkpoint>/`` in there (`loose_prediction_path`).

        Raises
        ------
        UserError
            No volume was looked at since the process has started, or the last one failed.
        SaveError
            The file cannot be written.
        """
        request = {"task": "keep", "folder": str(folder.absolute())}
        return Path(self._take_turn(cancelled, lambda: self._answer(request, cancelled)).header["path"])

    def close(self) -> None:
        """End the other process; a call that waits for it is cancelled, and a later one starts another."""
        child = self._child
        if child is not None:
            child.end()

    def _ask(
        self,
        task: str,
        volume_path: Path,
        dataset: str | None,
        spacing_um: SpacingUm | None,
        cancelled: Callable[[], bool],
        **more: Any,
    ) -> Message:
        request = {
            "task": task,
            "volume": str(volume_path.absolute()),
            "dataset": dataset,
            "spacing_um": spacing_um,
            **more,
        }
        return self._take_turn(cancelled, lambda: self._answer(request, cancelled))

    def _take_turn(self, cancelled: Callable[[], bool], work: Callable[[], Result]) -> Result:
        while not self._turn.acquire(timeout=_LOOK_EVERY_S):
            if cancelled():
                raise Cancelled
        try:
            if self._child is None or self._child.has_ended:
                self._start(cancelled)
            return work()
        finally:
            self._turn.release()

    def _start(self, cancelled: Callable[[], bool]) -> None:
        if self._child is not None:
            self._child.end()
        self._child = InferenceChild()
        request = {"checkpoint": str(self._path), "sha256": self._sha256, "threads": self._threads}
        try:
            self._sha256 = self._answer(request, cancelled).header["sha256"]
        except UserError:
            # It has no more to say, and the next call is to start another.
            self._child.end()
            raise

    def _answer(self, request: Mapping[str, Any], cancelled: Callable[[], bool]) -> Message:
        child = self._child
        assert child is not None
        answer = child.ask(request, cancelled)
        if "error" in answer.header:
            raise error_of(answer.header["error"])
        return answer
