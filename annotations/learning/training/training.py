"""The training of a network, on synthetic volumes first and then on annotated ones; it can be interrupted."""

import math
import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.learning.architectures.networks import build_network
from annotations.learning.examples.examples import AnnotatedExamples, Example
from annotations.learning.examples.synthetic_stream import SyntheticSeries, SyntheticStream, worker_count
from annotations.learning.losses.objective import objective_of
from annotations.learning.settings.training_settings import TrainingSettings
from annotations.learning.training.origin import Origin
from annotations.learning.training.processor import channels_last, chosen_device, chosen_precision
from annotations.learning.training.stages import learned_volumes
from annotations.learning.training.training_folder import Progress, Row, TrainingFolder
from annotations.learning.training.training_plan import Part, learning_rate_at, planned_parts
from annotations.learning.training.validation import validate
from annotations.learning.training.weight_average import WeightAverage

_SAY_EVERY_S = 60.0
_NO_MEMORY = re.compile("can't allocate memory|ALLOC_FAILED")
"""How torch says it of the processor, and of libraries on the graphics card."""


class Training:
    """A training, from where it stands to its end.

    Every step has random numbers of its own, which follow from the seed and its place. So a training that was
    interrupted at any step goes on as it would have gone, on the same machine with as many threads.

    Attributes
    ----------
    settings : TrainingSettings
    tool : ToolSpecification
    annotated : AnnotatedExamples
    network : PoseNetwork
        With the weights of the last step; each part begins with the best of the one before.
    network_settings : NetworkSettings
    folder : TrainingFolder
    progress : Progress
    best : dict of str to Tensor
        The weights that did best on the validation volumes.
    origin : Origin or None
        Whose weights it began with.

    Parameters
    ----------
    settings, tool, annotated, origin
        See above.
    checkpoint : Path
        Beside it the training keeps its files; it is not written here.
    say : callable
        Told one line at a time how it goes.
    restart : bool
        Whether to begin again where a training was interrupted.

    Raises
    ------
    UserError
        The settings do not fit the tool, the weights to begin with or each other, a state that is there does
        not fit them, or there is nothing to train on.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        tool: ToolSpecification,
        annotated: AnnotatedExamples,
        checkpoint: Path,
        say: Callable[[str], None] = lambda _line: None,
        restart: bool = False,
        origin: Origin | None = None,
    ) -> None:
        self.settings, self.tool, self.annotated, self._say = settings, tool, annotated, say
        self.origin = origin
        self._device = chosen_device(settings.device)
        self._precision = chosen_precision(settings.optimization.precision, self._device)
        self._objective = objective_of(settings, tool, self._device)
        self.network_settings = self._objective.network_settings
        torch.manual_seed(settings.seed)
        network = build_network(self.network_settings)
        if network.heatmap_reduction not in (None, settings.heatmaps.reduction):
            raise UserError(
                f"a {settings.network.kind!r} network's heatmaps are reduced by {network.heatmap_reduction}",
                where="heatmaps.reduction",
                remedy="Say so in the settings",
            )
        if origin is not None:
            origin.check(settings, tool)
            origin.fill(network)
        # On a processor the network learns half as fast again with the channels last in memory.
        self.network = channels_last(network.to(self._device))
        self._average = WeightAverage(self.network, settings.optimization.average_decay)
        self._optimizer = self._new_optimizer()
        data = {
            "another tool": tool.fingerprint,
            "other annotations": annotated.fingerprint,
            "other weights (--from)": "" if origin is None else origin.sha256,
        }
        self.folder = TrainingFolder(checkpoint, settings, data)
        self.progress = Progress()
        self.best = self._average.weights()
        is_begun = not restart and self._go_on()
        if origin is not None and not is_begun:
            origin.say_differences(settings, tool, say)
        seen = (
            None if origin is None else learned_volumes(origin.description.training, settings.synthetic.seed)
        )
        self._parts = planned_parts(settings, annotated, self._held_out, seen)

    def run(self, stopped: Callable[[], bool] = lambda: False) -> bool:
        """Train to the end, or until asked to stop; returns whether the end was reached.

        After every epoch, and before it returns, the state is saved.

        Raises
        ------
        UserError
            The loss is no number any more, a step has too many volumes or too few, or synthetic volumes
            cannot be made; SaveError where the state cannot be saved.
        """
        self.folder.begin()
        while self.progress.part < len(self._parts):
            if not self._run_part(self._parts[self.progress.part], stopped):
                return False
        return True

    def _run_part(self, part: Part, stopped: Callable[[], bool]) -> bool:
        progress = self.progress
        has_learned = progress.part or self.origin is not None
        if has_learned and not progress.epoch and not progress.step and part.validation:
            # What was learned so far may be better than anything that comes.
            self._judge(part, {"part": part.name, "epoch": 0, "volumes": 0})
        workers = worker_count(self.settings.synthetic.workers) if part.synthetic else 0
        series = self._series(self.settings.synthetic.seed)
        with SyntheticStream(series, self._synthetic_done(part), workers) as stream:
            while progress.epoch < part.epochs and not self._is_enough(part):
                if not self._run_epoch(part, stream, stopped):
                    self._save()
                    return False
                self._finish_epoch(part)
                self._save()
        progress.begin_next_part()
        is_last = progress.part == len(self._parts)
        if not is_last:
            # The next part goes on from the best of this one, as if it had ended there.
            self.network.load_state_dict(self.best)
            self._average.begin_again(self.best)
            self._optimizer = self._new_optimizer()
        self._save(is_last)
        return True

    def _run_epoch(self, part: Part, stream: SyntheticStream, stopped: Callable[[], bool]) -> bool:
        progress, batch = self.progress, self.settings.optimization.batch
        order = part.order(self.settings.seed, progress.epoch)
        steps = math.ceil(len(order) / batch)
        self.network.train()
        said = time.perf_counter()
        while progress.step < steps:
            began = time.perf_counter()
            chosen = order[progress.step * batch : (progress.step + 1) * batch]
            examples = [part.annotated[place] if place >= 0 else stream.take() for place in chosen]
            share = (progress.epoch + progress.step / steps) / part.epochs
            rate = learning_rate_at(share, part.learning_rate, self.settings.optimization)
            progress.add_step(self._step(examples, rate))
            now = time.perf_counter()
            progress.seconds += now - began
            if now - said > _SAY_EVERY_S:
                said = now
                self._say(
                    f"{part.name} {progress.epoch + 1}/{part.epochs}: {progress.step * batch} of "
                    f"{part.volumes} volumes, loss {progress.mean_losses['loss']:.3f}"
                )
            if stopped():
                return False
        return True

    def _step(self, examples: Sequence[Example], learning_rate: float) -> dict[str, float]:
        """Learn from some examples; returns the loss and its parts."""
        progress, settings = self.progress, self.settings.optimization
        place = (progress.part, progress.epoch, progress.step)
        drawn = np.random.SeedSequence(self.settings.seed, spawn_key=place)
        # torch draws what is dropped out.
        torch.manual_seed(int(drawn.generate_state(1, np.uint32)[0]))
        for group in self._optimizer.param_groups:
            group["lr"] = learning_rate
        self._optimizer.zero_grad(set_to_none=True)
        rng = np.random.Generator(np.random.SFC64(drawn))
        try:
            value, parts = self._gradients(examples, rng)
        except (RuntimeError, ValueError) as error:
            if refusal := _batch_refusal(error, len(examples)):
                raise refusal from error
            raise
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), settings.largest_gradient)
        self._optimizer.step()
        self._average.follow(self.network)
        return {"loss": value} | {f"loss_{name}": part for name, part in parts.items()}

    def _gradients(
        self, examples: Sequence[Example], rng: np.random.Generator
    ) -> tuple[float, dict[str, float]]:
        """Leave the gradients of the loss of some examples with the weights; returns it and its parts."""
        loss, parts = self._objective.loss(self._output_of, examples, rng)
        value = loss.item()
        if not math.isfinite(value):
            raise UserError(
                f"the training has come apart: the loss is {value}",
                where=self.folder.path,
                remedy="Begin again (--restart) with a smaller optimization.learning_rate",
            )
        loss.backward()  # type: ignore[no-untyped-call]
        return value, parts

    def _new_optimizer(self) -> torch.optim.AdamW:
        how = self.settings.optimization
        return torch.optim.AdamW(
            self.network.parameters(), lr=how.learning_rate, weight_decay=how.weight_decay
        )

    def _output_of(self, inputs: Tensor) -> Tensor:
        with torch.autocast(self._device.type, torch.bfloat16, enabled=self._precision == "bfloat16"):
            output: Tensor = self.network(inputs)
        return output

    def _finish_epoch(self, part: Part) -> None:
        progress = self.progress
        losses = progress.mean_losses
        progress.finish_epoch(part.synthetic)
        self._judge(
            part,
            {"part": part.name, "epoch": progress.epoch, "volumes": part.volumes}
            | losses
            | {
                "learning_rate": learning_rate_at(
                    (progress.epoch - 0.5) / part.epochs, part.learning_rate, self.settings.optimization
                )
            },
        )

    def _judge(self, part: Part, row: Row) -> None:
        """Validate, keep the weights if they are the best, and add a row to the log."""
        progress = self.progress
        began = time.perf_counter()
        if part.validation:
            batch = self.settings.optimization.batch
            errors = validate(self._average.network, self._objective, self.tool, part.validation, batch)
            row |= errors.figures()
            if progress.best_score is None or errors.score < progress.best_score:
                self.best = self._average.weights()
                progress.keep_as_best(errors.score, errors.summary(), errors.volumes)
        else:
            self.best = self._average.weights()
            progress.keep_as_best(None, {}, 0)
        progress.seconds += time.perf_counter() - began
        progress.rows.append(row | {"seconds": round(progress.seconds, 1)})
        self._say(_in_words(progress.rows[-1], part))

    def _is_enough(self, part: Part) -> bool:
        patience = self.settings.stopping.patience
        waited = self.progress.epoch - self.progress.best_epoch
        if not patience or waited < patience:
            return False
        self._say(f"{part.name}: no smaller error in {waited} epochs, so that this part ends here")
        return True

    def _series(self, seed: int) -> SyntheticSeries:
        return SyntheticSeries(self.tool, self.settings.sampling, seed, self.settings.synthetic.conditions)

    def _held_out(self) -> tuple[Example, ...]:
        settings = self.settings
        workers = worker_count(settings.synthetic.workers)
        with SyntheticStream(self._series(settings.validation.seed), 0, workers) as stream:
            return tuple(stream.take() for _ in range(settings.validation.volumes))

    def _synthetic_done(self, part: Part) -> int:
        """Return how many synthetic volumes were seen."""
        progress = self.progress
        order = part.order(self.settings.seed, progress.epoch)
        of_this_epoch = order[: progress.step * self.settings.optimization.batch]
        return part.synthetic_before + progress.epoch * part.synthetic + int((of_this_epoch < 0).sum())

    def _save(self, is_last: bool = False) -> None:
        self.folder.write(
            self.progress,
            {
                "network": self.network.state_dict(),
                "average": self._average.network.state_dict(),
                "optimizer": self._optimizer.state_dict(),
                "best": self.best,
            },
            self._average.steps,
            is_last,
        )

    def _go_on(self) -> bool:
        """Take over the state that is there; returns whether there was one."""
        saved = self.folder.read()
        if saved is None:
            return False
        try:
            self.network.load_state_dict(saved.tensors["network"])
            self._average.network.load_state_dict(saved.tensors["average"])
            self._optimizer.load_state_dict(saved.tensors["optimizer"])
            self.best = dict(saved.tensors["best"])
        except (RuntimeError, LookupError, ValueError, TypeError, AttributeError) as error:
            raise UserError(
                f"the state is not that of this network ({type(error).__name__}): another version of this "
                "program may have begun the training",
                where=self.folder.path,
                remedy="Go on with that version, or start again from nothing with --restart",
            ) from error
        self.progress, self._average.steps = saved.progress, saved.average_steps
        self._say(f"going on from {self.folder.path}, after {self.progress.seconds:.0f} s of training")
        return True


def _batch_refusal(error: Exception, batch: int) -> UserError | None:
    """Return what to say where a step has too many volumes or too few, and None of any other error."""
    if "more than 1 value per channel" in str(error):
        return UserError(
            "a step has one volume, of which the network leaves one value a channel, and that has no spread",
            where="optimization.batch",
            remedy="Choose a batch of which an epoch does not leave one volume over, or take more samples",
        )
    if isinstance(error, torch.OutOfMemoryError) or _NO_MEMORY.search(str(error)):
        return UserError(
            f"the memory does not hold a step of {batch} volumes",
            where="optimization.batch",
            remedy="Begin again (--restart) with a smaller one, or with a smaller network.width",
        )
    return None


def _in_words(row: Row, part: Part) -> str:
    said = [f"{part.name} {row['epoch']}/{part.epochs}:"]
    if "loss" in row:
        said.append(f"loss {row['loss']:.3f},")
    for name, value in row.items():
        error, _, statistic = name.rpartition("_")
        if statistic == "mean":
            what, _, unit = error.rpartition("_")
            if math.isnan(value):
                said.append(f"{what} not found,")
            else:
                said.append(f"{what} {value:.2f}°," if unit == "deg" else f"{what} {value:.3f} mm,")
    if "share_over_2_mm" in row:
        said.append(f"{row['share_over_2_mm']:.1%} over 2 mm,")
    return " ".join([*said, f"{row['seconds']:.0f} s"])
