"""Checkpoints by the names under which they ship."""

from pathlib import Path

import pytest

from annotations.learning.settings.training_settings import parse_settings, read_settings
from annotations.prediction import shipped
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint
from annotations.prediction.errors.evaluation import SyntheticVolumes, evaluate_synthetic
from annotations.prediction.predictor import Predictor
from annotations.prediction.runtime import Runtime
from annotations.prediction.shipped import find_checkpoint, shipped_checkpoint, shipped_checkpoints
from annotations.synthesis.conditions import PLAIN_CONDITIONS
from tests.annotations.prediction.tiny_networks import save_tiny

RECIPES = Path(__file__).parents[3] / "docs" / "recipes"
LARGEST_SHIPPED = 12_000_000


@pytest.fixture
def needle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkpoint that ships, and an empty folder to work in."""
    path = save_tiny(tmp_path / "package" / "checkpoints" / "needle.onnx").path
    monkeypatch.setattr(shipped.resources, "files", lambda _package: tmp_path / "package")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return path


def test_what_ships_is_a_small_checkpoint_of_the_tool_that_it_is_named_after() -> None:
    assert "magnetic-forceps" in shipped_checkpoints()
    for name, path in shipped_checkpoints().items():
        description = load_checkpoint(path).description
        assert (description.name, description.tool.name) == (name, name)
        assert path.stat().st_size <= LARGEST_SHIPPED


def test_what_ships_was_made_by_the_recipes_of_its_name() -> None:
    for name, path in shipped_checkpoints().items():
        stages = load_checkpoint(path).description.training.stages
        for number, stage in enumerate(stages, 1):
            told = parse_settings(stage.settings, path)
            # Threads are the machine's.
            assert told.model_copy(update={"threads": 0}) == read_settings(RECIPES / f"{name}-{number}.toml")
        assert not (RECIPES / f"{name}-{len(stages) + 1}.toml").exists()


def test_what_ships_finds_the_tool_in_volumes_that_it_has_not_seen() -> None:
    path = shipped_checkpoint("magnetic-forceps")
    assert path is not None
    checkpoint = load_checkpoint(path)
    # A seed, and more noise, than any training has had.
    conditions = PLAIN_CONDITIONS.model_copy(update={"looks": (1.0, 1.0), "noise_sigma_grey": (12.0, 12.0)})
    table = evaluate_synthetic(
        Predictor(checkpoint, Runtime(checkpoint)), SyntheticVolumes(12, 5_000_011, conditions)
    ).table
    for overview in (table.by_formulas, table.by_fit):
        assert overview.targets["position_mm"].mean < 0.25
        assert overview.targets["orientation_deg"].mean < 2
        assert overview.far_share == 0


def test_a_checkpoint_goes_by_the_name_of_its_tool(needle: Path) -> None:
    assert shipped_checkpoints() == {"needle": needle}
    assert shipped_checkpoint("needle") == needle
    assert shipped_checkpoint("magnetic-forceps") is None
    assert find_checkpoint(Path("needle")) == needle


def test_a_file_of_that_name_comes_first_and_a_folder_does_not(needle: Path) -> None:
    Path("needle").mkdir()
    assert find_checkpoint(Path("needle")) == needle
    Path("needle").rmdir()
    Path("needle").touch()
    assert find_checkpoint(Path("needle")) == Path("needle")


@pytest.mark.parametrize("path", ["needle.onnx", "other/needle", "/needle", "a\0b.onnx"])
def test_a_path_is_no_name(needle: Path, path: str) -> None:
    assert find_checkpoint(Path(path)) == Path(path)


def test_a_name_that_nothing_has_is_told_with_those_that_there_are(needle: Path) -> None:
    with pytest.raises(CheckpointError, match="no checkpoint of that name ships") as caught:
        find_checkpoint(Path("needles"))
    assert "needle" in caught.value.remedy
    needle.unlink()
    with pytest.raises(CheckpointError) as caught:
        find_checkpoint(Path("needles"))
    assert caught.value.remedy == "Name a file"
