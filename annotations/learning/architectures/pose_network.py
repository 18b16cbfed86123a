"""What all networks have in common: what goes in, and how the heatmaps lie on it."""

from abc import abstractmethod

import torch
from torch import Tensor, nn

from annotations.learning.settings.network_settings import NetworkSettings


class PoseNetwork(nn.Module):
    """A network from volumes to heatmaps of the keypoints, or to numbers.

    It takes float32 volumes of shape (n, 1, d0, d1, d2) with values in [0, 1], axes 0, 1, 2 being the
    project's. It gives raw heatmaps (n, keypoints, h0, h1, h2), or raw numbers (n, outputs).

    Attributes
    ----------
    settings : NetworkSettings
        What it was built from.
    heatmap_reduction : (int, int, int), optional
        How many input voxels a heatmap voxel covers along axes 0, 1, 2; None for a network that regresses.
        Heatmap voxel j lies over the input at index (j + 0.5) · reduction − 0.5.
    """

    heatmap_reduction: tuple[int, int, int] | None = None

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.settings = settings

    def forward(self, volumes: Tensor) -> Tensor:
        """Give the heatmaps, or the numbers, of a batch of volumes.

        Parameters
        ----------
        volumes : Tensor, shape (n, 1, d0, d1, d2), float32
            Values in [0, 1].

        Returns
        -------
        Tensor, shape (n, keypoints, h0, h1, h2) or (n, outputs), float32

        Raises
        ------
        ValueError
            If the volumes have another shape than the network was built for.
        """
        # While a network is exported, the sizes are the exporter's and no plain numbers.
        if not torch.onnx.is_in_onnx_export() and volumes.shape[1:] != (1, *self.settings.input_shape):
            raise ValueError(
                f"the network takes volumes of shape (n, 1, d0, d1, d2) with "
                f"(d0, d1, d2) = {self.settings.input_shape}, not {tuple(volumes.shape)}"
            )
        return self.compute(volumes)

    @abstractmethod
    def compute(self, volumes: Tensor) -> Tensor:
        """Do the network's own work on volumes that fit."""
