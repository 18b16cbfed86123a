"""The settings of a training: one TOML file, with defaults that work. Needs no torch."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from annotations.documents.record import Method
from annotations.errors import UserError, first_problem
from annotations.interchange.split import SplitRule, split_rule
from annotations.learning.settings.augmentation_settings import AugmentationSettings
from annotations.learning.settings.loss_settings import LossSettings
from annotations.learning.settings.network_settings import HEATMAP_KINDS, NetworkKind, NetworkSettings
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.synthesis.conditions import TRAINING_CONDITIONS, SceneConditions
from annotations.volumes.sampling import OMES_SAMPLING, Sampling
from annotations.volumes.spacing import OMES_SPACING_UM

Count = Annotated[int, Field(ge=0, strict=True)]
AtLeastOne = Annotated[int, Field(ge=1, strict=True)]
Positive = Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1, strict=True)]
Seed = Annotated[int, Field(ge=0, lt=1 << 32, strict=True)]


_ARRAY = re.compile(r"\[\n([^\[\]=]*),\n\]")
"""An array of numbers as it is written: each of them on a line of its own."""


class SettingsError(UserError):
    """Settings that cannot be read, or that say what cannot be."""


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class NetworkChoice(_Section):
    """Which network is trained.

    Attributes
    ----------
    kind : str
        See `annotations.learning.settings.network_settings`.
    dropout : float
        Share of channels that are left out at random while training.
    width : float
        Scales the number of channels.
    """

    kind: NetworkKind = "lean"
    dropout: Share = 0.0
    width: Annotated[float, Field(gt=0, le=8, strict=True)] = 1.0


class SyntheticSettings(_Section):
    """Synthetic volumes, made while training and seen once each.

    Attributes
    ----------
    volumes : int
        How many the training begins with; 0 for none.
    epoch_volumes : int
        After how many the network is validated and the training saved.
    seed : int
        Number of the series; the validation has one of its own.
    workers : int
        Processes that make volumes: -1 for one fewer than there are processors, 0 for none besides this.
    conditions : SceneConditions
        What varies between them. A table replaces all of it: what it leaves out does not vary.
    """

    volumes: Count = 40_000
    epoch_volumes: AtLeastOne = 2000
    seed: Seed = 1
    workers: Annotated[int, Field(ge=-1, le=64, strict=True)] = -1
    conditions: SceneConditions = TRAINING_CONDITIONS


class AnnotatedSettings(_Section):
    """The annotated volumes of studies, on which the training goes on.

    Attributes
    ----------
    epochs : int
        How often each volume is seen.
    method : str
        Whose keypoints: those that were placed, or those of boxes.
    annotator : str or None
        Who speaks for every volume; None for the consensus, else the only person who is done.
    shares : tuple of float
        Of training, validation and, if there is a third, test, by volume; volumes with the same data stay
        together. The third is not touched.
    split_seed : int
        Which of the possible splits.
    learning_rate : float
        Largest, after a training on synthetic volumes or with the weights of another; else that of
        ``optimization`` counts.
    synthetic_share : float
        Share of each epoch's volumes that are synthetic, on top of the annotated ones.
    """

    epochs: Count = 100
    method: Method = "keypoints"
    annotator: str | None = None
    shares: tuple[float, ...] = (0.8, 0.2)
    split_seed: Seed = 0
    learning_rate: Positive = 5e-4
    synthetic_share: Share = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        try:
            split_rule(self.shares, self.split_seed)
        except UserError as error:
            raise ValueError(error.problem) from error
        return self

    @property
    def rule(self) -> SplitRule:
        """Which volumes are for training, which for validation."""
        return split_rule(self.shares, self.split_seed)


class OptimizationSettings(_Section):
    """How the weights are changed: AdamW with warm-up and cosine (Loshchilov & Hutter 2017, 2019).

    Attributes
    ----------
    learning_rate : float
        The largest one.
    final_share : float
        Share of it that is left at the end.
    warm_up_share : float
        Share of the steps in which it rises.
    weight_decay : float
    batch : int
        Volumes a step.
    largest_gradient : float
        Norm at which the gradient is clipped.
    precision : str
        ``bfloat16`` for half the work where the processor has it; elsewhere it is far slower. ``auto`` asks.
    average_decay : float
        The weights that are validated and kept are a moving average with this decay a step; 0 for the last.
    """

    learning_rate: Positive = 2e-3
    final_share: Annotated[float, Field(ge=0, le=1, strict=True)] = 0.01
    warm_up_share: Share = 0.03
    weight_decay: NotNegative = 1e-4
    batch: AtLeastOne = 8
    largest_gradient: Positive = 5.0
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    average_decay: Share = 0.998


class ValidationSettings(_Section):
    """The synthetic volumes that tell how the training goes on synthetic ones.

    Attributes
    ----------
    volumes : int
    seed : int
        Another than that of the volumes for training.
    """

    volumes: AtLeastOne = 200
    seed: Seed = 1_000_001


class StoppingSettings(_Section):
    """When there is no more to gain.

    Attributes
    ----------
    patience : int
        Epochs without a smaller error on the validation volumes after which a part of the training ends;
        0 for never.
    """

    patience: Count = 0


class TrainingSettings(_Section):
    """Everything that a training depends on, besides the data and the tool.

    Attributes
    ----------
    seed : int
        Of the first weights and of every random choice but those with a seed of their own.
    threads : int
        Of the network's arithmetic on a processor; 0 for as many as there are.
    device : str
        ``cuda`` for a graphics card; ``auto`` takes it where there is one.
    """

    seed: Seed = 0
    threads: Count = 0
    device: Literal["auto", "cpu", "cuda"] = "auto"
    network: NetworkChoice = NetworkChoice()
    heatmaps: HeatmapConvention = HeatmapConvention()
    sampling: Sampling = OMES_SAMPLING
    loss: LossSettings = LossSettings()
    augmentation: AugmentationSettings = AugmentationSettings()
    synthetic: SyntheticSettings = SyntheticSettings()
    annotated: AnnotatedSettings = AnnotatedSettings()
    optimization: OptimizationSettings = OptimizationSettings()
    validation: ValidationSettings = ValidationSettings()
    stopping: StoppingSettings = StoppingSettings()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.validation.seed == self.synthetic.seed:
            raise ValueError("validation.seed is that of the volumes for training: take another")
        if self.synthetic.volumes and (self.sampling.dtype, self.sampling.depth_axis) != ("uint8", 2):
            raise ValueError(
                "synthetic volumes are of uint8 and have their depth along axis 2: say synthetic.volumes = 0"
            )
        if self.synthetic.volumes and np.any(np.greater(OMES_SPACING_UM, self.sampling.spacing_um)):
            raise ValueError(
                f"sampling.spacing_um is finer than the voxels of synthetic volumes, {OMES_SPACING_UM} µm: "
                "say synthetic.volumes = 0, or take fewer samples"
            )
        if self.gives_heatmaps and self.heatmaps.decoding == "argmax" and self.loss.needs_coordinates:
            raise ValueError(
                "an argmax has no gradient: say loss.coordinate = 0.0 and loss.pose = 0.0, or another "
                "heatmaps.decoding"
            )
        # Refuse an input that the network cannot take.
        self.network_settings(keypoints=1, outputs=0 if self.gives_heatmaps else 1)
        return self

    @property
    def gives_heatmaps(self) -> bool:
        """Whether the network gives heatmaps of the keypoints, rather than the numbers of a pose."""
        return self.network.kind in HEATMAP_KINDS

    def network_settings(self, keypoints: int, outputs: int) -> NetworkSettings:
        """Return what the network is built from."""
        return NetworkSettings(
            kind=self.network.kind,
            keypoints=keypoints,
            outputs=outputs,
            input_shape=self.sampling.padded_shape,
            dropout=self.network.dropout,
            width=self.network.width,
        )

    def going_on(self) -> Self:
        """Return the settings for a network that has learned: synthetic volumes only if they say how many."""
        if "volumes" in self.synthetic.model_fields_set:
            return self
        synthetic = self.synthetic.model_copy(update={"volumes": 0})
        return self.model_copy(update={"synthetic": synthetic})

    def as_toml(self) -> str:
        """Return the settings as TOML, from which they are read again as they are."""
        written = tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))
        return _ARRAY.sub(lambda found: f"[{' '.join(found[1].split())}]", written)


def read_settings(path: Path) -> TrainingSettings:
    """Read settings from a TOML file; what it leaves out is as by default.

    Raises
    ------
    SettingsError
        The file is absent, not readable, not TOML, or says what cannot be.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SettingsError(
            f"it could not be read ({getattr(error, 'strerror', None) or error})",
            where=path,
            remedy="Choose another file",
        ) from error
    return parse_settings(text, path)


def parse_settings(text: str, where: object) -> TrainingSettings:
    """Read settings from TOML text; ``where`` is named in a SettingsError."""
    try:
        content: Mapping[str, Any] = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsError(
            f"it is not valid TOML ({error})", where=where, remedy="Correct the file"
        ) from error
    try:
        return TrainingSettings.model_validate(content)
    except ValidationError as error:
        raise SettingsError(
            first_problem(error),
            where=where,
            remedy="Correct it; all fields and their defaults are listed by "
            "'annotations train --print-config'",
        ) from error
