"""The process in which a network runs for another program, which starts it (`inference_child`).

It takes one message after the other (`inference_messages`) from its standard input and answers each on its
standard output, until its input ends: then the program that started it has ended, or wants no more.
"""

import os
import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import IO, Any, NoReturn

import numpy as np

from annotations.documents.volume_link import reference_to
from annotations.errors import UserError
from annotations.fitting.pose_fit import prepare_fitting
from annotations.geometry.frames import is_inside, vector
from annotations.prediction.checkpoint import Checkpoint, CheckpointError, load_checkpoint
from annotations.prediction.inference_messages import (
    Garbled,
    Message,
    error_fields,
    packed,
    read_message,
    write_message,
)
from annotations.prediction.live.frame import FrameTimes, projections_of
from annotations.prediction.predicted_pose import PredictedPose, fit_prediction
from annotations.prediction.prediction import fitted_pose, keypoints_of, prediction_of
from annotations.prediction.prediction_file import checkpoint_folder, loose_prediction_path, save_prediction
from annotations.prediction.predictor import PredictedKeypoints, Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.volume_prediction import predict_volume, reference_to_checkpoint
from annotations.volumes import SpacingUm, Volume, fingerprint, open_volume
from annotations.volumes.sampling import sample_volume

Answer = tuple[Mapping[str, Any], bytes]


@dataclass(frozen=True)
class _Looked:
    """What was said last by `InferenceWorker.look`, in case it is to be kept."""

    volume: Volume
    spacing_um: SpacingUm
    predicted: PredictedKeypoints
    pose: PredictedPose | None


class InferenceWorker:
    """A checkpoint at work for another process.

    Parameters
    ----------
    path : Path
        Of the checkpoint.
    sha256 : str or None
        Of the file that is meant; None for whatever is there.
    threads : int or None
        See `Runtime`.

    Raises
    ------
    CheckpointError
        It is none, or another one by now; or OpenVINO cannot run it.
    """

    def __init__(self, path: Path, sha256: str | None, threads: int | None) -> None:
        self.checkpoint = _loaded(path, sha256)
        self._predictor = Predictor(self.checkpoint, Runtime(self.checkpoint, threads=threads))
        self._looked: _Looked | None = None
        # What the first volume would wait for otherwise.
        self._predictor.predict_samples(
            np.zeros(self.checkpoint.description.sampling.shape, np.float32),
            self.checkpoint.description.sampling.spacing_um,
        )
        prepare_fitting()

    def answer(self, request: Mapping[str, Any]) -> Answer:
        """Do what a message asks for.

        Raises
        ------
        UserError
            It cannot be done.
        """
        tasks: Mapping[str, Callable[[Mapping[str, Any]], Answer]] = {
            "predict": self._predict,
            "heatmaps": self._heatmaps,
            "look": self._look,
            "keep": self._keep,
        }
        return tasks[request["task"]](request)

    def _predict(self, request: Mapping[str, Any]) -> Answer:
        with _opened(request) as volume:
            spacing_um = None if request["spacing_um"] is None else vector(request["spacing_um"])
            prediction = predict_volume(self._predictor, volume, spacing_um, Path(request["prediction"]))
        return {"prediction": prediction.model_dump(mode="json")}, b""

    def _heatmaps(self, request: Mapping[str, Any]) -> Answer:
        with _opened(request) as volume:
            heatmaps = self._predictor.heatmaps(volume, vector(request["spacing_um"]))
        arrays, body = packed([heatmaps.probability])
        header = {
            "names": heatmaps.names,
            "origin_um": heatmaps.origin_um,
            "spacing_um": heatmaps.spacing_um,
            "arrays": arrays,
        }
        return header, body

    def _look(self, request: Mapping[str, Any]) -> Answer:
        description = self.checkpoint.description
        sampling = description.sampling
        spacing_um = vector(request["spacing_um"])
        begun_s = time.perf_counter()
        self._forget()
        volume = _opened(request)
        try:
            samples = sample_volume(volume, spacing_um, sampling)
            sampled_s = time.perf_counter()
            predicted = self._predictor.predict_samples(samples, spacing_um)
            predicted_s = time.perf_counter()
            pose = fit_prediction(predicted, description)
        except BaseException:
            volume.close()
            raise
        fitted_s = time.perf_counter()
        self._looked = _Looked(volume, spacing_um, predicted, pose)
        arrays, body = packed(projections_of(samples, sampling.value_range))
        kept = keypoints_of(predicted, partial(is_inside, shape=volume.shape, spacing_um=spacing_um))
        inside = predicted.times
        header = {
            "keypoints": [keypoint.model_dump(mode="json") for keypoint in kept],
            "pose": None if pose is None else fitted_pose(pose).model_dump(mode="json"),
            "origin_um": [float(sampling.axis_um(axis, spacing_um)[0]) for axis in range(3)],
            "spacing_um": sampling.spacing_um,
            "times": asdict(
                FrameTimes(sampled_s - begun_s, inside.network_s, inside.decoding_s, fitted_s - predicted_s)
            ),
            "arrays": arrays,
        }
        return header, body

    def _keep(self, request: Mapping[str, Any]) -> Answer:
        """Write what was said last into the folder of the checkpoint's predictions, and return where."""
        looked, description = self._looked, self.checkpoint.description
        if looked is None:
            raise UserError("there is nothing to keep: no volume was looked at")
        folder = checkpoint_folder(Path(request["folder"]), description.name, self.checkpoint.sha256)
        path = loose_prediction_path(folder, looked.volume)
        prediction = prediction_of(
            looked.predicted,
            looked.pose,
            reference_to(looked.volume, looked.spacing_um, path, fingerprint(looked.volume)),
            reference_to_checkpoint(self.checkpoint, path),
            description.tool,
        )
        save_prediction(prediction, path)
        return {"path": str(path)}, b""

    def _forget(self) -> None:
        if self._looked is not None:
            self._looked.volume.close()
            self._looked = None


def serve(requests: IO[bytes], answers: IO[bytes]) -> int:
    """Answer messages until there are no more, and return how the process should end.

    The first one names the checkpoint. Where the input ends, the process ends at once, whatever it is doing.
    """
    waiting: queue.SimpleQueue[Message] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(requests, waiting), daemon=True).start()
    worker: InferenceWorker | None = None
    while True:
        request = waiting.get().header
        try:
            if worker is None:
                worker = InferenceWorker(Path(request["checkpoint"]), request["sha256"], request["threads"])
                header: Mapping[str, Any] = {"sha256": worker.checkpoint.sha256}
                body = b""
            else:
                header, body = worker.answer(request)
        except UserError as error:
            header, body = {"error": error_fields(error)}, b""
        except MemoryError:
            write_message(answers, Message({"ended": "memory"}))
            return 1
        except Exception as error:  # noqa: BLE001 - the other side has to hear of it, whatever it is
            traceback.print_exc()
            header, body = {"ended": f"{type(error).__name__}: {error}"}, b""
        try:
            write_message(answers, Message(header, body))
        except OSError:
            return 0
        if "ended" in header or worker is None:
            return 1


def main() -> NoReturn:
    """Serve the process that has started this one, and end."""
    # Libraries print on what they take for standard output: they get standard error instead.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    code = serve(sys.stdin.buffer, answers)
    sys.stderr.flush()
    # No cleaning up: a thread still waits for requests, at which Python would take offence.
    os._exit(code)


def _receive(requests: IO[bytes], waiting: "queue.SimpleQueue[Message]") -> None:
    try:
        while (message := read_message(requests)) is not None:
            waiting.put(message)
    except (Garbled, OSError):
        traceback.print_exc()
    # At once: a read from a dead network share would keep the process for ever.
    os._exit(0)


def _opened(request: Mapping[str, Any]) -> Volume:
    """Open the volume that a request is about, with the depth axis that is said of it, if any is."""
    volume = open_volume(Path(request["volume"]), dataset=request["dataset"])
    depth_axis = request["depth_axis"]
    return volume if depth_axis is None else replace(volume, depth_axis=depth_axis)


def _loaded(path: Path, sha256: str | None) -> Checkpoint:
    checkpoint = load_checkpoint(path)
    if sha256 is not None and checkpoint.sha256 != sha256:
        raise CheckpointError(
            "another checkpoint has taken its place since it was loaded",
            where=path,
            remedy="Load it again, and see whether it is the one that you want",
        )
    return checkpoint


if __name__ == "__main__":
    main()
