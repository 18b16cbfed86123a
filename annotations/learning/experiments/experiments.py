"""The published comparisons: which networks each trains, with which settings. Needs no torch."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

from annotations.learning.experiments.published_results import PUBLISHED_RESULTS, PublishedResult
from annotations.learning.settings.augmentation_settings import AugmentationSettings
from annotations.learning.settings.loss_settings import LossSettings
from annotations.learning.settings.network_settings import HEATMAP_KINDS, NetworkKind
from annotations.learning.settings.training_settings import (
    AnnotatedSettings,
    NetworkChoice,
    OptimizationSettings,
    SyntheticSettings,
    TrainingSettings,
    ValidationSettings,
)
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.volumes.sampling import PUBLISHED_SAMPLING, Sampling

ExperimentName = Literal["networks", "heads", "targets", "temperatures", "regularisers"]
EXPERIMENT_NAMES: tuple[ExperimentName, ...] = get_args(ExperimentName)

SizeName = Literal["tiny", "small", "full"]

_SYNTHETIC_SEED, _HELD_OUT_SEED = 11, 12
_NO_LIMIT = 1e9
_SIGMA_VOXEL = (1.7, 1.7, 1.7)
"""Of the Gaussian in the publication of V2V-PoseNet; that of the instrument's networks is not published."""
_SHRINK = 0.8

_HALF_SAMPLING = Sampling(
    shape=(28, 70, 42),
    spacing_um=(622.0, 28 * 13.5, 28 * 9.4),
    is_averaged=False,
    padding_before=(2, 5, 3),
    padding_after=(2, 5, 3),
)
"""Half as many samples along axes 1 and 2."""

_COARSE_SAMPLING = Sampling(
    shape=(14, 70, 42),
    spacing_um=(2 * 622.0, 28 * 13.5, 28 * 9.4),
    is_averaged=False,
    padding_before=(1, 5, 3),
    padding_after=(1, 5, 3),
)
"""Half as many along each axis."""


@dataclass(frozen=True)
class ExperimentSize:
    """How much an experiment takes on.

    Attributes
    ----------
    name : str
    training, validation : int
        Volumes that are made where no study gives any.
    epochs : int
        Over the annotated volumes.
    batch : int
    synthetic : int
        Volumes of a pre-training.
    learning_rate, v2v_learning_rate : float
        Of the other networks and of V2V-PoseNet.
    width : float
        Scales the networks' channels.
    sampling : Sampling
    """

    name: str
    training: int
    validation: int
    epochs: int
    batch: int
    synthetic: int
    learning_rate: float
    v2v_learning_rate: float
    width: float
    sampling: Sampling

    @property
    def in_words(self) -> str:
        """What of it is not as published, as a sentence for a caption."""
        reduced = []
        if self.sampling != PUBLISHED_SAMPLING:
            reduced.append(f"{_by(self.sampling.shape)} samples in place of {_by(PUBLISHED_SAMPLING.shape)}")
        if self.width != 1:
            reduced.append(f"{self.width:g} of the networks' channels")
        said = (
            f"Size {self.name!r}: {self.epochs} epochs, batch {self.batch}, learning rate "
            f"{self.learning_rate:g}, V2V-PoseNet {self.v2v_learning_rate:g}, pre-training on "
            f"{self.synthetic} synthetic volumes"
        )
        if reduced:
            return f"{said}; reduced: {', '.join(reduced)}: the figures are not those of the whole networks."
        return f"{said}; the networks and their input are the published ones."


EXPERIMENT_SIZES: Mapping[SizeName, ExperimentSize] = {
    "tiny": ExperimentSize("tiny", 40, 10, 60, 5, 400, 2e-3, 2e-3, 0.25, _COARSE_SAMPLING),
    "small": ExperimentSize("small", 76, 20, 100, 8, 4000, 1e-3, 1e-3, 0.5, _HALF_SAMPLING),
    "full": ExperimentSize("full", 152, 40, 500, 25, 20_000, 1e-4, 1e-5, 1.0, PUBLISHED_SAMPLING),
}
"""``full`` is as published: volumes, epochs, batch and learning rates. How many synthetic volumes there were
is not published. The others have larger learning rates, because they have fewer steps."""


@dataclass(frozen=True)
class ExperimentRow:
    """One training of an experiment.

    Attributes
    ----------
    key : str
        By which its files are named. Rows of several experiments with one key are the same training.
    label : str
    settings : TrainingSettings
    """

    key: str
    label: str
    settings: TrainingSettings

    @property
    def published(self) -> PublishedResult | None:
        """The published result of the same."""
        return PUBLISHED_RESULTS.get(self.key)


@dataclass(frozen=True)
class Experiment:
    """A published comparison.

    Attributes
    ----------
    name : str
    title : str
    rows : tuple of ExperimentRow
    """

    name: ExperimentName
    title: str
    rows: tuple[ExperimentRow, ...]


def resized(size: ExperimentSize, volumes: int | None = None, epochs: int | None = None) -> ExperimentSize:
    """Return a size with another number of volumes, a fifth of them for validation, or of epochs."""
    if volumes is not None:
        validation = max(1, round(volumes * 0.2))
        size = replace(size, training=volumes - validation, validation=validation)
    return size if epochs is None else replace(size, epochs=epochs)


def experiment(
    name: ExperimentName, size: ExperimentSize, seed: int = 0, annotated: AnnotatedSettings | None = None
) -> Experiment:
    """Return an experiment.

    Published for all: no schedule of the learning rate, no weight decay unless it says so, flips along the
    two axes across the light. The published text does not say how the peaks of heatmaps were found outside of
    the comparison of temperatures: here by their largest value.

    Parameters
    ----------
    name : str
    size : ExperimentSize
    seed : int
        Of the first weights, of every random choice, and of the split.
    annotated : AnnotatedSettings, optional
        Whose annotations are used; epochs, learning rate and seed are the experiment's.
    """
    rows = _Rows(size, seed, annotated or AnnotatedSettings())
    match name:
        case "networks":
            title = "Networks, with and without pre-training on synthetic volumes"
            networks: tuple[tuple[NetworkKind, str], ...] = (
                ("inception3d", "Inception3D, direct regression"),
                ("resnext3d", "ResNeXt3D, direct regression"),
                ("v2v", "V2V-PoseNet, heatmaps"),
            )
            found = [
                rows.row(f"{kind}-pretrained" if is_first else kind, f"{label}{words}", kind, first=is_first)
                for is_first, words in ((False, ""), (True, ", pre-trained"))
                for kind, label in networks
            ]
        case "heads":
            title = "Keypoints against direct regression"
            found = [
                rows.row("v2v", "V2V-PoseNet, keypoints by heatmaps"),
                rows.row("v2v-regression", "V2V-PoseNet, direct regression", "v2v-regression"),
            ]
        case "targets":
            title = "Gaussian against one-hot heatmaps"
            found = [
                rows.row("v2v", "V2V-PoseNet, Gaussian heatmaps"),
                rows.row(
                    "v2v-one-hot",
                    "V2V-PoseNet, one-hot heatmaps",
                    heatmaps=HeatmapConvention(target="one-hot", decoding="argmax", shrink=_SHRINK),
                ),
            ]
        case "temperatures":
            title = "Temperatures of the soft-argmax"
            found = [
                rows.row("v2v", "V2V-PoseNet, argmax"),
                *(
                    rows.row(
                        f"v2v-temperature-{temperature}",
                        f"V2V-PoseNet, soft-argmax, T = {temperature}",
                        heatmaps=_gaussian("soft-argmax", float(temperature)),
                        loss=LossSettings(heatmap=1.0, coordinate=1.0),
                    )
                    for temperature in (1, 10, 100, 1000)
                ),
            ]
        case "regularisers":
            title = "Regularisers of V2V-PoseNet"
            shift = _shares_of(size.sampling, 0.1)
            found = [
                rows.row("v2v", "none but flips"),
                rows.row("v2v-weight-decay", "weight decay 1e-4", weight_decay=1e-4),
                rows.row("v2v-dropout", "dropout 0.05", dropout=0.05),
                rows.row("v2v-shift", "random shift", augmentation=AugmentationSettings(shift_voxels=shift)),
                rows.row(
                    "v2v-occlusion",
                    "random occlusion",
                    augmentation=AugmentationSettings(occlusion_chance=0.5),
                ),
                rows.row("v2v-mixup", "mixup, α = 0.2", augmentation=AugmentationSettings(mixup_alpha=0.2)),
            ]
    return Experiment(name, title, tuple(found))


class _Rows:
    """Makes the rows of an experiment, each of which differs in one thing."""

    def __init__(self, size: ExperimentSize, seed: int, annotated: AnnotatedSettings) -> None:
        self._size, self._seed, self._annotated = size, seed, annotated

    def row(
        self,
        key: str,
        label: str,
        kind: NetworkKind = "v2v",
        *,
        first: bool = False,
        weight_decay: float = 0.0,
        dropout: float = 0.0,
        heatmaps: HeatmapConvention | None = None,
        **changes: Any,
    ) -> ExperimentRow:
        """Return a row; ``first`` for one that is trained on synthetic volumes first."""
        size, seed = self._size, self._seed
        learning_rate = size.v2v_learning_rate if kind.startswith("v2v") else size.learning_rate
        settings = TrainingSettings(
            seed=seed,
            network=NetworkChoice(kind=kind, width=size.width, dropout=dropout),
            heatmaps=heatmaps or _gaussian("argmax", 1.0),
            sampling=size.sampling,
            synthetic=SyntheticSettings(
                volumes=size.synthetic if first else 0,
                epoch_volumes=max(1, size.synthetic // 10),
                seed=_SYNTHETIC_SEED,
                workers=1,
            ),
            annotated=self._annotated.model_copy(
                update={"epochs": size.epochs, "learning_rate": learning_rate, "split_seed": seed}
            ),
            optimization=OptimizationSettings(
                learning_rate=learning_rate,
                final_share=1.0,
                warm_up_share=0.0,
                weight_decay=weight_decay,
                batch=size.batch,
                largest_gradient=_NO_LIMIT,
                average_decay=0.0,
            ),
            validation=ValidationSettings(volumes=size.validation, seed=_HELD_OUT_SEED),
            **({"loss": LossSettings(heatmap=1.0, coordinate=0.0)} if kind in HEATMAP_KINDS else {})
            | changes,
        )
        return ExperimentRow(key, label, settings)


def _gaussian(decoding: Literal["argmax", "soft-argmax"], temperature: float) -> HeatmapConvention:
    return HeatmapConvention(
        target="gaussian",
        sigma_voxel=_SIGMA_VOXEL,
        decoding=decoding,
        temperature=temperature,
        shrink=_SHRINK,
    )


def _shares_of(sampling: Sampling, share: float) -> tuple[int, int, int]:
    """Return a share of the samples along each axis, at least one."""
    first, second, third = (max(1, round(count * share)) for count in sampling.shape)
    return (first, second, third)


def _by(counts: tuple[int, int, int]) -> str:
    return " × ".join(map(str, counts))
