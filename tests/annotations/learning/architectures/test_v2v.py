"""V2V-PoseNet, and its regressing sibling."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network, parameter_count  # noqa: E402
from annotations.learning.settings.network_settings import NetworkSettings  # noqa: E402

torch.set_num_threads(1)


def test_it_has_the_published_number_of_parameters() -> None:
    network = build_network(NetworkSettings(kind="v2v", keypoints=21, input_shape=(88, 88, 88)))
    assert parameter_count(network) == pytest.approx(3.41e6, rel=0.002)


def test_the_regressing_network_is_about_as_large() -> None:
    shape = (32, 144, 88)
    heatmaps = build_network(NetworkSettings(kind="v2v", keypoints=6, input_shape=shape))
    regressing = build_network(
        NetworkSettings(kind="v2v-regression", keypoints=6, outputs=8, input_shape=shape)
    )
    assert parameter_count(regressing) == pytest.approx(parameter_count(heatmaps), rel=0.03)
    assert parameter_count(regressing) == pytest.approx(3.46e6, rel=0.002)


def test_a_heatmap_voxel_lies_in_the_middle_of_the_voxels_it_covers() -> None:
    # With kernels that are the same from both sides, a turned input gives turned heatmaps only if no layer
    # is shifted against another.
    torch.manual_seed(1)
    network = build_network(NetworkSettings(kind="v2v", keypoints=2, input_shape=(16, 24, 32), width=0.125))
    axes = (2, 3, 4)
    with torch.no_grad():
        for layer in network.modules():
            if isinstance(layer, torch.nn.Conv3d | torch.nn.ConvTranspose3d):
                layer.weight.copy_(layer.weight + layer.weight.flip(axes))
        volumes = torch.rand(2, 1, 16, 24, 32)
        heatmaps, turned = network(volumes), network(volumes.flip(axes))
    torch.testing.assert_close(turned.flip(axes), heatmaps, rtol=0, atol=1e-4 * float(heatmaps.abs().max()))


def test_numbers_start_in_the_middle_of_their_range() -> None:
    torch.manual_seed(1)
    network = build_network(
        NetworkSettings(kind="v2v-regression", keypoints=2, outputs=8, input_shape=(16, 24, 32), width=0.125)
    ).eval()
    with torch.no_grad():
        numbers = network(torch.rand(2, 1, 16, 24, 32))
    torch.testing.assert_close(numbers, torch.full((2, 8), 0.5), rtol=0, atol=0.05)
