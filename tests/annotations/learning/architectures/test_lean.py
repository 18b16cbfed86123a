"""The lean network."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402

torch.set_num_threads(1)


def test_a_heatmap_a_keypoint_has_half_the_input_along_every_axis() -> None:
    network = build_network(NetworkSettings(keypoints=6, input_shape=(32, 160, 96)))
    with torch.no_grad():
        assert network(torch.rand(1, 1, 32, 160, 96)).shape == (1, 6, 16, 80, 48)
    assert network.heatmap_reduction == (2, 2, 2)


def test_it_has_as_many_parameters_as_its_description_says() -> None:
    network = build_network(NetworkSettings(keypoints=6, input_shape=(32, 160, 96)))
    assert parameter_count(network) == pytest.approx(2.712e6, rel=0.005)


def test_heatmaps_are_flat_before_any_training() -> None:
    torch.manual_seed(0)
    network = build_network(NetworkSettings(keypoints=3, input_shape=(16, 64, 64)))
    with torch.no_grad():
        heatmaps = network(torch.rand(2, 1, 16, 64, 64))
    assert heatmaps.abs().max() < 0.5
