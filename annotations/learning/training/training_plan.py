"""What a training consists of: first synthetic volumes, then annotated ones, and how fast it learns when."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError
from annotations.learning.examples.examples import AnnotatedExamples, Example
from annotations.learning.settings.training_settings import OptimizationSettings, TrainingSettings


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a training: epochs over the same number of volumes.

    Attributes
    ----------
    name : str
        ``synthetic`` or ``annotated``.
    epochs : int
    annotated : tuple of Example
        Each of them is seen once an epoch.
    synthetic : int
        How many new synthetic ones come with them.
    synthetic_before : int
        How many were seen before: in earlier parts, or by the network with whose weights it all began.
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
        order = np.random.Generator(np.random.SFC64([seed, epoch])).permutation(self.volumes)
        return np.where(order < len(self.annotated), order, -1)


def planned_parts(
    settings: TrainingSettings,
    annotated: AnnotatedExamples,
    held_out: Callable[[], tuple[Example, ...]],
    seen: int | None = None,
) -> tuple[Part, ...]:
    """Return the parts of a training.

    Parameters
    ----------
    settings : TrainingSettings
    annotated : AnnotatedExamples
    held_out : callable
        Gives the synthetic volumes for validation, where they are needed.
    seen : int, optional
        From how many of the synthetic volumes the network has learned with whose weights the training begins.

    Raises
    ------
    UserError
        There is nothing to train on.
    """
    parts: list[Part] = []
    synthetic = settings.synthetic
    if synthetic.volumes:
        volumes = min(synthetic.volumes, synthetic.epoch_volumes)
        epochs = math.ceil(synthetic.volumes / volumes)
        parts.append(
            Part("synthetic", epochs, (), volumes, seen or 0, held_out(), settings.optimization.learning_rate)
        )
    count = len(annotated.training)
    if count and settings.annotated.epochs:
        share = settings.annotated.synthetic_share
        parts.append(
            Part(
                "annotated",
                settings.annotated.epochs,
                annotated.training,
                round(count * share / (1 - share)),
                (seen or 0) + (parts[0].epochs * parts[0].synthetic if parts else 0),
                annotated.validation,
                settings.annotated.learning_rate
                if parts or seen is not None
                else settings.optimization.learning_rate,
            )
        )
    if not parts:
        raise UserError(
            "there is nothing to train on",
            remedy="Name a study with finished annotations, or ask for synthetic volumes (synthetic.volumes)",
        )
    return tuple(parts)


def learning_rate_at(share: float, largest: float, settings: OptimizationSettings) -> float:
    """Return the learning rate after a share of a part's steps: a straight rise, then half a cosine.

    Parameters
    ----------
    share : float
        In [0, 1).
    largest : float
    settings : OptimizationSettings
        How long it rises, and how much is left at the end.
    """
    if share < settings.warm_up_share:
        return largest * share / settings.warm_up_share
    down = (share - settings.warm_up_share) / (1 - settings.warm_up_share)
    return largest * (settings.final_share + (1 - settings.final_share) * (1 + math.cos(math.pi * down)) / 2)
