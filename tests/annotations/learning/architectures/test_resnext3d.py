"""ResNeXt3D."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402

torch.set_num_threads(1)

SETTINGS = NetworkSettings(kind="resnext3d", keypoints=6, outputs=8, input_shape=(32, 144, 88))


def test_it_has_as_many_parameters_as_its_description_says() -> None:
    assert parameter_count(build_network(SETTINGS)) == pytest.approx(25.8e6, rel=0.005)


def test_every_block_has_one_convolution_of_32_groups() -> None:
    layers = [layer for layer in build_network(SETTINGS).modules() if isinstance(layer, torch.nn.Conv3d)]
    grouped = [layer for layer in layers if layer.groups == 32]
    assert len(grouped) == 3 + 4 + 6 + 3
    assert all(layer.kernel_size == (3, 3, 3) for layer in grouped)
    assert all(layer.groups == 1 for layer in layers if layer not in grouped)
