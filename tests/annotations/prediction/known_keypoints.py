"""Stand-ins for a trained network: they give the heatmaps of keypoints that are known beforehand."""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.checkpoint import Checkpoint, save_checkpoint
from annotations.prediction.checkpoint_description import CheckpointDescription
from annotations.prediction.heatmaps import HeatmapConvention, encode
from annotations.prediction.predictor import PredictedKeypoints, StageTimes
from annotations.volumes.sampling import OMES_SAMPLING, Sampling

FORCEPS = shipped_tools()["magnetic-forceps"]
SHA256 = "5feceb66ffc86f38d952786c6d696c79c2dbc239dd4e91b46729d73a27fb57e9"
COARSE = Sampling(
    shape=(14, 20, 14),
    spacing_um=(1300.0, 1350.0, 800.0),
    padding_before=(3, 3, 3),
    padding_after=(3, 3, 3),
)
"""For small synthetic volumes over the whole workspace."""


def described(
    sampling: Sampling = OMES_SAMPLING,
    convention: HeatmapConvention | None = None,
    tool: ToolSpecification = FORCEPS,
    name: str = "Known",
) -> CheckpointDescription:
    return CheckpointDescription(
        name=name,
        network="known",
        parameters=0,
        tool=tool,
        keypoints=tool.keypoint_names,
        sampling=sampling,
        heatmaps=convention or HeatmapConvention(),
        created=datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC),
    )


def checkpoint(
    description: CheckpointDescription | None = None, path: Path = Path("known.onnx")
) -> Checkpoint:
    return Checkpoint(description or described(), b"", SHA256, path)


def heatmaps_of(
    description: CheckpointDescription, positions_um: Mapping[str, Vector], volume_spacing_um: Vector
) -> NDArray[np.float32]:
    """Return what a network that knows the keypoints gives; those without a position are nowhere."""
    sampling, convention = description.sampling, description.heatmaps
    known_um = np.array([positions_um.get(name, (np.nan,) * 3) for name in description.keypoints])
    index_input = sampling.to_index(known_um, volume_spacing_um)
    index_heatmap = convention.to_heatmap(index_input, sampling.padded_shape)
    return encode(index_heatmap, convention.heatmap_shape(sampling.padded_shape), convention).astype(
        np.float32
    )


class KnowingNetwork:
    """Gives the same heatmaps whatever it sees, and remembers what it saw."""

    def __init__(self, heatmaps: NDArray[np.float32]) -> None:
        self._heatmaps = heatmaps
        self.seen: list[NDArray[np.float32]] = []

    def heatmaps(self, padded_input: NDArray[np.float32]) -> NDArray[np.float32]:
        self.seen.append(padded_input)
        return self._heatmaps


def save_knowing(path: Path, description: CheckpointDescription, heatmaps: NDArray[np.float32]) -> Checkpoint:
    """Write a checkpoint whose network always gives these heatmaps."""
    nodes = [
        helper.make_node("Conv", ["volume", "nothing"], ["zeros"], kernel_shape=[2, 2, 2], strides=[2, 2, 2]),
        helper.make_node("Add", ["zeros", "known"], ["heatmaps"]),
    ]
    nothing = np.zeros((len(heatmaps), 1, 2, 2, 2), dtype=np.float32)
    graph = helper.make_graph(
        nodes,
        "known",
        [helper.make_tensor_value_info("volume", TensorProto.FLOAT, description.input_shape)],
        [helper.make_tensor_value_info("heatmaps", TensorProto.FLOAT, description.output_shape)],
        [numpy_helper.from_array(nothing, "nothing"), numpy_helper.from_array(heatmaps[None], "known")],
    )
    model = helper.make_model(graph, ir_version=10, opset_imports=[helper.make_opsetid("", 18)])
    return save_checkpoint(path, description, model.SerializeToString())


def predicted(
    positions_um: Mapping[str, Vector],
    description: CheckpointDescription | None = None,
    spread_um: Mapping[str, Vector] | None = None,
) -> PredictedKeypoints:
    """Return a prediction of these positions, by a network that is as sure as it was taught to be."""
    about = description or described()
    sampling, convention = about.sampling, about.heatmaps
    taught_um = np.multiply(convention.sigma_voxel, convention.reduction) * sampling.spacing_um
    count = len(about.keypoints)
    spreads_um = [(spread_um or {}).get(name, tuple(taught_um)) for name in about.keypoints]
    return PredictedKeypoints(
        about.keypoints,
        np.array([positions_um.get(name, (np.nan,) * 3) for name in about.keypoints]),
        np.array([float(name in positions_um) for name in about.keypoints]),
        np.full(count, 0.2),
        np.array(spreads_um),
        StageTimes(0.0, 0.0, 0.0),
    )
