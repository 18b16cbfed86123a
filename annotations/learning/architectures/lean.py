"""The lean network: heatmaps in real time on a processor without a GPU."""

from torch import Tensor, nn

from annotations.learning.architectures.blocks import ConvolutionBlock, ResidualBlock, start_near_zero
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.settings.network_settings import NetworkSettings, scaled_channels

_CHANNELS = (16, 32, 64, 128)

# Flat heatmaps say "in the middle": no training has to unlearn peaks at random places first.
_HEAD_DEVIATION = 0.01


class LeanNetwork(PoseNetwork):
    """A small hourglass whose first convolution leaves 1/32 of the voxels, so that the rest is cheap.

    The idea is V2V-PoseNet's (heatmaps from a 3D hourglass with skips that are added). The first convolution
    steps 2, 4, 4 voxels, which are about as long along each axis of the scanner; three halvings follow, and
    the way back up to half the input. 2.71 million parameters with six keypoints, 1.2 GFLOP at (32, 160, 96).

    The input's size must be a multiple of (16, 32, 32).
    """

    heatmap_reduction = (2, 2, 2)

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__(settings)
        fine, middle, coarse, coarsest = (scaled_channels(count, settings.width) for count in _CHANNELS)
        dropout = nn.Dropout3d(settings.dropout)

        # Over four voxels a kernel of odd size cannot be centred: with this padding it lies half a voxel off
        # along each axis. So do the halvings below, by half a voxel of their own input. The skips and the way
        # up make good for that: a constant shift is easily learnt.
        self.stem = ConvolutionBlock(1, fine, (5, 7, 7), (2, 4, 4), padding=(2, 2, 2))
        self.down_to_middle = nn.Sequential(
            ConvolutionBlock(fine, middle, stride=2), ResidualBlock(middle, middle), dropout
        )
        self.down_to_coarse = nn.Sequential(
            ConvolutionBlock(middle, coarse, stride=2), ResidualBlock(coarse, coarse), dropout
        )
        self.down_to_coarsest = nn.Sequential(
            ConvolutionBlock(coarse, coarsest, stride=2),
            ResidualBlock(coarsest, coarsest),
            ResidualBlock(coarsest, coarsest),
            dropout,
        )
        self.up_to_coarse = nn.ConvTranspose3d(coarsest, coarse, 2, 2)
        self.at_coarse = ResidualBlock(coarse, coarse)
        self.up_to_middle = nn.ConvTranspose3d(coarse, middle, 2, 2)
        self.at_middle = ResidualBlock(middle, middle)
        self.up_to_fine = nn.ConvTranspose3d(middle, fine, 2, 2)
        self.at_fine = nn.Sequential(ConvolutionBlock(fine, fine), dropout)
        self.head = nn.ConvTranspose3d(fine, settings.keypoints, (1, 2, 2), (1, 2, 2))
        start_near_zero(self.head, _HEAD_DEVIATION)

    def compute(self, volumes: Tensor) -> Tensor:
        """Give the heatmaps, at half the input along every axis."""
        fine = self.stem(volumes)
        middle = self.down_to_middle(fine)
        coarse = self.down_to_coarse(middle)
        coarsest = self.down_to_coarsest(coarse)
        coarse = self.at_coarse(self.up_to_coarse(coarsest) + coarse)
        middle = self.at_middle(self.up_to_middle(coarse) + middle)
        fine = self.at_fine(self.up_to_fine(middle) + fine)
        heatmaps: Tensor = self.head(fine)
        return heatmaps
