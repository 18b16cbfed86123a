"""From a network to a checkpoint: as ONNX, which runs without torch."""

import io
import warnings
from collections.abc import Mapping

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor

from annotations.learning.network_settings import NetworkSettings
from annotations.learning.networks import build_network
from annotations.learning.pose_network import PoseNetwork

_OPSET = 17
"""Of 2022: every runtime reads it, and the networks need nothing newer."""


_WORTH_HALVING = 1024
"""Numbers of a tensor from which its size matters."""


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


def halved(model_bytes: bytes) -> bytes:
    """Return a network whose weights are kept in half precision, in half the bytes.

    They are turned back before anything is computed with them, so that each weight is rounded to eleven bits
    once, and nothing else changes.

    Parameters
    ----------
    model_bytes : bytes
        As `onnx_bytes` gives them.
    """
    model = onnx.load_model_from_string(model_bytes)
    graph = model.graph
    casts = []
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.dtype == np.float32 and values.size >= _WORTH_HALVING:
            name = tensor.name
            tensor.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
            casts.append(helper.make_node("Cast", [tensor.name], [name], to=TensorProto.FLOAT))
    nodes = [*casts, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
    content: bytes = model.SerializeToString(deterministic=True)
    return content
