"""ResNeXt3D: residual blocks with grouped convolutions, and numbers straight from the volume."""

from torch import Tensor, nn

from annotations.learning.architectures.blocks import ConvolutionBlock, PooledRegression, draw_for_rectifiers
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.settings.network_settings import NetworkSettings, scaled_channels

_CARDINALITY = 32
_STEM = 64

# Channels that a block gives for each of its grouped ones.
_EXPANSION = 2

# Blocks, channels a group, and the stride of the first block, from fine to coarse.
_STAGES = ((3, 4, 1), (4, 8, 2), (6, 16, 2), (3, 32, 2))


class ResNeXt3D(PoseNetwork):
    """ResNeXt-50 (Xie et al. 2017) in three dimensions, after Hara et al. 2018, with a regressing head.

    A 7³ convolution that halves axes 1 and 2, a pooling, four stages of 3, 4, 6 and 3 blocks with 32 groups,
    the mean over all voxels and a linear layer. 25.8 million parameters with eight outputs, 21 GFLOP at
    (32, 144, 88).

    The width scales the number of groups, not the channels of one. The input must have (16, 32, 32) voxels or
    more.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__(settings)
        groups = scaled_channels(_CARDINALITY, settings.width)
        channels = scaled_channels(_STEM, settings.width)
        # Axis 0 has few planes to begin with, as time has in the videos that the network was made for.
        layers: list[nn.Module] = [
            ConvolutionBlock(1, channels, 7, (1, 2, 2)),
            nn.MaxPool3d(3, stride=2, padding=1),
        ]
        for blocks, group_channels, stride in _STAGES:
            grouped = groups * group_channels
            for block in range(blocks):
                layers.append(_GroupedBlock(channels, grouped, groups, stride if block == 0 else 1))
                channels = grouped * _EXPANSION
        self.features = nn.Sequential(*layers)
        draw_for_rectifiers(self)
        self.head = PooledRegression(channels, settings)

    def compute(self, volumes: Tensor) -> Tensor:
        """Give the numbers, one row a volume."""
        numbers: Tensor = self.head(self.features(volumes))
        return numbers


class _GroupedBlock(nn.Module):
    """A 1³, a grouped 3³ and a 1³ convolution beside a skip, which is a 1³ convolution where sizes change."""

    def __init__(self, inputs: int, grouped: int, groups: int, stride: int) -> None:
        super().__init__()
        outputs = grouped * _EXPANSION
        self.residual = nn.Sequential(
            ConvolutionBlock(inputs, grouped, 1),
            ConvolutionBlock(grouped, grouped, 3, stride, groups=groups),
            ConvolutionBlock(grouped, outputs, 1, rectified=False),
        )
        self.skip: nn.Module = (
            nn.Identity()
            if inputs == outputs and stride == 1
            else ConvolutionBlock(inputs, outputs, 1, stride, rectified=False)
        )
        self.rectifier = nn.ReLU(inplace=True)

    def forward(self, features: Tensor) -> Tensor:
        rectified: Tensor = self.rectifier(self.residual(features) + self.skip(features))
        return rectified
