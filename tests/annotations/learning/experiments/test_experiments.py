"""What is compared, and with which settings."""

import pytest

from annotations.learning.experiments.experiments import (
    EXPERIMENT_NAMES,
    EXPERIMENT_SIZES,
    ExperimentName,
    ExperimentRow,
    experiment,
    resized,
)
from annotations.learning.experiments.published_results import PUBLISHED_RESULTS
from annotations.learning.settings.training_settings import parse_settings
from annotations.volumes.sampling import PUBLISHED_SAMPLING

TINY, FULL = EXPERIMENT_SIZES["tiny"], EXPERIMENT_SIZES["full"]


def rows(name: ExperimentName) -> dict[str, ExperimentRow]:
    return {row.key: row for row in experiment(name, TINY).rows}


def differences(first: ExperimentRow, second: ExperimentRow) -> set[str]:
    fields = [row.settings.model_dump(mode="json") for row in (first, second)]

    def flat(content: dict[str, object], prefix: str = "") -> dict[str, object]:
        found: dict[str, object] = {}
        for name, value in content.items():
            found |= flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
        return found

    one, other = map(flat, fields)
    return {name for name in one if one[name] != other[name]}


def test_every_row_has_a_published_result_and_every_result_a_row() -> None:
    keys = {key for name in EXPERIMENT_NAMES for key in rows(name)}

    assert keys == set(PUBLISHED_RESULTS)


def test_rows_of_one_name_are_one_training_in_all_experiments() -> None:
    settings = {}
    for name in EXPERIMENT_NAMES:
        for key, row in rows(name).items():
            assert settings.setdefault(key, row.settings) == row.settings


def test_the_full_size_is_as_published() -> None:
    for row in experiment("networks", FULL).rows:
        how = row.settings.optimization
        assert row.settings.sampling == PUBLISHED_SAMPLING
        assert row.settings.sampling.padded_shape == (32, 144, 88)
        assert (row.settings.annotated.epochs, how.batch, row.settings.network.width) == (500, 25, 1)
        rate = 1e-5 if row.settings.network.kind == "v2v" else 1e-4
        assert (how.learning_rate, row.settings.annotated.learning_rate) == (rate, rate)
        # No schedule.
        assert (how.final_share, how.warm_up_share, how.weight_decay) == (1, 0, 0)
    assert (FULL.training, FULL.validation) == (152, 40)


def test_pre_training_is_all_that_differs_from_the_same_network() -> None:
    found = rows("networks")

    for kind in ("inception3d", "resnext3d", "v2v"):
        assert found[f"{kind}-pretrained"].settings.synthetic.volumes > 0
        assert differences(found[kind], found[f"{kind}-pretrained"]) == {"synthetic.volumes"}


@pytest.mark.parametrize(
    ("key", "names"),
    [
        ("v2v-weight-decay", {"optimization.weight_decay"}),
        ("v2v-dropout", {"network.dropout"}),
        ("v2v-shift", {"augmentation.shift_voxels"}),
        ("v2v-occlusion", {"augmentation.occlusion_chance"}),
        ("v2v-mixup", {"augmentation.mixup_alpha"}),
    ],
)
def test_a_regulariser_is_all_that_differs(key: str, names: set[str]) -> None:
    found = rows("regularisers")

    assert differences(found["v2v"], found[key]) == names


def test_temperatures_differ_in_nothing_else() -> None:
    found = rows("temperatures")

    temperatures = [found[f"v2v-temperature-{each}"] for each in (1, 10, 100, 1000)]
    for row in temperatures[1:]:
        assert differences(temperatures[0], row) == {"heatmaps.temperature"}
    assert {(row.settings.loss.heatmap, row.settings.loss.coordinate) for row in temperatures} == {(1, 1)}


def test_targets_differ_in_the_heatmaps_and_heads_in_the_network() -> None:
    targets, heads = rows("targets"), rows("heads")

    assert {name.partition(".")[0] for name in differences(*targets.values())} == {"heatmaps"}
    assert differences(*heads.values()) >= {"network.kind"}
    assert not heads["v2v-regression"].settings.gives_heatmaps


@pytest.mark.parametrize("size", list(EXPERIMENT_SIZES.values()), ids=lambda size: size.name)
def test_the_settings_of_every_size_are_settings(size) -> None:  # type: ignore[no-untyped-def]
    for name in EXPERIMENT_NAMES:
        for row in experiment(name, size, seed=3).rows:
            assert parse_settings(row.settings.as_toml(), row.key) == row.settings
            assert (row.settings.seed, row.settings.annotated.split_seed) == (3, 3)


def test_a_size_can_have_other_numbers() -> None:
    size = resized(TINY, volumes=10, epochs=3)

    assert (size.training, size.validation, size.epochs) == (8, 2, 3)
    assert resized(TINY) == TINY


def test_reduced_sizes_say_so() -> None:
    assert "reduced" in TINY.in_words
    assert "published" in FULL.in_words
