"""Inception3D."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402

torch.set_num_threads(1)


def test_it_has_as_many_parameters_as_its_description_says() -> None:
    settings = NetworkSettings(kind="inception3d", keypoints=6, outputs=8, input_shape=(32, 144, 88))
    assert parameter_count(build_network(settings)) == pytest.approx(14.25e6, rel=0.005)


def test_its_last_module_gives_the_published_number_of_features() -> None:
    settings = NetworkSettings(kind="inception3d", keypoints=6, outputs=8, input_shape=(32, 144, 88))
    (linear,) = (layer for layer in build_network(settings).modules() if isinstance(layer, torch.nn.Linear))
    assert (linear.in_features, linear.out_features) == (1024, 8)
