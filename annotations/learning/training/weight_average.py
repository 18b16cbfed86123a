"""A moving average of a network's weights, which does better than the last ones."""

import copy
from collections.abc import Mapping

import torch
from torch import Tensor

from annotations.learning.architectures.pose_network import PoseNetwork

_BEGINNING = 10


class WeightAverage:
    """A copy of a network whose weights, and statistics, follow the network's.

    After t steps a weight is d · before + (1 − d) · now with d = min(decay, (1 + t) / (10 + t)), so that the
    first, random weights are soon forgotten.

    Attributes
    ----------
    network : PoseNetwork
        In evaluation mode.
    steps : int
        How many it has followed since it began, or began again.

    Parameters
    ----------
    network : PoseNetwork
        Where it begins.
    decay : float
        In [0, 1); 0 for a copy of the last weights.
    """

    def __init__(self, network: PoseNetwork, decay: float) -> None:
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        self.steps = 0
        self._decay = decay

    def follow(self, network: PoseNetwork) -> None:
        """Take a step of the network into account."""
        decay = min(self._decay, (1 + self.steps) / (_BEGINNING + self.steps))
        self.steps += 1
        own = self.network.state_dict()
        with torch.no_grad():
            for name, value in network.state_dict().items():
                if value.is_floating_point():
                    own[name].lerp_(value, 1 - decay)
                else:
                    own[name].copy_(value)

    def begin_again(self, weights: Mapping[str, Tensor]) -> None:
        """Begin at other weights, and forget them soon: what comes may be few steps long."""
        self.network.load_state_dict(weights)
        self.steps = 0

    def weights(self) -> dict[str, Tensor]:
        """Return a copy of the averages, on the processor."""
        return {name: value.detach().cpu().clone() for name, value in self.network.state_dict().items()}
