"""The network with whose weights a training begins: a checkpoint, or what another training left."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.exporting import weights_of
from annotations.learning.settings.training_settings import TrainingSettings
from annotations.learning.training.stages import learned_seeds
from annotations.learning.training.state_file import read_state
from annotations.prediction.checkpoint import load_checkpoint
from annotations.prediction.checkpoint_description import CheckpointDescription, TrainingOrigin
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.shipped import find_checkpoint
from annotations.volumes.sampling import Sampling

_NOT_KEPT = "num_batches_tracked"
"""What a normalisation counts, and nobody asks for: a checkpoint does not have it."""


@dataclass(frozen=True, eq=False)
class Origin:
    """A trained network.

    Attributes
    ----------
    path : Path
    sha256 : str
        Of the file.
    description : CheckpointDescription
    weights : mapping of str to Tensor
        By the names that this program's networks have for them, or by others where another program wrote it.
    """

    path: Path
    sha256: str
    description: CheckpointDescription
    weights: Mapping[str, Tensor]

    @property
    def summary(self) -> TrainingOrigin:
        """What the description of a network that begins here says of it."""
        return TrainingOrigin(
            name=self.description.name, sha256=self.sha256, training=self.description.training
        )

    def check(self, settings: TrainingSettings, tool: ToolSpecification) -> None:
        """Refuse settings and a tool with which what was learned would be of no use, as a UserError."""
        kind, keypoints = self.description.network, self.description.keypoints
        if kind != settings.network.kind:
            raise self._misfit(
                f"it is a {kind!r} network, and by the settings a {settings.network.kind!r} one is trained",
                f"Say network.kind = {kind!r} in the settings",
            )
        if keypoints != tool.keypoint_names:
            raise self._misfit(
                f"it finds the keypoints {', '.join(keypoints)} of the tool {self.description.tool.name!r}, "
                f"and {tool.name!r} has {', '.join(tool.keypoint_names)}",
                "Take the weights of a network for this tool, or begin without any",
            )
        target = self.description.heatmaps.target
        if target != settings.heatmaps.target:
            raise self._misfit(
                f"its heatmaps are of the kind {target!r}, and by the settings {settings.heatmaps.target!r}",
                f"Say heatmaps.target = {target!r} in the settings",
            )
        if settings.validation.seed in learned_seeds(self.description.training):
            raise UserError(
                f"the network of {self.path} has learned from the synthetic volumes of seed "
                f"{settings.validation.seed}, which are to be held out",
                where="validation.seed",
                remedy="Say another in the settings",
            )

    def fill(self, network: PoseNetwork) -> None:
        """Give a network these weights; UserError where they are not those of such a network."""
        own = network.state_dict()
        absent = [name for name in own if name not in self.weights and not name.endswith(_NOT_KEPT)]
        unknown = [name for name in self.weights if name not in own]
        if absent or unknown:
            raise self._misfit(
                f"it does not name its weights as a {network.settings.kind!r} network of this program does "
                f"({(absent or unknown)[0]!r} is {'absent' if absent else 'unknown'})",
                "Take 'best.pt', which its training left, if a version of this program made it; weights of "
                "other programs cannot be taken",
            )
        for name, value in self.weights.items():
            if value.shape != own[name].shape:
                raise self._misfit(
                    f"its network has another size: {name!r} is {_by(value.shape)} there, and "
                    f"{_by(own[name].shape)} by the settings",
                    "Say network.width as its training did ('annotations checkpoint info --json' has the "
                    "settings)",
                )
        network.load_state_dict(own | dict(self.weights))

    def say_differences(
        self, settings: TrainingSettings, tool: ToolSpecification, say: Callable[[str], None]
    ) -> None:
        """Tell what is otherwise than when the weights were learned, and need not be wrong."""
        before = self.description
        if tool.name != before.tool.name:
            say(f"the weights were learned for the tool {before.tool.name!r}")
        elif tool.fingerprint != before.tool.fingerprint:
            say(f"the weights were learned for another version of the tool {tool.name!r}")
        for section, old, new in (
            ("sampling", before.sampling, settings.sampling),
            ("heatmaps", before.heatmaps, settings.heatmaps),
        ):
            for name, value, now in _differences(old, new):
                say(f"the weights were learned with {section}.{name} = {value}, and go on with {now}")

    def _misfit(self, problem: str, remedy: str) -> UserError:
        return UserError(f"a training cannot begin with this: {problem}", where=self.path, remedy=remedy)


def read_origin(named: Path) -> Origin:
    """Read a network that was trained; none of the file's code runs.

    Parameters
    ----------
    named : Path
        A checkpoint (``.onnx``), the name of one that ships, or the weights that a training left
        (``best.pt``).

    Raises
    ------
    StateError, CheckpointError
        It is no such thing.
    """
    if named.suffix == ".pt":
        state = read_state(named)
        digest = hashlib.sha256(named.read_bytes()).hexdigest()
        return Origin(named, digest, state.description, state.network.state_dict())
    checkpoint = load_checkpoint(find_checkpoint(named))
    return Origin(checkpoint.path, checkpoint.sha256, checkpoint.description, weights_of(checkpoint.model))


def _differences(
    before: Sampling | HeatmapConvention, now: Sampling | HeatmapConvention
) -> list[tuple[str, object, object]]:
    old, new = before.model_dump(), now.model_dump()
    return [(name, value, new[name]) for name, value in old.items() if value != new[name]]


def _by(sizes: tuple[int, ...]) -> str:
    return " × ".join(map(str, sizes)) or "one number"
