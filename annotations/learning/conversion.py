"""From a network's weights to a checkpoint."""

from pathlib import Path

from annotations.learning.exporting import onnx_bytes
from annotations.learning.state_file import read_state
from annotations.prediction.checkpoint import Checkpoint, save_checkpoint


def convert_state(path: Path, output: Path) -> Checkpoint:
    """Write the checkpoint of a network whose weights a training left as ``best.pt``.

    Parameters
    ----------
    path : Path
        The weights; see `annotations.learning.state_file`.
    output : Path
        The checkpoint; a file of that name is replaced.

    Raises
    ------
    StateError
        The file is no network of this program. None of its code runs.
    CheckpointError, SaveError
        The checkpoint cannot be written.
    """
    state = read_state(path)
    return save_checkpoint(output, state.description, onnx_bytes(state.network))
