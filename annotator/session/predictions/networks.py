"""The networks of the checkpoints that are loaded, each in a process of its own."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.inference_process import InferenceProcess


class Networks:
    """Keeps one process a checkpoint, for predictions and heatmaps alike; each starts when it is needed."""

    def __init__(self) -> None:
        self._processes: dict[str, InferenceProcess] = {}

    def process_of(self, checkpoint: "Checkpoint") -> "InferenceProcess":
        """Return where a checkpoint runs."""
        from annotations.prediction.inference_process import InferenceProcess  # late: few sessions predict

        if checkpoint.sha256 not in self._processes:
            self._processes[checkpoint.sha256] = InferenceProcess(checkpoint.path, sha256=checkpoint.sha256)
        return self._processes[checkpoint.sha256]

    def end(self, sha256: str) -> None:
        """End a checkpoint's process, if it runs; what waits for it is cancelled."""
        process = self._processes.pop(sha256, None)
        if process is not None:
            process.close()

    def close(self) -> None:
        """End them all."""
        for sha256 in tuple(self._processes):
            self.end(sha256)
