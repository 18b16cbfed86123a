"""What a network has seen in all its trainings."""

from typing import Any

import pytest
from pydantic import ValidationError

from annotations.learning.training.stages import (
    learned_fingerprints,
    learned_seeds,
    learned_volumes,
    said_settings,
    seen_seeds,
)
from annotations.prediction.checkpoint_description import TrainingOrigin, TrainingSummary
from annotations.prediction.training_words import training_in_words
from tests.annotations.learning.tiny_training import tiny_settings

FIRST, SECOND, THIRD = ("a" * 64, "b" * 64, "c" * 64)


def stage(origin: TrainingSummary | None = None, **fields: Any) -> TrainingSummary:
    begun = None if origin is None else TrainingOrigin(name="earlier", sha256=FIRST, training=origin)
    return TrainingSummary(origin=begun, **fields)


def settings(seed: int, volumes: int, validation: int = 9) -> str:
    changes = {"synthetic": {"seed": seed, "volumes": volumes}, "validation": {"seed": validation}}
    return tiny_settings(**changes).as_toml()


def test_stages_come_in_their_order() -> None:
    last = stage(stage(stage(epochs=1), epochs=2), epochs=3)
    assert [each.epochs for each in last.stages] == [1, 2, 3]
    assert TrainingSummary.model_validate(last.model_dump(mode="json")) == last


def test_what_any_stage_has_seen_counts() -> None:
    first = stage(settings=settings(5, 12), synthetic_volumes=12, training_fingerprints=(FIRST,))
    second = stage(first, settings=settings(6, 0, validation=8), training_fingerprints=(SECOND,))
    last = stage(second, settings=settings(5, 30), synthetic_volumes=30, validation_fingerprints=(THIRD,))

    assert seen_seeds(last) == {5, 8, 9}
    assert [learned_volumes(last, seed) for seed in (5, 6, 7)] == [42, 0, 0]
    assert learned_fingerprints(last) == {FIRST, SECOND}
    # Among annotated volumes, with none before them.
    mixed = stage(last, settings=settings(7, 0), synthetic_volumes=3)
    assert learned_seeds(mixed) == {5, 7}


def test_settings_of_another_program_say_nothing() -> None:
    last = stage(stage(settings=settings(5, 12), synthetic_volumes=12), settings="lr = 'fast'")
    assert said_settings(last) is None
    assert seen_seeds(last) == {5, 9}
    assert seen_seeds(stage()) == frozenset()


def test_a_history_that_is_absurdly_long_is_refused() -> None:
    fields: dict[str, Any] = {}
    for _ in range(400):
        fields = {"origin": {"name": "earlier", "sha256": FIRST, "training": fields}}
    with pytest.raises(ValidationError):
        TrainingSummary.model_validate(fields)


def test_words_begin_with_the_first_stage() -> None:
    last = stage(stage(synthetic_volumes=4000), annotated_volumes=7, studies=("Needles",))
    said = "4,000 synthetic volumes; from there (earlier) on 7 annotated volumes of Needles"
    assert training_in_words(last) == said
