"""Times a prediction, stage by stage: ``python -m tests.bench.prediction [CHECKPOINT] [--volume FILE]``.

Without a checkpoint, an untrained network of the default kind is exported, which needs torch: how long it
takes does not depend on what it has learned. Without a volume, some of the scanner's real-time shape are
synthesised into a temporary folder. Volumes are mapped, and their pages stay in memory after the first time,
as a live volume's do. Each volume goes through the stages as in the application, and its input through ONNX
Runtime for comparison, so that other work on the machine slows both alike. Prints a table on standard error
and one JSON object on standard output; judges nothing.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from annotations.errors import UserError
from annotations.geometry.tool_library import find_tool
from annotations.prediction.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.predicted_pose import fit_prediction
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import find_checkpoint
from annotations.synthesis import REALTIME_SHAPE, write_study
from annotations.volumes import SpacingUm, Volume, open_volume
from annotations.volumes.sampling import sample_volume
from tests.bench.figures import print_figures

BUDGET_MS = 50.0
"""Between two volumes of the scanner, which gives 20 a second."""
MADE = 4
WARM_UP = 5

T = TypeVar("T")


def untrained_checkpoint(path: Path) -> Checkpoint:
    """Write a checkpoint of the default network with random weights."""
    try:
        import torch
    except ImportError:
        sys.exit("without torch, name a checkpoint")
    from annotations.documents.record import now
    from annotations.learning.architectures.networks import build_network, parameter_count
    from annotations.learning.exporting import onnx_bytes
    from annotations.learning.settings.training_settings import TrainingSettings

    torch.manual_seed(0)
    settings, tool = TrainingSettings(), find_tool("magnetic-forceps")
    network = build_network(settings.network_settings(len(tool.keypoint_names), outputs=0)).eval()
    description = CheckpointDescription(
        name="untrained",
        network=settings.network.kind,
        parameters=parameter_count(network),
        tool=tool,
        keypoints=tool.keypoint_names,
        sampling=settings.sampling,
        heatmaps=settings.heatmaps,
        created=now(),
    )
    return save_checkpoint(path, description, onnx_bytes(network))


class Stopwatch:
    """Notes how long the calls of each stage take."""

    def __init__(self) -> None:
        self.taken_ms: dict[str, list[float]] = {}

    def time(self, stage: str, work: Callable[[], T]) -> T:
        begun = time.perf_counter()
        done = work()
        self.taken_ms.setdefault(stage, []).append(1000 * (time.perf_counter() - begun))
        return done

    def figures(self) -> dict[str, float]:
        """Return the median and the 99th percentile of each stage."""
        figures = {}
        for stage, taken_ms in self.taken_ms.items():
            figures[f"{stage}_median_ms"] = float(np.median(taken_ms[WARM_UP:]))
            figures[f"{stage}_p99_ms"] = float(np.percentile(taken_ms[WARM_UP:], 99))
        return figures


def opened(path: Path | None, folder: Path) -> list[tuple[Volume, SpacingUm]]:
    """Return the volumes to predict: that of the path, else synthetic ones."""
    paths = [path] if path is not None else []
    if path is None:
        study = write_study(
            folder / "study", find_tool("magnetic-forceps"), count=MADE, seed=1, shape=REALTIME_SHAPE
        )
        paths = [folder / "study" / volume.path for volume in study.volumes]
    found = []
    for each in paths:
        volume = open_volume(each)
        if volume.spacing_um is None:
            raise UserError("its spacing is unknown", where=each, remedy="Write a sidecar that says it")
        found.append((volume, volume.spacing_um))
    return found


def measure(
    checkpoint: Checkpoint, volumes: list[tuple[Volume, SpacingUm]], times: int, threads: int
) -> dict[str, float]:
    """Predict so many volumes, in turn, and return the figures."""
    import onnxruntime

    description = checkpoint.description
    predictor = Predictor(checkpoint, Runtime(checkpoint, threads=threads))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    # Its threads would go on looking for work on the cores while the next volume is being timed.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    session = onnxruntime.InferenceSession(checkpoint.model, options, providers=["CPUExecutionProvider"])
    [given] = session.get_inputs()
    watch = Stopwatch()
    for number in range(WARM_UP + times):
        volume, spacing_um = volumes[number % len(volumes)]
        predicted = watch.time("whole", lambda: predictor.predict(volume, spacing_um))  # noqa: B023
        for stage in ("sampling", "network", "decoding"):
            taken_ms = watch.taken_ms.setdefault(stage, [])
            taken_ms.append(1000 * getattr(predicted.times, f"{stage}_s"))
        samples = sample_volume(volume, spacing_um, description.sampling)
        values = description.sampling.scaled(samples)[None, None]
        watch.time("onnxruntime", lambda: session.run(None, {given.name: values}))  # noqa: B023
        # After the other runtime, whose threads go on waiting busily for a moment.
        watch.time("fit", lambda: fit_prediction(predicted, description))  # noqa: B023
    figures = watch.figures()
    figures["onnxruntime_over_network"] = figures["onnxruntime_median_ms"] / figures["network_median_ms"]
    figures["whole_median_share_of_budget"] = figures["whole_median_ms"] / BUDGET_MS
    figures["whole_p99_share_of_budget"] = figures["whole_p99_ms"] / BUDGET_MS
    figures["keypoints_found"] = float(np.isfinite(predicted.positions_um).all(axis=1).sum())
    return figures


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.prediction", description=__doc__)
    parser.add_argument("checkpoint", nargs="?", type=Path)
    parser.add_argument("--volume", type=Path, help="a volume's file, such as a full-size .npy")
    parser.add_argument("--times", type=int, default=200, help="how many volumes (%(default)s)")
    parser.add_argument(
        "--threads", type=int, default=os.cpu_count() or 1, help="of either runtime (%(default)s)"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="oct-annotator-bench-") as name:
        folder = Path(name)
        checkpoint = (
            untrained_checkpoint(folder / "untrained.onnx")
            if options.checkpoint is None
            else load_checkpoint(find_checkpoint(options.checkpoint))
        )
        volumes = opened(options.volume, folder)
        try:
            figures: dict[str, object] = {
                "checkpoint": checkpoint.description.name,
                "network_kind": checkpoint.description.network,
                "volume_shape": volumes[0][0].shape,
                "volumes": options.times,
                "threads": options.threads,
                "budget_ms": BUDGET_MS,
                **measure(checkpoint, volumes, options.times, options.threads),
            }
        finally:
            for volume, _ in volumes:
                volume.close()
    print_figures(figures)


if __name__ == "__main__":
    main()
