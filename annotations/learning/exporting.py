"""From a network to a checkpoint: as ONNX, which runs without torch."""

import io
import warnings
from collections.abc import Mapping

import torch
from torch import Tensor

from annotations.learning.network_settings import NetworkSettings
from annotations.learning.networks import build_network
from annotations.learning.pose_network import PoseNetwork

_OPSET = 17
"""Of 2022: every runtime reads it, and the networks need nothing newer."""


def rebuilt_network(settings: NetworkSettings, weights: Mapping[str, Tensor]) -> PoseNetwork:
    """Return a network in evaluation mode with given weights; RuntimeError where they do not fit."""
    network = build_network(settings)
    network.load_state_dict({name: value.cpu() for name, value in weights.items()})
    return network.eval()


def onnx_bytes(network: PoseNetwork) -> bytes:
    """Return a network as ONNX, for one volume at a time.

    Parameters
    ----------
    network : PoseNetwork
        On the processor, in evaluation mode: its normalisation becomes part of the convolutions.
    """
    stream = io.BytesIO()
    with warnings.catch_warnings():
        # This exporter is announced to go. It takes a tenth of the newer one's time, and needs no package.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            network,
            (torch.zeros(1, 1, *network.settings.input_shape),),
            stream,  # type: ignore[arg-type]
            dynamo=False,
            opset_version=_OPSET,
            input_names=["volume"],
            output_names=["heatmaps" if network.settings.gives_heatmaps else "numbers"],
        )
    return stream.getvalue()
