"""Checkpoints by the names under which they ship."""

from pathlib import Path

import pytest

from annotations.prediction import shipped
from annotations.prediction.checkpoint import CheckpointError, load_checkpoint
from annotations.prediction.shipped import find_checkpoint, shipped_checkpoint, shipped_checkpoints
from tests.annotations.prediction.tiny_networks import save_tiny

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
    for name, path in shipped_checkpoints().items():
        assert load_checkpoint(path).description.tool.name == name
        assert path.stat().st_size <= LARGEST_SHIPPED


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
