"""From a network's weights to a checkpoint."""

from pathlib import Path

from annotations.learning.exporting import halved, onnx_bytes
from annotations.learning.training.state_file import read_state
from annotations.prediction.checkpoint import Checkpoint, save_checkpoint


def convert_state(path: Path, output: Path, *, half: bool = False) -> Checkpoint:
    """Write the checkpoint of a network whose weights a training left as ``best.pt``.

    Parameters
    ----------
    path : Path
        The weights; see `annotations.learning.training.state_file`.
    output : Path
        The checkpoint; a file of that name is replaced.
    half : bool
        Whether its weights are kept in half precision, for half the size.

    Raises
    ------
    StateError
        The file is no network of this program. None of its code runs.
    CheckpointError, SaveError
        The checkpoint cannot be written.
    """
    state = read_state(path)
    model_bytes = onnx_bytes(state.network)
    return save_checkpoint(output, state.description, halved(model_bytes) if half else model_bytes)
