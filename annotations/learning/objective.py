"""What a network is asked for: examples as its input, what it should give, and what it said in µm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from annotations.geometry.tool import ToolSpecification
from annotations.learning.examples import Example
from annotations.learning.heatmap_losses import (
    HeatmapTargets,
    heatmap_targets,
    heatmap_voxel_mm,
    keypoint_loss,
)
from annotations.learning.pose_losses import PoseLoss
from annotations.learning.settings import TrainingSettings
from annotations.prediction.heatmaps import decode


@dataclass(frozen=True, eq=False)
class Batch:
    """Several examples at once.

    Attributes
    ----------
    inputs : Tensor of float32, shape (n, 1, d0, d1, d2)
    targets : HeatmapTargets
    """

    inputs: Tensor
    targets: HeatmapTargets


class HeatmapObjective:
    """Keypoints by heatmaps.

    Parameters
    ----------
    settings : TrainingSettings
    tool : ToolSpecification
        Whose keypoints, in its order.
    device : torch.device
        Where the network is.
    """

    def __init__(self, settings: TrainingSettings, tool: ToolSpecification, device: torch.device) -> None:
        self._sampling, self._convention, self._loss = settings.sampling, settings.heatmaps, settings.loss
        self._input_shape = settings.sampling.padded_shape
        self._shape = settings.heatmaps.heatmap_shape(self._input_shape)
        self._device = device
        self._voxel_mm = heatmap_voxel_mm(settings.heatmaps, settings.sampling.spacing_um, device)
        self._pose_loss = PoseLoss(tool, tool.keypoint_names, settings.loss.mm_per_degree)

    def batch(self, examples: Sequence[Example]) -> Batch:
        """Put examples together."""
        inputs = np.stack([self._sampling.scaled(one.samples.astype(np.float32)) for one in examples])
        index_input = [self._sampling.to_index(one.keypoints_um, one.spacing_um) for one in examples]
        index_heatmap = self._convention.to_heatmap(np.stack(index_input), self._input_shape)
        return Batch(
            torch.from_numpy(inputs)[:, None].to(self._device, memory_format=torch.channels_last_3d),
            heatmap_targets(index_heatmap, self._shape, self._convention, self._device),
        )

    def loss(self, output: Tensor, batch: Batch) -> tuple[Tensor, dict[str, Tensor]]:
        """Return the loss of a network's output, and its parts by name."""
        return keypoint_loss(
            output, batch.targets, self._loss, self._convention, self._voxel_mm, self._pose_loss
        )

    def keypoints_um(self, output: Tensor, examples: Sequence[Example]) -> NDArray[np.float64]:
        """Return where the network sees the keypoints, shape (n, K, 3); NaN where it sees none."""
        found = []
        for heatmaps, example in zip(output.float().cpu().numpy(), examples, strict=True):
            index_heatmap = decode(heatmaps, self._convention).index_heatmap
            index_input = self._convention.to_input(index_heatmap, self._input_shape)
            found.append(self._sampling.to_um(index_input, example.spacing_um))
        return np.stack(found)
