"""What a network is built from: its kind, its input and its size. Needs no torch."""

from typing import Annotated, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

NetworkKind = Literal["lean", "v2v", "v2v-regression", "resnext3d", "inception3d"]
NETWORK_KINDS: tuple[NetworkKind, ...] = get_args(NetworkKind)

HEATMAP_KINDS = frozenset[NetworkKind](("lean", "v2v"))

# What a heatmap network halves it must double again to the same size, or the skips do not fit.
_SIZE_MULTIPLES: dict[NetworkKind, tuple[int, int, int]] = {
    "lean": (16, 32, 32),
    "v2v": (8, 8, 8),
    "v2v-regression": (8, 8, 8),
    "resnext3d": (1, 1, 1),
    "inception3d": (1, 1, 1),
}
_SMALLEST_SIZES: dict[NetworkKind, tuple[int, int, int]] = {
    "lean": (16, 32, 32),
    "v2v": (8, 8, 8),
    "v2v-regression": (16, 16, 16),
    "resnext3d": (16, 32, 32),
    "inception3d": (16, 32, 32),
}

_Size = Annotated[int, Field(ge=1)]


class NetworkSettings(BaseModel):
    """A network's kind, input and size: everything but its weights.

    Attributes
    ----------
    kind : str
        ``lean`` and ``v2v`` give a heatmap a keypoint, the others regress numbers.
    keypoints : int
        How many heatmaps the network gives. A network that regresses makes no use of it.
    outputs : int
        How many numbers the network regresses; 0 for heatmaps.
    input_shape : (int, int, int)
        Voxels of the padded input along axes 0, 1, 2.
    dropout : float
        The chance of a channel to be left out in training, in [0, 1).
    width : float
        Scales the number of channels, for experiments and tests with small networks.

    Raises
    ------
    ValueError
        If the kind cannot take the input, or needs another number of outputs.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: NetworkKind = "lean"
    keypoints: int = Field(ge=1)
    outputs: int = Field(default=0, ge=0)
    input_shape: tuple[_Size, _Size, _Size]
    dropout: float = Field(default=0.0, ge=0.0, lt=1.0)
    width: float = Field(default=1.0, gt=0.0, le=8.0)

    @property
    def gives_heatmaps(self) -> bool:
        """Whether the network gives a heatmap a keypoint, rather than numbers."""
        return self.kind in HEATMAP_KINDS

    @model_validator(mode="after")
    def _outputs_fit_the_kind(self) -> Self:
        if self.gives_heatmaps and self.outputs:
            raise ValueError(f"a {self.kind} network gives heatmaps, so outputs must be 0")
        if not self.gives_heatmaps and not self.outputs:
            raise ValueError(f"a {self.kind} network regresses numbers, so outputs must be 1 or more")
        return self

    @model_validator(mode="after")
    def _input_fits_the_kind(self) -> Self:
        multiples = _SIZE_MULTIPLES[self.kind]
        if any(size % multiple for size, multiple in zip(self.input_shape, multiples, strict=True)):
            raise ValueError(
                f"a {self.kind} network takes inputs of multiples of {multiples} voxels, "
                f"not {self.input_shape}; pad them to {self._next_shape(multiples)}"
            )
        smallest = _SMALLEST_SIZES[self.kind]
        if any(size < least for size, least in zip(self.input_shape, smallest, strict=True)):
            raise ValueError(
                f"a {self.kind} network takes inputs of at least {smallest} voxels, not {self.input_shape}"
            )
        return self

    def _next_shape(self, multiples: tuple[int, int, int]) -> tuple[int, ...]:
        return tuple(-(-size // step) * step for size, step in zip(self.input_shape, multiples, strict=True))


def scaled_channels(channels: int, width: float) -> int:
    """Scale a number of channels by a network's width, down to 1 channel."""
    return max(1, round(channels * width))
