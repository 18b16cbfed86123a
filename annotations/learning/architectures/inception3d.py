"""Inception3D: kernels of several sizes side by side, and numbers straight from the volume."""

from typing import NamedTuple

import torch
from torch import Tensor, nn

from annotations.learning.architectures.blocks import ConvolutionBlock, PooledRegression, draw_for_rectifiers
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.settings.network_settings import NetworkSettings, scaled_channels


class _Branches(NamedTuple):
    """Channels of a module's branches; ``before`` is what a 1³ convolution leaves for the larger kernels."""

    small: int
    before_middle: int
    middle: int
    before_large: int
    large: int
    pooled: int


_STEM = (64, 192)
# The channels of Szegedy et al. 2015, "Going deeper with convolutions", table 1; a halving after each stage.
_STAGES = (
    (_Branches(64, 96, 128, 16, 32, 32), _Branches(128, 128, 192, 32, 96, 64)),
    (
        _Branches(192, 96, 208, 16, 48, 64),
        _Branches(160, 112, 224, 24, 64, 64),
        _Branches(128, 128, 256, 24, 64, 64),
        _Branches(112, 144, 288, 32, 64, 64),
        _Branches(256, 160, 320, 32, 128, 128),
    ),
    (_Branches(256, 160, 320, 32, 128, 128), _Branches(384, 192, 384, 48, 128, 128)),
)


class Inception3D(PoseNetwork):
    """Inception (Szegedy et al. 2015) in three dimensions, after Carreira and Zisserman 2017, regressing.

    A 7³ convolution, poolings and nine modules with normalised convolutions; the branch of 5³ is two kernels
    of 3³ (Szegedy et al. 2016); then the mean over all voxels and a linear layer. 14.3 million parameters
    with eight outputs, 27 GFLOP at (32, 144, 88).

    The input must have (16, 32, 32) voxels or more.
    """

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__(settings)
        first, channels = (scaled_channels(count, settings.width) for count in _STEM)
        # Axis 0 has few planes to begin with: the first poolings leave it as it is.
        layers: list[nn.Module] = [
            ConvolutionBlock(1, first, 7, 2),
            nn.MaxPool3d((1, 3, 3), (1, 2, 2), (0, 1, 1)),
            ConvolutionBlock(first, first, 1),
            ConvolutionBlock(first, channels),
            nn.MaxPool3d((1, 3, 3), (1, 2, 2), (0, 1, 1)),
        ]
        for stage, modules in enumerate(_STAGES):
            if stage:
                layers.append(nn.MaxPool3d(3, 2, 1))
            for branches in modules:
                module = _InceptionModule(channels, branches, settings.width)
                layers.append(module)
                channels = module.outputs
        self.features = nn.Sequential(*layers)
        draw_for_rectifiers(self)
        self.head = PooledRegression(channels, settings)

    def compute(self, volumes: Tensor) -> Tensor:
        """Give the numbers, one row a volume."""
        numbers: Tensor = self.head(self.features(volumes))
        return numbers


class _InceptionModule(nn.Module):
    """Kernels of 1³, 3³ and 5³ and a pooling of the same features, one after the other in the channels."""

    def __init__(self, inputs: int, branches: _Branches, width: float) -> None:
        super().__init__()
        scaled = _Branches(*(scaled_channels(count, width) for count in branches))
        self.outputs = scaled.small + scaled.middle + scaled.large + scaled.pooled
        self.small = ConvolutionBlock(inputs, scaled.small, 1)
        self.middle = nn.Sequential(
            ConvolutionBlock(inputs, scaled.before_middle, 1),
            ConvolutionBlock(scaled.before_middle, scaled.middle),
        )
        self.large = nn.Sequential(
            ConvolutionBlock(inputs, scaled.before_large, 1),
            ConvolutionBlock(scaled.before_large, scaled.large),
            ConvolutionBlock(scaled.large, scaled.large),
        )
        self.pooled = nn.Sequential(nn.MaxPool3d(3, 1, 1), ConvolutionBlock(inputs, scaled.pooled, 1))

    def forward(self, features: Tensor) -> Tensor:
        branches = (self.small, self.middle, self.large, self.pooled)
        return torch.cat([branch(features) for branch in branches], dim=1)
