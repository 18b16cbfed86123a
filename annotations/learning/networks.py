"""The networks by name."""

from annotations.learning.lean import LeanNetwork
from annotations.learning.network_settings import NetworkSettings
from annotations.learning.pose_network import PoseNetwork


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
        case _:
            raise NotImplementedError(settings.kind)


def parameter_count(network: PoseNetwork) -> int:
    """Count the numbers that training changes."""
    return sum(parameter.numel() for parameter in network.parameters() if parameter.requires_grad)
