"""What a checkpoint says of itself: everything that turns a volume into keypoints, and how it was trained."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from annotations import __version__
from annotations.documents.record import Moment, Record
from annotations.geometry.tool import Finite, NonNegative, ToolSpecification
from annotations.prediction.heatmaps import HeatmapConvention, in_range
from annotations.volumes.sampling import Sampling

SCHEMA: Literal["oct-checkpoint/1"] = "oct-checkpoint/1"

_Count = Annotated[int, Field(ge=0, strict=True)]
_Name = Annotated[str, Field(min_length=1, max_length=200)]
_Text = Annotated[str, Field(max_length=100_000)]
_Fingerprint = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]

MOST_FINGERPRINTS = 10_000
"""A description that names more volumes would be larger than one may be."""

_Fingerprints = Annotated[tuple[_Fingerprint, ...], Field(max_length=MOST_FINGERPRINTS)]


class ErrorSummary(Record):
    """Mean and standard deviation of one kind of error over volumes, in the unit of its field's name."""

    mean: Finite
    deviation: NonNegative


class TrainingSummary(Record):
    """How the network was trained, and how it did on volumes that it was not trained on.

    Attributes
    ----------
    synthetic_volumes : int
        Made on the fly and seen once each.
    studies : tuple of str
        Titles of the studies whose annotated volumes it was trained on.
    annotated_volumes : int
        How many different ones.
    training_fingerprints, validation_fingerprints : tuple of str
        Of these volumes, and of the annotated ones that were held out, by which they are known wherever they
        turn up again; empty where they are more than `MOST_FINGERPRINTS`, and of a checkpoint that does not
        say.
    epochs : int
    seconds : float
        Wall-clock time of the training, all its parts together.
    validation_volumes : int
    validation : mapping of str to ErrorSummary
        By ``position_mm``, ``orientation_deg`` and ``<angle>_deg``, by the published formulas.
    settings : str
        The settings as TOML, from which it can be repeated.
    origin : TrainingOrigin or None
        With which weights it began; None for random ones.
    """

    synthetic_volumes: _Count = 0
    studies: tuple[str, ...] = ()
    annotated_volumes: _Count = 0
    training_fingerprints: _Fingerprints = ()
    validation_fingerprints: _Fingerprints = ()
    epochs: _Count = 0
    seconds: NonNegative = 0.0
    validation_volumes: _Count = 0
    validation: Mapping[str, ErrorSummary] = {}
    settings: _Text = ""
    origin: "TrainingOrigin | None" = None

    @property
    def stages(self) -> "tuple[TrainingSummary, ...]":
        """The trainings in a row, each begun with the weights of the one before; this is the last."""
        stages = [self]
        while (origin := stages[-1].origin) is not None:
            stages.append(origin.training)
        return tuple(reversed(stages))


class TrainingOrigin(Record):
    """The network with whose weights a training began.

    Attributes
    ----------
    name : str
        What people call its checkpoint.
    sha256 : str
        Of the file that the weights were read from.
    training : TrainingSummary
        How it was trained itself.
    """

    name: _Name
    sha256: _Fingerprint
    training: TrainingSummary


class CheckpointDescription(Record):
    """The metadata of a checkpoint.

    Attributes
    ----------
    name : str
        What people call it.
    network : str
        Kind of the network, such as ``lean``.
    parameters : int
        How many numbers were learned.
    tool : ToolSpecification
        Whose keypoints it finds, whole: the checkpoint needs no tool file.
    keypoints : tuple of str
        Names of the heatmaps, in their order.
    sampling : Sampling
        How a volume becomes the network's input.
    heatmaps : HeatmapConvention
        How the network's output becomes keypoints.
    training : TrainingSummary
    created : datetime
        UTC.
    program : str
        Version of the program that wrote it.
    """

    schema_id: Literal["oct-checkpoint/1"] = Field(default=SCHEMA, alias="schema")
    name: _Name
    network: Annotated[str, Field(min_length=1, max_length=100)]
    parameters: _Count
    tool: ToolSpecification
    keypoints: Annotated[tuple[str, ...], Field(min_length=1)]
    sampling: Sampling
    heatmaps: HeatmapConvention
    training: TrainingSummary = TrainingSummary()
    created: Moment
    program: str = __version__

    @model_validator(mode="after")
    def _check(self) -> Self:
        known = self.tool.keypoint_names
        if unknown := [name for name in self.keypoints if name not in known]:
            raise ValueError(f"the tool {self.tool.name!r} has no keypoint {unknown[0]!r}")
        if len(set(self.keypoints)) != len(self.keypoints):
            raise ValueError("a keypoint has two heatmaps")
        # Refuses an input that cannot be divided.
        self.heatmaps.heatmap_shape(self.sampling.padded_shape)
        return self

    @property
    def input_shape(self) -> tuple[int, int, int, int, int]:
        """Shape of the network's input: one volume, one channel, then array axes 0, 1, 2."""
        return (1, 1, *self.sampling.padded_shape)

    def in_range(self, position_um: ArrayLike, volume_spacing_um: ArrayLike) -> NDArray[np.bool_]:
        """Say which positions in µm in a volume's frame, shape (..., 3), the network can tell; no NaN."""
        input_shape = self.sampling.padded_shape
        index_input = self.sampling.to_index(position_um, volume_spacing_um)
        return in_range(self.heatmaps.to_heatmap(index_input, input_shape), self.output_shape[2:])

    @property
    def output_shape(self) -> tuple[int, int, int, int, int]:
        """Shape of the network's output: one volume, a heatmap a keypoint, then array axes 0, 1, 2."""
        return (1, len(self.keypoints), *self.heatmaps.heatmap_shape(self.sampling.padded_shape))
