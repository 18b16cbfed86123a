"""From a network to a checkpoint: as ONNX, which runs without torch."""

import io
import warnings
from collections.abc import Mapping

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor

from annotations.learning.architectures.networks import build_network
from annotations.learning.architectures.pose_network import PoseNetwork
from annotations.learning.settings.network_settings import NetworkSettings

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

    Its weights keep their names, so that a training can begin with them (`weights_of`). The normalisation
    stays beside the convolutions: whoever runs the network merges them.

    Parameters
    ----------
    network : PoseNetwork
        On the processor, in evaluation mode.
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
            # As it is, which is in evaluation mode. To say so would merge the normalisation.
            training=torch.onnx.TrainingMode.PRESERVE,
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


def weights_of(model_bytes: bytes) -> dict[str, Tensor]:
    """Return the weights of a network in single precision, by the names that ONNX has for them.

    Parameters
    ----------
    model_bytes : bytes
        As `onnx_bytes` or `halved` gives them, or another exporter: its names are others.
    """
    graph = onnx.load_model_from_string(model_bytes).graph
    arrays = {each.name: numpy_helper.to_array(each) for each in graph.initializer}
    for node in graph.node:
        # What was halved has its own name again afterwards; equal tensors are written once, and handed on.
        if node.op_type == "Cast" and node.input[0] in arrays:
            arrays[node.output[0]] = arrays.pop(node.input[0])
        elif node.op_type == "Identity" and node.input[0] in arrays:
            arrays[node.output[0]] = arrays[node.input[0]]
    return {
        name: torch.from_numpy(values.astype(np.float32))
        for name, values in arrays.items()
        if values.dtype in (np.float16, np.float32)
    }
