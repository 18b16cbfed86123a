"""Weights become a checkpoint in a process of their own: the application itself never imports PyTorch."""

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from annotations.durable_files import replace_durably
from annotations.errors import Cancelled, UserError

if TYPE_CHECKING:
    from annotations.prediction.checkpoint import Checkpoint

_COMMAND = (sys.executable, "-m", "annotations.cli")
_LOOK_EVERY_S = 0.1


def converted(weights_path: Path, output: Path, cancelled: Callable[[], bool]) -> "Checkpoint":
    """Make a checkpoint of the weights that a training left, with ``annotations checkpoint convert``.

    Parameters
    ----------
    weights_path : Path
        Absolute.
    output : Path
        A file of that name is replaced, once there is a checkpoint to replace it with that can be loaded.
    cancelled : callable
        Asked whether to stop.

    Raises
    ------
    UserError
        No checkpoint could be made: PyTorch is not installed, or the weights are none of this program's.
    SaveError
        It cannot be written.
    Cancelled
        `cancelled` returned true; nothing is written.
    """
    from annotations.prediction.checkpoint import load_checkpoint  # late: few sessions convert

    with tempfile.TemporaryDirectory(prefix="oct-annotator-") as name:
        made = Path(name) / "made.onnx"
        _run(weights_path, made, cancelled)
        try:
            checkpoint = load_checkpoint(made)
        except UserError as error:
            # Not by the name of a file that is gone when a person reads it.
            raise _failure(weights_path, f"What came of them cannot be used: {error.problem}") from error
        replace_durably(output, made.read_bytes())
    return replace(checkpoint, path=output)


def _run(weights_path: Path, made: Path, cancelled: Callable[[], bool]) -> None:
    with subprocess.Popen(
        [*_COMMAND, "checkpoint", "convert", "--json", str(weights_path), "-o", str(made)],
        # Python looks for modules where it is started, and that may be a folder of anybody's files.
        cwd=made.parent,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
    ) as process:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                result, messages = process.communicate(timeout=_LOOK_EVERY_S)
                break
            if cancelled():
                process.kill()
                raise Cancelled
    if process.returncode != 0 or not made.is_file():
        reason = _reason(result, messages, process.returncode)
        raise _failure(weights_path, reason.removeprefix(f"{weights_path}: ").removesuffix("."))


def _failure(weights_path: Path, reason: str) -> UserError:
    return UserError("no checkpoint was made of these weights", where=weights_path, remedy=reason)


def _reason(result: str, messages: str, code: int) -> str:
    """Return why the command failed: as it says itself, else the last thing that it wrote, else its code."""
    with contextlib.suppress(ValueError):
        said = json.loads(result)
        if isinstance(said, dict) and isinstance(said.get("error"), str):
            return said["error"]
    written = messages.split("\n")
    return next(
        (line for line in reversed(written) if line.strip()), f"The conversion ended with code {code}"
    )
