"""The weights of a network with what they are, in a file of torch's, of which no code is ever run."""

import io
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from pydantic import ValidationError
from torch import Tensor

from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.exporting import rebuilt_network
from annotations.learning.settings.network_settings import NetworkSettings
from annotations.prediction.checkpoint_description import CheckpointDescription

_DESCRIPTION, _NETWORK, _WEIGHTS = "description", "network", "weights"


class StateError(UserError):
    """A file that holds no network of this project, or one that does not fit its own description."""


@dataclass(frozen=True, eq=False)
class NetworkState:
    """A trained network.

    Attributes
    ----------
    description : CheckpointDescription
    network : PoseNetwork
        On the processor, in evaluation mode.
    """

    description: CheckpointDescription
    network: PoseNetwork


def write_state(
    path: Path, description: CheckpointDescription, settings: NetworkSettings, weights: Mapping[str, Tensor]
) -> None:
    """Write a network, atomically; SaveError where that is not possible."""
    stream = io.BytesIO()
    content = {
        _DESCRIPTION: json.dumps(description.model_dump(mode="json")),
        _NETWORK: settings.model_dump_json(),
        # Copies of their own, in the usual order: a part of a larger tensor would be saved with all of it.
        _WEIGHTS: {
            name: value.detach().cpu().clone(memory_format=torch.contiguous_format)
            for name, value in weights.items()
        },
    }
    torch.save(content, stream)
    replace_durably(path, stream.getvalue())


def read_state(path: Path) -> NetworkState:
    """Read a network.

    Raises
    ------
    StateError
        The file is absent or no such thing, holds code, or its weights do not fit the network that it names.
    """
    content = _read(path)
    missing = [name for name in (_DESCRIPTION, _NETWORK, _WEIGHTS) if name not in content]
    if missing:
        raise _wrong(f"it has no {missing[0]!r}", path)
    weights = content[_WEIGHTS]
    if not isinstance(weights, dict) or not all(
        isinstance(name, str) and isinstance(value, Tensor) for name, value in weights.items()
    ):
        raise _wrong("its weights are no tensors by name", path)
    try:
        description = CheckpointDescription.model_validate_json(content[_DESCRIPTION])
        settings = NetworkSettings.model_validate_json(content[_NETWORK])
    except ValidationError as error:
        raise _wrong(first_problem(error), path) from error
    if settings.input_shape != description.sampling.padded_shape or (
        settings.gives_heatmaps and settings.keypoints != len(description.keypoints)
    ):
        raise _wrong("its network has another input or other keypoints than its description", path)
    try:
        network = rebuilt_network(settings, weights)
    except RuntimeError as error:
        # torch lists every name that is absent, unknown or of another shape, on lines of their own.
        first, *others = (line.strip().rstrip(".") for line in str(error).splitlines())
        said = others[0] if others else first
        raise StateError(
            f"its weights do not fit a {settings.kind!r} network: {said}",
            where=path,
            remedy="If an earlier version trained it, this one makes networks of other widths: use the "
            "checkpoint (.onnx) beside it, or train anew",
        ) from error
    return NetworkState(description, network)


def _read(path: Path) -> Mapping[str, Any]:
    try:
        with warnings.catch_warnings():
            # It wonders about pickles that are not its own; they are refused anyway.
            warnings.simplefilter("ignore")
            # Only tensors and plain values; whatever else a pickle asks for is refused before it runs.
            content = torch.load(path, map_location="cpu", weights_only=True)
    except OSError as error:
        raise StateError(
            f"it could not be read ({error.strerror or error})",
            where=path,
            remedy="Check that it is a file, and that you may read it",
        ) from error
    except Exception as error:
        raise _wrong("it holds more than tensors and plain values, or is damaged", path) from error
    if not isinstance(content, dict):
        raise _wrong(f"it holds a {type(content).__name__}", path)
    return content


def _wrong(problem: str, path: Path) -> StateError:
    return StateError(
        f"it is no network of this program: {problem}",
        where=path,
        remedy="Choose a file 'best.pt' that a training left beside its checkpoint",
    )
