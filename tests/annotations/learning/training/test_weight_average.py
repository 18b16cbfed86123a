"""The moving average of weights."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.architectures.networks import build_network  # noqa: E402
from annotations.learning.training.weight_average import WeightAverage  # noqa: E402
from tests.annotations.learning.tiny_training import tiny_settings  # noqa: E402

torch.set_num_threads(1)


def followed(decay: float, steps: int) -> tuple[list[float], float]:
    """Return the weight at each step, and its average."""
    network = build_network(tiny_settings().network_settings(keypoints=2, outputs=0))
    name, weight = next(iter(network.named_parameters()))
    average = WeightAverage(network, decay)
    values = []
    for step in range(steps):
        with torch.no_grad():
            weight.fill_(float(step))
        average.follow(network)
        values.append(float(step))
    return values, average.weights()[name].flatten()[0].item()


def test_without_decay_it_is_the_last() -> None:
    values, average = followed(0.0, 5)
    assert average == values[-1]


def test_it_lags_behind_by_its_decay() -> None:
    values, average = followed(0.5, 60)
    assert average == pytest.approx(values[-1] - 1, abs=1e-3)


def test_the_first_weights_are_soon_forgotten() -> None:
    _, average = followed(0.999, 1)
    # One step: a tenth of what was, which is far from what a step changes.
    assert abs(average) < 0.02


def test_it_begins_again_at_other_weights_and_soon_forgets_them() -> None:
    network = build_network(tiny_settings().network_settings(keypoints=2, outputs=0))
    name, weight = next(iter(network.named_parameters()))
    average = WeightAverage(network, 0.999)
    for _ in range(200):
        average.follow(network)
    with torch.no_grad():
        weight.fill_(0.0)

    average.begin_again(network.state_dict())

    assert not average.weights()[name].any()
    with torch.no_grad():
        weight.fill_(1.0)
    for _ in range(5):
        average.follow(network)
    assert average.weights()[name].flatten()[0].item() > 0.99


def test_numbers_that_are_counted_are_copied_and_the_network_stays_as_it_was() -> None:
    network = build_network(tiny_settings().network_settings(keypoints=2, outputs=0))
    average = WeightAverage(network, 0.9)
    network.train()(torch.rand(2, 1, 16, 32, 32))
    average.follow(network)
    counted = [name for name, value in network.state_dict().items() if not value.is_floating_point()]
    assert counted
    assert all(average.weights()[name].item() == 1 for name in counted)
    assert not average.network.training
    assert not any(weight.requires_grad for weight in average.network.parameters())
    assert network.training
