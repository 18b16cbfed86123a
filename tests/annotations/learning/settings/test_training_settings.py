"""The settings of a training."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from annotations.learning.settings.training_settings import (
    SettingsError,
    TrainingSettings,
    parse_settings,
    read_settings,
)
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.synthesis.conditions import TRAINING_CONDITIONS
from annotations.volumes.sampling import OMES_SAMPLING


def test_nothing_need_be_said() -> None:
    settings = parse_settings("", "empty")
    assert settings == TrainingSettings()
    assert settings.network.kind == "lean"
    assert settings.sampling == OMES_SAMPLING
    assert settings.synthetic.conditions == TRAINING_CONDITIONS


def test_what_is_left_out_is_as_by_default() -> None:
    settings = parse_settings("[optimization]\nbatch = 5\n", "x")
    assert settings.optimization.batch == 5
    assert settings.optimization.learning_rate == TrainingSettings().optimization.learning_rate


@pytest.mark.parametrize(
    "settings",
    [
        TrainingSettings(),
        parse_settings(
            'seed = 4\n[annotated]\nannotator = "Ann"\nshares = [0.5, 0.3, 0.2]\n'
            "[synthetic.conditions]\nclutter = [1, 2]\n[augmentation]\nflip_axes = []\n",
            "x",
        ),
    ],
)
def test_they_are_the_same_after_being_written(settings: TrainingSettings) -> None:
    assert parse_settings(settings.as_toml(), "written") == settings


def test_a_network_that_has_learned_goes_on_without_synthetic_volumes_unless_they_are_asked_for() -> None:
    assert parse_settings("[synthetic]\nseed = 3\n", "x").going_on().synthetic.volumes == 0
    asked = parse_settings("[synthetic]\nvolumes = 40\n", "x")
    assert asked.going_on() == asked


def test_arrays_are_written_on_one_line() -> None:
    written = TrainingSettings().as_toml()
    assert "shape = [28, 139, 83]\n" in written
    assert "\n]" not in written


def test_a_table_of_conditions_replaces_all_of_them() -> None:
    conditions = parse_settings("[synthetic.conditions]\nclutter = [1, 2]\n", "x").synthetic.conditions
    assert conditions.clutter == (1, 2)
    assert conditions.looks is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[network]\nkind = 'large'", "network.kind: Input should be 'lean'"),
        (
            "[optimization]\nbatch = 0",
            "optimization.batch: Input should be greater than or equal to 1, found 0",
        ),
        ("[optimization]\nbatch = 8.0", "optimization.batch"),
        ("[optimisation]\nbatch = 8", "the field 'optimisation' is unknown"),
        ("[annotated]\nshares = [0.8, 0.3]", "annotated: the shares 0.8 0.3 do not add up to 1"),
        ("[validation]\nseed = 1", "validation.seed is that of the volumes for training"),
        ("[sampling]\nshape = [28, 139, 83]", "the field 'sampling.spacing_um' is missing"),
        (
            "[heatmaps]\ntarget = 'gaussian'\ndecoding = 'argmax'",
            "an argmax has no gradient: say loss.coordinate = 0.0",
        ),
    ],
)
def test_what_is_wrong_is_said_with_the_file_and_the_field(text: str, said: str) -> None:
    with pytest.raises(SettingsError) as error:
        parse_settings(text, "recipe.toml")
    assert str(error.value).startswith(f"recipe.toml: {said}")
    assert "annotations train --print-config" in error.value.remedy


def test_an_input_that_the_network_cannot_take_is_refused() -> None:
    fields: dict[str, Any] = {"sampling": {"shape": [28, 139, 83], "spacing_um": [622.0, 189.0, 131.6]}}
    with pytest.raises(SettingsError, match=r"multiples of \(16, 32, 32\) voxels"):
        parse_settings(tomli_w.dumps(fields), "x")


def test_synthetic_volumes_are_of_bytes() -> None:
    sampling = OMES_SAMPLING.model_copy(update={"dtype": "uint16"}).model_dump(mode="json")
    with pytest.raises(SettingsError, match=r"say synthetic\.volumes = 0"):
        parse_settings(tomli_w.dumps({"sampling": sampling}), "x")
    parse_settings(tomli_w.dumps({"sampling": sampling, "synthetic": {"volumes": 0}}), "x")


def test_samples_are_no_finer_than_the_voxels_of_synthetic_volumes() -> None:
    sampling = OMES_SAMPLING.model_copy(update={"spacing_um": (622.0, 189.0, 5.0)}).model_dump(mode="json")
    with pytest.raises(SettingsError, match=r"sampling\.spacing_um is finer than the voxels"):
        parse_settings(tomli_w.dumps({"sampling": sampling}), "x")
    parse_settings(tomli_w.dumps({"sampling": sampling, "synthetic": {"volumes": 0}}), "x")


def test_a_file_that_is_absent_or_no_toml_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="could not be read"):
        read_settings(tmp_path / "absent.toml")
    path = tmp_path / "broken.toml"
    path.write_text("seed = \n", encoding="utf-8")
    with pytest.raises(SettingsError, match="not valid TOML"):
        read_settings(path)
    path.write_text("seed = 3\n", encoding="utf-8")
    assert read_settings(path).seed == 3


def test_every_section_is_written() -> None:
    written = tomllib.loads(TrainingSettings().as_toml())
    assert set(written) == set(TrainingSettings.model_fields)


def test_whether_the_network_gives_heatmaps() -> None:
    assert TrainingSettings(heatmaps=HeatmapConvention()).gives_heatmaps
    assert not parse_settings("[network]\nkind = 'resnext3d'", "x").gives_heatmaps
