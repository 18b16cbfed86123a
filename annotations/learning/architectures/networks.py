"""The networks by name."""

from annotations.learning.architectures.inception3d import Inception3D
from annotations.learning.architectures.lean import LeanNetwork
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.architectures.resnext3d import ResNeXt3D
from annotations.learning.architectures.v2v import V2VPoseNet, V2VRegression
from annotations.learning.settings.network_settings import NetworkSettings


def build_network(settings: NetworkSettings) -> PoseNetwork:
    """Build a network with fresh weights, drawn from torch's own generator.

    Parameters
    ----------
    settings : NetworkSettings
        Its kind, input and size.

    Returns
    -------
    PoseNetwork
        In training mode, on the CPU.
    """
    match settings.kind:
        case "lean":
            return LeanNetwork(settings)
        case "v2v":
            return V2VPoseNet(settings)
        case "v2v-regression":
            return V2VRegression(settings)
        case "resnext3d":
            return ResNeXt3D(settings)
        case "inception3d":
            return Inception3D(settings)


def parameter_count(network: PoseNetwork) -> int:
    """Count the numbers that training changes."""
    return sum(parameter.numel() for parameter in network.parameters() if parameter.requires_grad)
