import pytest
from pydantic import ValidationError

from annotations.learning.settings.loss_settings import LossSettings


def test_only_weights_above_zero_need_coordinates() -> None:
    assert LossSettings().needs_coordinates
    assert LossSettings(coordinate=0.0, pose=1.0).needs_coordinates
    assert not LossSettings(coordinate=0.0).needs_coordinates


def test_a_loss_without_any_weight_is_refused() -> None:
    with pytest.raises(ValidationError, match="must be above 0"):
        LossSettings(heatmap=0.0, coordinate=0.0)


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf"), "1"])
def test_a_weight_is_a_finite_number_of_zero_or_more(weight: object) -> None:
    with pytest.raises(ValidationError):
        LossSettings.model_validate({"coordinate": weight})
