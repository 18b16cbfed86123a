"""What a training keeps beside its checkpoint: the state to go on from, the settings, the log."""

import csv
import io
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from annotations.durable_files import replace_durably
from annotations.errors import UserError
from annotations.learning.settings.training_settings import TrainingSettings, parse_settings
from annotations.learning.training.curves import curves_svg

STATE_FILE = "state.pt"
BEST_FILE = "best.pt"
_VERSION = "oct-training/2"
_OF_THE_MACHINE = frozenset(("threads", "device", "synthetic.workers"))
"""Settings that may change while a training is interrupted."""

_DRAW_EVERY_S = 60.0

Row = dict[str, Any]


@dataclass
class Progress:
    """How far a training is, in what can be stored.

    Attributes
    ----------
    part, epoch, step : int
        Those that come next: the part of the training, the epoch in it and the step in that.
    losses : dict of str to float
        Sums over the steps of this epoch that are done.
    seconds : float
        Wall-clock time of the training, without interruptions.
    best_score : float or None
        Smallest error on the validation volumes in this part.
    best_epoch : int
        After how many epochs of this part it was reached.
    best_errors : dict of str to (float, float)
        Mean and standard deviation of each error then.
    validation_volumes : int
        On how many volumes.
    synthetic_volumes : int
        How many were seen in epochs that are done.
    rows : list of dict
        The log.
    """

    part: int = 0
    epoch: int = 0
    step: int = 0
    losses: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    best_score: float | None = None
    best_epoch: int = 0
    best_errors: dict[str, tuple[float, float]] = field(default_factory=dict)
    validation_volumes: int = 0
    synthetic_volumes: int = 0
    rows: list[Row] = field(default_factory=list)

    @property
    def mean_losses(self) -> dict[str, float]:
        """Means over the steps of this epoch that are done."""
        return {name: total / self.step for name, total in self.losses.items()}

    def add_step(self, losses: Mapping[str, float]) -> None:
        """Count a step that is done."""
        for name, loss in losses.items():
            self.losses[name] = self.losses.get(name, 0.0) + loss
        self.step += 1

    def finish_epoch(self, synthetic_volumes: int) -> None:
        """Count an epoch that is done."""
        self.epoch, self.step, self.losses = self.epoch + 1, 0, {}
        self.synthetic_volumes += synthetic_volumes

    def keep_as_best(
        self, score: float | None, errors: Mapping[str, tuple[float, float]], volumes: int
    ) -> None:
        """Remember that the network was never better in this part."""
        self.best_score, self.best_epoch = score, self.epoch
        self.best_errors, self.validation_volumes = dict(errors), volumes

    def begin_next_part(self) -> None:
        """Count a part that is done; the next one has validation volumes of its own."""
        self.part, self.epoch, self.step = self.part + 1, 0, 0
        self.best_score, self.best_epoch = None, 0


@dataclass(frozen=True)
class Saved:
    """A state that was read.

    Attributes
    ----------
    progress : Progress
    tensors : mapping of str to Any
        State dicts: ``network``, ``average``, ``optimizer`` and ``best``.
    average_steps : int
    """

    progress: Progress
    tensors: Mapping[str, Any]
    average_steps: int


class TrainingFolder:
    """The folder ``C.training`` of a checkpoint C.

    Attributes
    ----------
    path : Path

    Parameters
    ----------
    checkpoint : Path
    settings : TrainingSettings
    data : mapping of str to str
        Fingerprints of what a training must not go on with another of, by what to call another.
    """

    def __init__(self, checkpoint: Path, settings: TrainingSettings, data: Mapping[str, str]) -> None:
        self.path = training_folder_path(checkpoint)
        self._settings, self._data = settings, dict(data)
        self._drawn_s = time.monotonic()

    def read(self) -> Saved | None:
        """Return the state to go on from, if there is one. None of the file's code runs.

        Raises
        ------
        UserError
            It cannot be read, or is of other settings or data.
        """
        path = self.path / STATE_FILE
        if not path.exists():
            return None
        remedy = "Start again from nothing with --restart, or give the checkpoint another name"
        try:
            content = torch.load(path, weights_only=True, map_location="cpu")
            if content["version"] != _VERSION:
                raise ValueError(f"its version is {content['version']!r}, not {_VERSION!r}")
            settings = parse_settings(content["settings"], path)
            saved = Saved(Progress(**content["progress"]), content["tensors"], content["average_steps"])
            data = dict(content["data"])
        except Exception as error:
            raise UserError(
                f"it is no state of a training, or one of another version of this program "
                f"({type(error).__name__})",
                where=path,
                remedy=remedy,
            ) from error
        if different := _difference(settings, self._settings):
            raise UserError(f"the training was begun with {different}", where=path, remedy=remedy)
        for other, now in self._data.items():
            if data.get(other) != now:
                raise UserError(f"the training was begun with {other}", where=path, remedy=remedy)
        return saved

    def begin(self) -> None:
        """Keep the settings: what cannot be written is to show before hours of work, as a SaveError."""
        replace_durably(self.path / "settings.toml", self._settings.as_toml().encode())

    def write(
        self, progress: Progress, tensors: Mapping[str, Any], average_steps: int, is_last: bool
    ) -> None:
        """Replace the state, and after it what is made from it; SaveError where that is not possible.

        The curves, which take longer than a short epoch, are drawn now and then, and at last.
        """
        stream = io.BytesIO()
        torch.save(
            {
                "version": _VERSION,
                "settings": self._settings.as_toml(),
                "data": self._data,
                "progress": vars(progress),
                "tensors": dict(tensors),
                "average_steps": average_steps,
            },
            stream,
        )
        replace_durably(self.path / STATE_FILE, stream.getvalue())
        if progress.rows:
            replace_durably(self.path / "log.csv", _csv_bytes(progress.rows))
            if is_last or time.monotonic() > self._drawn_s + _DRAW_EVERY_S:
                replace_durably(self.path / "curves.svg", curves_svg(progress.rows))
                self._drawn_s = time.monotonic()


def training_folder_path(checkpoint: Path) -> Path:
    """Return where the training of a checkpoint keeps its files."""
    return checkpoint.with_name(checkpoint.name + ".training")


def _csv_bytes(rows: Sequence[Row]) -> bytes:
    names = list(dict.fromkeys(name for row in rows for name in row))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow(
            {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()}
        )
    return stream.getvalue().encode()


def _difference(before: TrainingSettings, now: TrainingSettings) -> str:
    """Say in which field settings differ in a way that a training would show; empty where in none."""
    first, second = (_fields(settings.model_dump(mode="json")) for settings in (before, now))
    for name in first | second:
        if first.get(name) != second.get(name) and name not in _OF_THE_MACHINE:
            return f"{name} = {first.get(name)!r}, and is now to go on with {second.get(name)!r}"
    return ""


def _fields(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, Mapping):
            found |= _fields(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found
