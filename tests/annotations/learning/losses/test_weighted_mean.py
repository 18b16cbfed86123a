"""The mean of losses over what is known."""

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.learning.losses.weighted_mean import weighted_mean  # noqa: E402

torch.set_num_threads(1)


def test_what_does_not_count_is_in_neither_sum_nor_number() -> None:
    losses = torch.tensor([[1.0, 2.0], [4.0, 100.0]])
    is_counted = torch.tensor([[True, True], [True, False]])
    assert weighted_mean(losses, is_counted, torch.ones(2)).item() == pytest.approx(7 / 3)


def test_weights_scale_the_sum_and_not_the_number() -> None:
    losses = torch.tensor([[1.0], [4.0]])
    found = weighted_mean(losses, torch.ones(2, 1, dtype=torch.bool), torch.tensor([0.5, 0.25]))
    assert found.item() == pytest.approx((0.5 * 1 + 0.25 * 4) / 2)


def test_the_mean_of_nothing_is_zero_and_has_a_gradient() -> None:
    losses = torch.ones(3, 2, requires_grad=True)
    total = weighted_mean(losses, torch.zeros(3, 2, dtype=torch.bool), torch.ones(3))
    total.backward()
    assert total.item() == 0
    assert losses.grad is not None
    assert (losses.grad == 0).all()
