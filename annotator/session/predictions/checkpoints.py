"""The session's checkpoints: what one is, and a new one of the weights that a training left."""

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.errors import UserError
from annotator.session.files.saving import SessionSaving
from annotator.session.jobs import Job
from annotator.session.predictions.conversion_process import converted

if TYPE_CHECKING:
    from annotations.prediction.checkpoint import Checkpoint

CHECKPOINT_SUFFIX, WEIGHTS_SUFFIX = ".onnx", ".pt"
"""By which checkpoints, and the weights that they are made of, are known before they are read."""

_UNDER_WAY = "A checkpoint is being made already"


class Checkpoints(QObject):
    """Opens checkpoints and weights; what is open beside them stays as it is.

    Signals
    -------
    opened : Checkpoint
        A checkpoint was opened, and this is what it is.
    conversion_requested : Path
        Weights were opened, which are no checkpoint yet: answer with `convert`, or not at all.
    converted : Checkpoint
        Weights have become this one.
    """

    opened = Signal(object)
    conversion_requested = Signal(object)
    converted = Signal(object)

    def __init__(self, session: SessionSaving, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._job: Job | None = None

    def takes(self, path: Path) -> bool:
        """Say whether a path is, by its name, that of a checkpoint or of weights."""
        return path.suffix.lower() in (CHECKPOINT_SUFFIX, WEIGHTS_SUFFIX)

    def open(self, path: Path) -> None:
        """Read what is taken; ``opened`` or ``conversion_requested`` follows, or an error."""
        path = path.absolute()
        are_weights = path.suffix.lower() == WEIGHTS_SUFFIX
        self._session.jobs.start(
            f"Reading {path.name}",
            lambda _progress, _cancelled: _found_weights(path) if are_weights else _read(path),
            done=self.conversion_requested.emit if are_weights else self.opened.emit,
            failed=self._report,
        )

    def convert(self, weights_path: Path, output: Path) -> None:
        """Make a checkpoint of weights in the background; ``converted`` follows, or an error.

        A file that has the checkpoint's name is replaced: whoever asks has asked the person.
        """
        if self._job is not None:
            self._session.post_message(_UNDER_WAY)
            return
        if output == weights_path:
            self._report(
                UserError(
                    "the checkpoint would take the place of the weights that it is made of",
                    where=output,
                    remedy="Choose another name for it",
                )
            )
            return
        self._job = self._session.jobs.start(
            f"Making {output.name}",
            lambda _progress, cancelled: _made(weights_path, output, cancelled),
            done=self._on_job_done,
            failed=self._on_job_failed,
            cancelled=self._on_job_cancelled,
            writes=True,
        )

    def _report(self, error: Exception) -> None:
        if not isinstance(error, UserError):
            raise error
        self._session.report(error)

    def _on_job_done(self, checkpoint: "Checkpoint") -> None:
        self._job = None
        self._session.post_message(f"The checkpoint is in {checkpoint.path}")
        self.converted.emit(checkpoint)

    def _on_job_failed(self, error: Exception) -> None:
        self._job = None
        self._report(error)

    def _on_job_cancelled(self) -> None:
        self._job = None
        self._session.post_message("Cancelled: nothing was written")


def _read(path: Path) -> "Checkpoint":
    from annotations.prediction.checkpoint import load_checkpoint  # late: few sessions open one

    _prepare_use()
    return load_checkpoint(path)


def _made(weights_path: Path, output: Path, cancelled: Callable[[], bool]) -> "Checkpoint":
    _prepare_use()
    return converted(weights_path, output, cancelled)


def _prepare_use() -> None:
    # What whoever uses a checkpoint needs next: the window does not wait for it.
    for name in ("annotations.prediction.errors.study_errors", "annotations.prediction.inference_process"):
        importlib.import_module(name)


def _found_weights(path: Path) -> Path:
    try:
        is_there = path.is_file()
    except OSError as error:
        raise UserError(
            f"it could not be read ({error.strerror or error})",
            where=path,
            remedy="Check that you may read it",
        ) from error
    if not is_there:
        raise UserError("there is no such file", where=path, remedy="Check its name")
    return path
