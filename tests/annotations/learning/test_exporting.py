"""Networks as ONNX: whole and in half the bytes."""

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch
onnxruntime = pytest.importorskip("onnxruntime")

from annotations.learning.architectures.networks import build_network  # noqa: E402
from annotations.learning.architectures.pose_network import PoseNetwork  # noqa: E402
from annotations.learning.exporting import halved, onnx_bytes  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402
from annotations.prediction.onnx_graph import GraphProblem, check_model, parse_model  # noqa: E402

SHAPE = (16, 32, 32)


@pytest.fixture
def network() -> PoseNetwork:
    torch.set_num_threads(1)
    torch.manual_seed(3)
    network = build_network(NetworkSettings(keypoints=2, input_shape=SHAPE, width=0.5))
    with torch.no_grad():
        # Statistics and a head that are not those of a fresh network, whose output is nearly 0 everywhere.
        for _ in range(3):
            network(torch.rand(2, 1, *SHAPE))
        network.head.weight.mul_(100)
    return network.eval()


def output_of(model_bytes: bytes, volume: np.ndarray) -> np.ndarray:
    return onnxruntime.InferenceSession(model_bytes).run(None, {"volume": volume})[0]


def test_another_runtime_gives_what_torch_gives(network: PoseNetwork) -> None:
    volume = np.random.default_rng(1).random((1, 1, *SHAPE), dtype=np.float32)

    found = output_of(onnx_bytes(network), volume)

    assert np.abs(found).max() > 0.1
    with torch.no_grad():
        assert np.abs(found - network(torch.from_numpy(volume)).numpy()).max() < 1e-4


def test_a_halved_network_has_half_the_bytes_and_rounds_its_weights_alone(network: PoseNetwork) -> None:
    volume = np.random.default_rng(1).random((1, 1, *SHAPE), dtype=np.float32)
    whole = onnx_bytes(network)

    half = halved(whole)

    assert len(half) < 0.55 * len(whole)
    exact, rounded = output_of(whole, volume), output_of(half, volume)
    assert 0 < np.abs(rounded - exact).max() < 2e-3 * np.abs(exact).max()


def test_a_halved_network_may_be_a_checkpoint(network: PoseNetwork) -> None:
    check_model(parse_model(halved(onnx_bytes(network))), (1, 1, *SHAPE), (1, 2, 8, 16, 16))


def test_a_cast_to_anything_but_single_precision_is_refused(network: PoseNetwork) -> None:
    model = parse_model(halved(onnx_bytes(network)))
    cast = next(node for node in model.graph.node if node.op_type == "Cast")
    cast.attribute[0].i = 11  # 64 bits

    with pytest.raises(GraphProblem, match="Cast"):
        check_model(model, (1, 1, *SHAPE), (1, 2, 8, 16, 16))
