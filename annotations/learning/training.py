"""The training of a network, on synthetic volumes first and then on annotated ones; it can be interrupted."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples import AnnotatedExamples, Example
from annotations.learning.networks import build_network
from annotations.learning.objective import HeatmapObjective
from annotations.learning.processor import channels_last, chosen_device, chosen_precision
from annotations.learning.settings import OptimizationSettings, TrainingSettings
from annotations.learning.synthetic_stream import SyntheticSeries, SyntheticStream, worker_count
from annotations.learning.training_folder import Progress, Row, TrainingFolder
from annotations.learning.validation import ValidationErrors, validate
from annotations.learning.weight_average import WeightAverage

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a training: epochs over the same number of volumes.

    Attributes
    ----------
    name : str
        ``synthetic`` or ``annotated``.
    epochs : int
    annotated : tuple of Example
        Seen once an epoch.
    synthetic : int
        How many new ones come with them.
    synthetic_before : int
        How many were seen in earlier parts.
    validation : tuple of Example
    learning_rate : float
        The largest one.
    """

    name: str
    epochs: int
    annotated: tuple[Example, ...]
    synthetic: int
    synthetic_before: int
    validation: tuple[Example, ...]
    learning_rate: float

    @property
    def volumes(self) -> int:
        """How many an epoch has."""
        return len(self.annotated) + self.synthetic

    def order(self, seed: int, epoch: int) -> NDArray[np.int64]:
        """Return which annotated example comes when in an epoch, and -1 where the next synthetic one does."""
        rng = np.random.Generator(np.random.SFC64([seed, epoch]))
        order = rng.permutation(self.volumes)
        return np.where(order < len(self.annotated), order, -1)


def learning_rate_at(share: float, largest: float, settings: OptimizationSettings) -> float:
    """Return the learning rate after a share of a part's steps: a straight rise, then half a cosine."""
    if share < settings.warm_up_share:
        return largest * share / settings.warm_up_share
    down = (share - settings.warm_up_share) / (1 - settings.warm_up_share)
    return largest * (settings.final_share + (1 - settings.final_share) * (1 + math.cos(math.pi * down)) / 2)


class Training:
    """A training, from where it stands to its end.

    Attributes
    ----------
    progress : Progress
    best : dict of str to Tensor
        The weights that did best on the validation volumes.
    network : PoseNetwork
        With the weights of the last step.
    network_settings : NetworkSettings
    folder : TrainingFolder

    Parameters
    ----------
    settings : TrainingSettings
    tool : ToolSpecification
    annotated : AnnotatedExamples
    checkpoint : Path
        Beside it the training keeps its files; it is not written here.
    say : callable
        Told one line at a time how it goes.
    restart : bool
        Whether to begin again where a training was interrupted.

    Raises
    ------
    UserError
        The settings fit neither the tool nor each other, or a state that is there does not fit them.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        tool: ToolSpecification,
        annotated: AnnotatedExamples,
        checkpoint: Path,
        say: Say,
        restart: bool = False,
    ) -> None:
        self.settings, self.tool, self.annotated, self._say = settings, tool, annotated, say
        self._device = chosen_device(settings.device)
        self._precision = chosen_precision(settings.optimization.precision, self._device)
        torch.manual_seed(settings.seed)
        self.network_settings = settings.network_settings(len(tool.keypoint_names), outputs=0)
        network = build_network(self.network_settings)
        if network.heatmap_reduction != settings.heatmaps.reduction:
            raise UserError(
                f"a {settings.network.kind!r} network's heatmaps are reduced by {network.heatmap_reduction}",
                where="heatmaps.reduction",
                remedy="Say so in the settings",
            )
        # On a processor the network learns half as fast again with the channels last in memory.
        self.network = channels_last(network.to(self._device))
        self._average = WeightAverage(self.network, settings.optimization.average_decay)
        self._objective = HeatmapObjective(settings, tool, self._device)
        self._optimizer = torch.optim.AdamW(
            self.network.parameters(),
            lr=settings.optimization.learning_rate,
            weight_decay=settings.optimization.weight_decay,
        )
        self._series = SyntheticSeries(tool, settings.sampling, settings.synthetic.seed)
        self._parts = self._planned()
        self.folder = TrainingFolder(checkpoint, settings, f"{tool.fingerprint} {annotated.fingerprint}")
        self.progress = Progress()
        self.best = self._average.network.state_dict()
        if not restart:
            self._go_on()

    def run(self, stopped: Callable[[], bool] = lambda: False) -> bool:
        """Train to the end, or until asked to stop; returns whether the end was reached.

        After every epoch, and before it returns, the state is saved.
        """
        self.folder.write_settings()
        while self.progress.part < len(self._parts):
            if not self._run_part(self._parts[self.progress.part], stopped):
                return False
        return True

    def _run_part(self, part: Part, stopped: Callable[[], bool]) -> bool:
        progress = self.progress
        done = part.synthetic_before + progress.epoch * part.synthetic
        if progress.step:
            order = part.order(self.settings.seed, progress.epoch)
            done += int((order[: progress.step * self.settings.optimization.batch] < 0).sum())
        workers = worker_count(self.settings.synthetic.workers) if part.synthetic else 0
        with SyntheticStream(self._series, done, workers) as stream:
            while progress.epoch < part.epochs:
                if not self._run_epoch(part, stream, stopped):
                    self._save()
                    return False
                self._finish_epoch(part)
                if self._is_enough(part):
                    break
                self._save()
        progress.part += 1
        progress.epoch = progress.best_epoch = 0
        progress.best_score = None
        self._save()
        return True

    def _run_epoch(self, part: Part, stream: SyntheticStream, stopped: Callable[[], bool]) -> bool:
        progress, batch = self.progress, self.settings.optimization.batch
        order = part.order(self.settings.seed, progress.epoch)
        steps = math.ceil(len(order) / batch)
        self.network.train()
        while progress.step < steps:
            began = time.perf_counter()
            chosen = order[progress.step * batch : (progress.step + 1) * batch]
            examples = [part.annotated[place] if place >= 0 else stream.take() for place in chosen]
            share = (progress.epoch + progress.step / steps) / part.epochs
            progress.loss_sum += self._step(
                examples, learning_rate_at(share, part.learning_rate, self.settings.optimization)
            )
            progress.step += 1
            progress.seconds += time.perf_counter() - began
            if stopped():
                return False
        return True

    def _step(self, examples: Sequence[Example], learning_rate: float) -> float:
        # Every step has random numbers of its own: one that follows an interruption is as it would have been.
        progress = self.progress
        drawn = np.random.SeedSequence(
            self.settings.seed, spawn_key=(progress.part, progress.epoch, progress.step)
        )
        torch.manual_seed(int(drawn.generate_state(1, np.uint64)[0] >> np.uint64(1)))
        batch = self._objective.batch(examples)
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate
        self._optimizer.zero_grad(set_to_none=True)
        with torch.autocast(self._device.type, torch.bfloat16, enabled=self._precision == "bfloat16"):
            output = self.network(batch.inputs)
        loss, _ = self._objective.loss(output, batch)
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.settings.optimization.largest_gradient)
        self._optimizer.step()
        self._average.follow(self.network)
        value = loss.item()
        if not math.isfinite(value):
            raise UserError(
                f"the training has come apart: the loss is {value}",
                where=self.folder.path,
                remedy="Take a smaller learning rate (optimization.learning_rate), and begin again",
            )
        return value

    def _finish_epoch(self, part: Part) -> None:
        progress = self.progress
        began = time.perf_counter()
        steps = progress.step
        share = (progress.epoch + 1 - 1 / steps) / part.epochs
        row: Row = {
            "part": part.name,
            "epoch": progress.epoch + 1,
            "volumes": part.volumes,
            "loss": progress.loss_sum / steps,
            "learning_rate": learning_rate_at(share, part.learning_rate, self.settings.optimization),
        }
        progress.epoch, progress.step, progress.loss_sum = progress.epoch + 1, 0, 0.0
        progress.synthetic_volumes += part.synthetic
        if part.validation:
            errors = self._validated(part)
            row |= errors.figures()
            if progress.best_score is None or errors.score < progress.best_score:
                self._keep_as_best(errors.score, errors.summary(), len(part.validation))
        else:
            self._keep_as_best(None, {}, 0)
        progress.seconds += time.perf_counter() - began
        row["seconds"] = round(progress.seconds, 1)
        progress.rows.append(row)
        self._say(_in_words(row, part))

    def _validated(self, part: Part) -> ValidationErrors:
        return validate(
            self._average.network,
            self._objective,
            self.tool,
            part.validation,
            self.settings.optimization.batch,
        )

    def _keep_as_best(
        self, score: float | None, errors: dict[str, tuple[float, float]], volumes: int
    ) -> None:
        progress = self.progress
        progress.best_score, progress.best_epoch = score, progress.epoch
        progress.best_errors, progress.validation_volumes = errors, volumes
        self.best = {name: value.clone() for name, value in self._average.network.state_dict().items()}

    def _is_enough(self, part: Part) -> bool:
        patience = self.settings.stopping.patience
        waited = self.progress.epoch - self.progress.best_epoch
        if patience and waited >= patience and self.progress.epoch < part.epochs:
            self._say(f"{part.name}: no smaller error for {waited} epochs; that is enough")
            return True
        return False

    def _planned(self) -> list[Part]:
        settings, parts = self.settings, []
        synthetic = settings.synthetic
        epochs = math.ceil(synthetic.volumes / synthetic.epoch_volumes)
        if epochs:
            series = SyntheticSeries(self.tool, settings.sampling, settings.validation.seed)
            with SyntheticStream(series, 0, worker_count(synthetic.workers)) as stream:
                held_out = tuple(stream.take() for _ in range(settings.validation.volumes))
            parts.append(
                Part(
                    "synthetic",
                    epochs,
                    (),
                    min(synthetic.volumes, synthetic.epoch_volumes),
                    0,
                    held_out,
                    settings.optimization.learning_rate,
                )
            )
        if self.annotated.training and settings.annotated.epochs:
            count = len(self.annotated.training)
            share = settings.annotated.synthetic_share
            parts.append(
                Part(
                    "annotated",
                    settings.annotated.epochs,
                    self.annotated.training,
                    round(count * share / (1 - share)),
                    epochs * synthetic.epoch_volumes,
                    self.annotated.validation,
                    settings.annotated.learning_rate if parts else settings.optimization.learning_rate,
                )
            )
        return parts

    def _save(self) -> None:
        self.folder.write(
            self.progress,
            {
                "network": self.network.state_dict(),
                "average": self._average.network.state_dict(),
                "average_steps": self._average.steps,
                "optimizer": self._optimizer.state_dict(),
                "best": self.best,
            },
        )
        self.folder.write_log(self.progress.rows)

    def _go_on(self) -> None:
        saved = self.folder.read()
        if saved is None:
            return
        self.progress = saved.progress
        self.network.load_state_dict(saved.tensors["network"])
        self._average.network.load_state_dict(saved.tensors["average"])
        self._average.steps = saved.tensors["average_steps"]
        self._optimizer.load_state_dict(saved.tensors["optimizer"])
        self.best = saved.tensors["best"]
        self._say(f"going on after {len(self.progress.rows)} epochs, from {self.folder.path}")


def _in_words(row: Row, part: Part) -> str:
    said = [f"{part.name} {row['epoch']}/{part.epochs}: loss {row['loss']:.3f}"]
    for name, value in row.items():
        target, _, statistic = name.rpartition("_")
        if statistic == "mean" and isinstance(value, float):
            what, _, unit = target.rpartition("_")
            said.append(f"{what} {value:.2f}{'°' if unit == 'deg' else ' mm'}")
    if isinstance(far := row.get("share_over_2_mm"), float):
        said.append(f"{far:.1%} over 2 mm")
    return ", ".join(said) + f"; {float(row['seconds']):.0f} s"
