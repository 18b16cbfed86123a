"""What a training consists of."""

import pytest

from annotations.errors import UserError
from annotations.learning.examples.examples import AnnotatedExamples
from annotations.learning.settings.training_settings import OptimizationSettings
from annotations.learning.training.training_plan import learning_rate_at, planned_parts
from tests.annotations.learning.tiny_training import annotated, examples, tiny_settings


def test_the_learning_rate_rises_and_then_falls_along_a_cosine() -> None:
    settings = OptimizationSettings(warm_up_share=0.1, final_share=0.01)
    rates = [learning_rate_at(share, 2.0, settings) for share in (0.0, 0.05, 0.1, 0.55, 1.0)]
    assert rates == pytest.approx([0.0, 1.0, 2.0, 2 * (0.01 + 0.99 / 2), 0.02])


def test_it_can_stay_as_it_is() -> None:
    settings = OptimizationSettings(warm_up_share=0.0, final_share=1.0)
    assert {learning_rate_at(share, 2.0, settings) for share in (0.0, 0.3, 0.99)} == {2.0}


def test_synthetic_volumes_come_before_annotated_ones() -> None:
    held_out = examples(1)
    first, second = planned_parts(tiny_settings(), annotated(3, 1), lambda: held_out)
    assert (first.name, first.epochs, first.volumes, first.validation) == ("synthetic", 2, 6, held_out)
    assert (second.name, second.epochs, second.volumes, len(second.validation)) == ("annotated", 2, 3, 1)
    assert second.learning_rate < first.learning_rate


def test_what_begins_with_annotated_volumes_has_the_full_learning_rate() -> None:
    settings = tiny_settings(synthetic={"volumes": 0})
    (part,) = planned_parts(settings, annotated(3), lambda: pytest.fail("no need of them"))
    assert part.learning_rate == settings.optimization.learning_rate


def test_a_network_that_has_learned_goes_on_with_new_synthetic_volumes_and_at_the_rate_for_tuning() -> None:
    settings = tiny_settings(annotated={"synthetic_share": 0.5})
    first, second = planned_parts(settings, annotated(6), lambda: (), seen=100)
    assert (first.synthetic_before, second.synthetic_before) == (100, 112)

    alone = tiny_settings(synthetic={"volumes": 0})
    (part,) = planned_parts(alone, annotated(3), lambda: (), seen=0)
    assert part.learning_rate == alone.annotated.learning_rate


def test_each_annotated_volume_is_seen_once_an_epoch_in_another_order() -> None:
    settings = tiny_settings(annotated={"synthetic_share": 0.5})
    part = planned_parts(settings, annotated(6), lambda: ())[1]
    assert (part.volumes, part.synthetic, part.synthetic_before) == (12, 6, 12)
    orders = [part.order(seed, epoch) for seed, epoch in ((0, 0), (0, 1), (1, 0), (0, 0))]
    for order in orders:
        assert sorted(order) == [-1] * 6 + list(range(6))
    assert (orders[0] == orders[3]).all()
    assert (orders[0] != orders[1]).any()
    assert (orders[0] != orders[2]).any()


def test_nothing_to_train_on_is_an_error() -> None:
    with pytest.raises(UserError, match="nothing to train on"):
        planned_parts(tiny_settings(synthetic={"volumes": 0}), AnnotatedExamples(), lambda: ())
