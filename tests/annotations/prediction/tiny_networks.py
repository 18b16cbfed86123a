"""Networks of a few weights, made without torch."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import ModelProto, NodeProto, TensorProto, helper, numpy_helper

from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.checkpoint import METADATA_KEY, Checkpoint, save_checkpoint
from annotations.prediction.checkpoint_description import (
    CheckpointDescription,
    ErrorSummary,
    TrainingSummary,
)
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.onnx_graph import parse_model
from annotations.volumes.sampling import Sampling

NEEDLE = shipped_tools()["needle"]
SAMPLING = Sampling(
    shape=(6, 10, 8), spacing_um=(600.0, 200.0, 100.0), padding_before=(1, 1, 2), padding_after=(1, 1, 2)
)
INPUT = (1, 1, 8, 12, 12)
OUTPUT = (1, len(NEEDLE.keypoints), 4, 6, 6)

DESCRIPTION = CheckpointDescription(
    name="Tiny",
    network="test",
    parameters=18,
    tool=NEEDLE,
    keypoints=NEEDLE.keypoint_names,
    sampling=SAMPLING,
    heatmaps=HeatmapConvention(),
    training=TrainingSummary(
        synthetic_volumes=1200,
        studies=("Needles",),
        annotated_volumes=40,
        epochs=30,
        seconds=3700.0,
        validation_volumes=8,
        validation={"position_mm": ErrorSummary(mean=0.31, deviation=0.12)},
    ),
    created=datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC),
)


def weights(seed: int = 0) -> np.ndarray:
    """Return those of one convolution with a kernel and a step of 2 voxels."""
    return np.random.default_rng(seed).normal(size=(OUTPUT[1], 1, 2, 2, 2)).astype(np.float32)


def network(
    nodes: list[NodeProto] | None = None,
    tensors: list[TensorProto] | None = None,
    *,
    input_shape: tuple[Any, ...] = INPUT,
    output_shape: tuple[Any, ...] = OUTPUT,
    kind: int = TensorProto.FLOAT,
    ir_version: int = 10,
    opset: int = 18,
) -> ModelProto:
    """Return a network: by default one convolution that halves the input."""
    graph = helper.make_graph(
        [convolution()] if nodes is None else nodes,
        "network",
        [helper.make_tensor_value_info("volume", kind, input_shape)],
        [helper.make_tensor_value_info("heatmaps", kind, output_shape)],
        [numpy_helper.from_array(weights(), "weights"), *(tensors or [])],
    )
    return helper.make_model(graph, ir_version=ir_version, opset_imports=[helper.make_opsetid("", opset)])


def convolution(given: str = "heatmaps", **attributes: Any) -> NodeProto:
    chosen = {"kernel_shape": [2, 2, 2], "strides": [2, 2, 2]} | attributes
    return helper.make_node("Conv", ["volume", "weights"], [given], name="halve", **chosen)


def save_tiny(path: Path, model: ModelProto | None = None) -> Checkpoint:
    """Write a checkpoint that works."""
    return save_checkpoint(path, DESCRIPTION, (model or network()).SerializeToString())


def rewritten(path: Path, change: Callable[[ModelProto], object]) -> Path:
    """Change the ONNX of a checkpoint behind the program's back."""
    model = onnx.load_model_from_string(path.read_bytes())
    change(model)
    path.write_bytes(model.SerializeToString())
    return path


def redescribed(path: Path, text: str) -> Path:
    """Put another text in the place of a checkpoint's description."""

    def change(model: ModelProto) -> None:
        [entry] = [entry for entry in model.metadata_props if entry.key == METADATA_KEY]
        entry.value = text

    return rewritten(path, change)


def description_text(path: Path) -> str:
    [entry] = [entry for entry in parse_model(path.read_bytes()).metadata_props if entry.key == METADATA_KEY]
    return str(entry.value)
