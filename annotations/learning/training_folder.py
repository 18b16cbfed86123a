"""What a training keeps beside its checkpoint: the state to go on from, the log, the best weights."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch

from annotations.durable_files import replace_durably
from annotations.errors import UserError
from annotations.learning.settings import TrainingSettings, parse_settings

STATE_FILE = "state.pt"
_VERSION = "oct-training/1"

Row = dict[str, float | int | str]


@dataclass
class Progress:
    """How far a training is, in what can be stored.

    Attributes
    ----------
    part, epoch, step : int
        Those that come next: the part of the training, the epoch in it and the step in that.
    loss_sum : float
        Of the steps of this epoch that are done.
    seconds : float
        Wall-clock time of the training, without interruptions.
    best_score : float or None
        Smallest error on the validation volumes in this part.
    best_epoch : int
        The last epoch that counted as the best, or from which patience is counted.
    best_errors : dict of str to (float, float)
        Its errors on the validation volumes: mean and standard deviation.
    validation_volumes : int
        How many those were.
    synthetic_volumes : int
        How many were seen.
    rows : list of dict
        The log.
    """

    part: int = 0
    epoch: int = 0
    step: int = 0
    loss_sum: float = 0.0
    seconds: float = 0.0
    best_score: float | None = None
    best_epoch: int = 0
    best_errors: dict[str, tuple[float, float]] = field(default_factory=dict)
    validation_volumes: int = 0
    synthetic_volumes: int = 0
    rows: list[Row] = field(default_factory=list)


@dataclass(frozen=True)
class Saved:
    """A state that was read.

    Attributes
    ----------
    progress : Progress
    tensors : mapping of str to Any
        State dicts by name.
    """

    progress: Progress
    tensors: Mapping[str, Any]


class TrainingFolder:
    """The folder ``C.training`` of a checkpoint C.

    Parameters
    ----------
    checkpoint : Path
    settings : TrainingSettings
    data : str
        Which data, so that a training does not go on with others.
    """

    def __init__(self, checkpoint: Path, settings: TrainingSettings, data: str) -> None:
        self.path = checkpoint.with_name(checkpoint.name + ".training")
        self._settings, self._data = settings, data

    def read(self) -> Saved | None:
        """Return the state to go on from, if there is one.

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
                raise ValueError(f"its version is {content['version']!r}")
            settings = parse_settings(content["settings"], path)
            saved = Saved(Progress(**content["progress"]), content["tensors"])
        except Exception as error:
            raise UserError(f"it is no state of a training ({error})", where=path, remedy=remedy) from error
        if different := _difference(settings, self._settings):
            raise UserError(f"the training was begun with {different}", where=path, remedy=remedy)
        if content["data"] != self._data:
            raise UserError("the training was begun with other data", where=path, remedy=remedy)
        return saved

    def write(self, progress: Progress, tensors: Mapping[str, Any]) -> None:
        """Replace the state."""
        stream = io.BytesIO()
        torch.save(
            {
                "version": _VERSION,
                "settings": self._settings.as_toml(),
                "data": self._data,
                "progress": vars(progress),
                "tensors": dict(tensors),
            },
            stream,
        )
        replace_durably(self.path / STATE_FILE, stream.getvalue())

    def write_log(self, rows: Sequence[Row]) -> None:
        """Replace ``log.csv``."""
        names = list(dict.fromkeys(name for row in rows for name in row))
        stream = io.StringIO()
        writer = csv.DictWriter(stream, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()}
            for row in rows
        )
        replace_durably(self.path / "log.csv", stream.getvalue().encode())

    def write_settings(self) -> None:
        """Write ``settings.toml``."""
        replace_durably(self.path / "settings.toml", self._settings.as_toml().encode())


def _difference(before: TrainingSettings, now: TrainingSettings) -> str:
    """Say in which field settings differ in a way that a training would show; empty where in none."""
    first, second = (_fields(settings.model_dump(mode="json"), "") for settings in (before, now))
    for name in first:
        if first[name] != second[name] and name not in ("threads", "device", "synthetic.workers"):
            return f"{name} = {first[name]!r}, not {second[name]!r}"
    return ""


def _fields(content: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, Mapping):
            found |= _fields(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found
