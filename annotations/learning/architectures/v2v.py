"""V2V-PoseNet: heatmaps from a 3D hourglass, and the same hourglass with a regressing head."""

from torch import Tensor, nn

from annotations.learning.architectures.blocks import (
    ConvolutionBlock,
    ResidualBlock,
    middle_of_the_range,
    start_near_zero,
)
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.settings.network_settings import NetworkSettings, scaled_channels

# Channels of the first convolution, and of the features at 1/2, 1/4 and 1/8 of the input.
_STEM, _FINE, _MIDDLE, _COARSE = 16, 32, 64, 128

# As published. It belongs to the published learning rate: behind a normalisation the size of the weights
# does not change what a layer gives, only how far a step of training turns it. The running variances start at
# 1, far above these layers': outside training, the network gives next to nothing for its first hundred steps.
_WEIGHT_DEVIATION = 0.001

_HEAD_POOLINGS = 3


class V2VPoseNet(PoseNetwork):
    """V2V-PoseNet of Moon et al. 2018, "V2V-PoseNet: Voxel-to-voxel prediction network".

    A 7³ convolution, a pooling and three residual blocks; an hourglass of 32, 64 and 128 channels whose skips
    have a residual block and are added; a residual block and two 1³ convolutions; and the 1³ convolution that
    gives the heatmaps. 3.41 million parameters with 21 keypoints, as published, and with six. 43 GFLOP at
    (32, 144, 88).

    The input's size must be a multiple of (8, 8, 8). All halvings are poolings and all doublings have kernels
    of 2³, so that a heatmap voxel lies in the middle of the input voxels that it covers.
    """

    heatmap_reduction = (2, 2, 2)

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__(settings)
        channels = scaled_channels(_FINE, settings.width)
        self.body = _Body(settings)
        self.back = nn.Sequential(
            ResidualBlock(channels, channels),
            nn.Dropout3d(settings.dropout),
            ConvolutionBlock(channels, channels, 1),
            ConvolutionBlock(channels, channels, 1),
        )
        self.head = nn.Conv3d(channels, settings.keypoints, 1)
        _draw_as_published(self)

    def compute(self, volumes: Tensor) -> Tensor:
        """Give the heatmaps, at half the input along every axis."""
        heatmaps: Tensor = self.head(self.back(self.body(volumes)))
        return heatmaps


class V2VRegression(PoseNetwork):
    """V2V-PoseNet that regresses: three pooled convolutions and a linear layer instead of its head.

    For the comparison of heatmaps with direct regression. 3.46 million parameters with eight outputs at
    (32, 144, 88), where V2V-PoseNet with six keypoints has 3.41; 41 GFLOP.

    The input's size must be a multiple of (8, 8, 8), and at least 16 along each axis.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__(settings)
        channels = scaled_channels(_FINE, settings.width)
        # The poolings keep the last plane of an odd number, which may hold a part of the tool.
        step = 2 ** (1 + _HEAD_POOLINGS)
        voxels = [-(-size // step) for size in settings.input_shape]
        self.body = _Body(settings)
        self.head_convolutions = nn.Sequential(
            *(
                nn.Sequential(ConvolutionBlock(channels, channels), nn.MaxPool3d(2, ceil_mode=True))
                for _ in range(_HEAD_POOLINGS)
            )
        )
        _draw_as_published(self)
        self.head = nn.Sequential(
            nn.Flatten(),
            nn.Dropout(settings.dropout),
            middle_of_the_range(channels * voxels[0] * voxels[1] * voxels[2], settings.outputs),
        )

    def compute(self, volumes: Tensor) -> Tensor:
        """Give the numbers, one row a volume."""
        numbers: Tensor = self.head(self.head_convolutions(self.body(volumes)))
        return numbers


class _Body(nn.Module):
    """All of V2V-PoseNet up to its head: features of 32 channels at half the input's size."""

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        stem, fine, middle, coarse = (
            scaled_channels(count, settings.width) for count in (_STEM, _FINE, _MIDDLE, _COARSE)
        )
        dropout = nn.Dropout3d(settings.dropout)
        self.front = nn.Sequential(
            ConvolutionBlock(1, stem, 7),
            nn.MaxPool3d(2),
            ResidualBlock(stem, fine),
            ResidualBlock(fine, fine),
            ResidualBlock(fine, fine),
            dropout,
        )
        self.fine_skip = ResidualBlock(fine, fine)
        self.down_to_middle = nn.Sequential(nn.MaxPool3d(2), ResidualBlock(fine, middle), dropout)
        self.middle_skip = ResidualBlock(middle, middle)
        self.down_to_coarse = nn.Sequential(nn.MaxPool3d(2), ResidualBlock(middle, coarse), dropout)
        self.at_coarse = nn.Sequential(ResidualBlock(coarse, coarse), ResidualBlock(coarse, coarse), dropout)
        self.up_to_middle = _doubling(coarse, middle)
        self.at_middle = nn.Sequential(ResidualBlock(middle, middle), dropout)
        self.up_to_fine = _doubling(middle, fine)

    def forward(self, volumes: Tensor) -> Tensor:
        fine = self.front(volumes)
        middle = self.down_to_middle(fine)
        coarse = self.at_coarse(self.down_to_coarse(middle))
        middle = self.at_middle(self.up_to_middle(coarse) + self.middle_skip(middle))
        features: Tensor = self.up_to_fine(middle) + self.fine_skip(fine)
        return features


def _doubling(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.ConvTranspose3d(inputs, outputs, 2, 2, bias=False),
        nn.BatchNorm3d(outputs),
        nn.ReLU(inplace=True),
    )


def _draw_as_published(network: nn.Module) -> None:
    for layer in network.modules():
        if isinstance(layer, nn.Conv3d | nn.ConvTranspose3d):
            start_near_zero(layer, _WEIGHT_DEVIATION)
