"""The layers that several networks are made of."""

from torch import Tensor, nn

from annotations.learning.settings.network_settings import NetworkSettings

Size3 = int | tuple[int, int, int]


class ConvolutionBlock(nn.Sequential):
    """A convolution, batch normalisation and, unless told otherwise, a rectifier.

    Parameters
    ----------
    inputs, outputs : int
        Channels.
    kernel, stride : int or (int, int, int)
        In voxels, along axes 0, 1, 2.
    padding : int or (int, int, int), optional
        Half the kernel unless given.
    groups : int
        Into how many groups the channels are split.
    rectified : bool
        Whether a rectifier follows.
    """

    def __init__(
        self,
        inputs: int,
        outputs: int,
        kernel: Size3 = 3,
        stride: Size3 = 1,
        *,
        padding: Size3 | None = None,
        groups: int = 1,
        rectified: bool = True,
    ) -> None:
        if padding is None:
            padding = _half(kernel)
        # The normalisation takes the mean away, so that a bias would do nothing.
        layers: list[nn.Module] = [
            nn.Conv3d(inputs, outputs, kernel, stride, padding, groups=groups, bias=False),
            nn.BatchNorm3d(outputs),
        ]
        if rectified:
            layers.append(nn.ReLU(inplace=True))
        super().__init__(*layers)


class ResidualBlock(nn.Module):
    """Two 3³ convolutions beside a skip, which is a 1³ convolution where the channels change.

    After He et al. 2016, "Deep residual learning for image recognition", in three dimensions.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.residual = nn.Sequential(
            ConvolutionBlock(inputs, outputs), ConvolutionBlock(outputs, outputs, rectified=False)
        )
        self.skip: nn.Module = (
            nn.Identity() if inputs == outputs else ConvolutionBlock(inputs, outputs, 1, rectified=False)
        )
        self.rectifier = nn.ReLU(inplace=True)

    def forward(self, features: Tensor) -> Tensor:
        """Give features of the same size, with the block's number of channels."""
        rectified: Tensor = self.rectifier(self.residual(features) + self.skip(features))
        return rectified


class PooledRegression(nn.Sequential):
    """The mean of each channel over all voxels, and a linear layer: features to numbers."""

    def __init__(self, channels: int, settings: NetworkSettings) -> None:
        super().__init__(
            nn.AdaptiveAvgPool3d(1),
            nn.Flatten(),
            nn.Dropout(settings.dropout),
            middle_of_the_range(channels, settings.outputs),
        )


def middle_of_the_range(inputs: int, outputs: int) -> nn.Linear:
    """Make a linear layer that starts near 0.5: labels are scaled to [0, 1]."""
    layer = nn.Linear(inputs, outputs)
    nn.init.constant_(layer.bias, 0.5)
    return layer


def draw_for_rectifiers(network: nn.Module) -> None:
    """Draw a network's convolutions so that rectified features keep their size (He et al. 2015)."""
    for layer in network.modules():
        if isinstance(layer, nn.Conv3d):
            nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")


def start_near_zero(layer: nn.Conv3d | nn.ConvTranspose3d, deviation: float) -> None:
    """Draw a layer's weights from a normal distribution about zero, without a bias to begin with."""
    nn.init.normal_(layer.weight, std=deviation)
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)


def _half(kernel: Size3) -> Size3:
    return kernel // 2 if isinstance(kernel, int) else (kernel[0] // 2, kernel[1] // 2, kernel[2] // 2)
