"""``annotations checkpoint``: what a checkpoint is, and a checkpoint from the weights of a training."""

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from annotations.cli.learning_extra import require_torch
from annotations.cli.output import for_each, write_json, write_text
from annotations.errors import UserError
from annotations.prediction.checkpoint import Checkpoint, load_checkpoint
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.shipped import find_checkpoint
from annotations.prediction.training_words import errors_in_words, training_in_words
from annotations.volumes.sampling import Sampling
from annotations.volumes.spacing import OMES_DEPTH_AXIS, OMES_REALTIME_SPACING_UM, OMES_SPACING_UM

_AXES = "axes 0, 1, 2"


def run(arguments: argparse.Namespace) -> int:
    """Describe checkpoints, or make one; return the exit code."""
    if arguments.action == "convert":
        return for_each([arguments.state], arguments.json, lambda path: _convert(path, arguments))

    def describe(path: Path) -> None:
        checkpoint = load_checkpoint(find_checkpoint(path))
        if arguments.json:
            write_json(_fields(checkpoint))
        else:
            write_text(_in_words(checkpoint))

    return for_each(arguments.files, arguments.json, describe)


def _convert(path: Path, arguments: argparse.Namespace) -> None:
    require_torch("a conversion")
    output: Path = arguments.output
    # Before the work, which takes seconds.
    if output.exists():
        raise UserError(
            "there is a file already, and it is not overwritten"
            if output.is_file()
            else "it is a folder, and a checkpoint is a file",
            where=output,
            remedy="Choose another name for -o",
        )
    from annotations.learning.conversion import convert_state

    checkpoint = convert_state(path, output, half=arguments.half)
    if arguments.json:
        write_json(_fields(checkpoint) | {"original": str(path)})
    else:
        write_text(f"{output}\n  from         {path}\n  sha256       {checkpoint.sha256}")


def _fields(checkpoint: Checkpoint) -> dict[str, Any]:
    description = checkpoint.description
    return {
        "path": str(checkpoint.path),
        "sha256": checkpoint.sha256,
        "input_shape": description.input_shape,
        "output_shape": description.output_shape,
        **{
            f"strides_of_{kind}_volume": strides
            for kind, strides in _omes_strides(description.sampling).items()
        },
        "margin_before_um": _margins_um(description)[0].tolist(),
        "margin_after_um": _margins_um(description)[1].tolist(),
        "description": description.model_dump(mode="json"),
    }


def _in_words(checkpoint: Checkpoint) -> str:
    description = checkpoint.description
    tool, sampling, convention = description.tool, description.sampling, description.heatmaps
    before_mm, after_mm = _margins_um(description) / 1000
    strides = (f"{_by(each)} voxels of a {kind} volume" for kind, each in _omes_strides(sampling).items())
    low, high = sampling.value_range
    lines = [
        ("name", description.name),
        ("network", f"{description.network}, {description.parameters:,} parameters"),
        ("tool", f"{tool.name} ({tool.title})" if tool.title else tool.name),
        ("keypoints", ", ".join(description.keypoints)),
        ("volumes", f"{sampling.dtype}, light along axis {sampling.depth_axis}"),
        (
            "samples",
            f"{_by(sampling.shape)}, every {_by(sampling.spacing_um)} µm along {_AXES}"
            + (", means along the light" if sampling.is_averaged else ", single voxels"),
        ),
        ("strides", ", ".join(strides) or "its volumes are not those of the OMES"),
        ("padding", f"{_by(sampling.padding_before)} before and {_by(sampling.padding_after)} after"),
        ("input", _by(sampling.padded_shape)),
        ("values", f"{low:g} to {high:g} become 0 to 1"),
        (
            "heatmaps",
            f"{_by(description.output_shape[2:])}, a voxel over {_by(convention.reduction)} of the input",
        ),
        ("coordinates", _decoding(convention)),
        ("out of view", f"by {_out_of_view(convention)}"),
        ("", f"{_by(before_mm, '.2f')} mm before the samples and {_by(after_mm, '.2f')} mm after them"),
        ("training", training_in_words(description.training)),
        ("errors", errors_in_words(description.training)),
        ("program", f"{description.program}, {description.created:%Y-%m-%d %H:%M} UTC"),
        ("format", f"{description.schema_id}, {len(checkpoint.model):,} bytes of ONNX"),
        ("sha256", checkpoint.sha256),
    ]
    return "\n".join([str(checkpoint.path), *(f"  {label:<11}  {_printable(text)}" for label, text in lines)])


def _omes_strides(sampling: Sampling) -> dict[str, list[float]]:
    """Return how many voxels lie between two samples along each axis, of the OMES's kinds of volumes.

    Empty where light travels along another axis than in them.
    """
    if sampling.depth_axis != OMES_DEPTH_AXIS:
        return {}
    return {
        kind: [
            round(sample / voxel, 4) for sample, voxel in zip(sampling.spacing_um, spacing_um, strict=True)
        ]
        for kind, spacing_um in (("full", OMES_SPACING_UM), ("realtime", OMES_REALTIME_SPACING_UM))
    }


def _margins_um(description: CheckpointDescription) -> NDArray[np.float64]:
    """Return how far outside the samples keypoints are still told, before and after, shape (2, 3)."""
    sampling, convention = description.sampling, description.heatmaps
    first, last = np.zeros(3), np.array(description.output_shape[2:]) - 1
    lowest, highest = convention.to_input(np.stack([first, last]), sampling.padded_shape)
    before = np.array(sampling.padding_before) - lowest
    after = highest - (np.array(sampling.padding_before) + np.array(sampling.shape) - 1)
    return np.asarray(np.stack([before, after]) * np.array(sampling.spacing_um))


def _decoding(convention: HeatmapConvention) -> str:
    match convention.decoding:
        case "integral":
            how = "the mean of the softmax"
        case "argmax":
            how = "the largest value"
        case _:
            how = f"the mean of the softmax of {convention.temperature:g} times the heatmap"
    return f"{how}; taught as {convention.target}, σ of {_by(convention.sigma_voxel)} heatmap voxels"


def _out_of_view(convention: HeatmapConvention) -> str:
    if convention.shrink == 1:
        return "the padding"
    return f"the padding, and positions shrunk by {convention.shrink:g} about the middle"


def _by(values: Iterable[float], form: str = "g") -> str:
    return " × ".join(f"{value:z{form}}" if form != "g" else f"{value:g}" for value in values)


def _printable(text: str) -> str:
    """Return a text that comes from somebody's file without what would steer a terminal."""
    return "".join(letter if letter.isprintable() else "�" for letter in text)
