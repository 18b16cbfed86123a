"""The state of a training that was interrupted."""

import os
from pathlib import Path
from typing import Any

import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.errors import UserError  # noqa: E402
from annotations.learning.training.training_folder import STATE_FILE, Progress, TrainingFolder  # noqa: E402
from tests.annotations.learning.tiny_training import tiny_settings  # noqa: E402


class Hostile:
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.folder),)


@pytest.fixture
def folder(tmp_path: Path) -> TrainingFolder:
    return TrainingFolder(tmp_path / "c.onnx", tiny_settings(), {"another tool": "abc"})


def test_there_is_none_to_begin_with(folder: TrainingFolder) -> None:
    assert folder.read() is None


def test_a_state_is_read_as_it_was_written(folder: TrainingFolder) -> None:
    progress = Progress(part=1, epoch=2, rows=[{"part": "synthetic", "epoch": 1, "loss": 0.1 + 0.2}])
    progress.add_step({"loss": 1.5})
    progress.keep_as_best(0.5, {"position_mm": (0.25, 0.125)}, 7)

    folder.write(progress, {"network": {"weight": torch.arange(3.0)}}, 11, is_last=False)

    saved = folder.read()
    assert saved is not None
    assert saved.progress == progress
    assert saved.average_steps == 11
    assert torch.equal(saved.tensors["network"]["weight"], torch.arange(3.0))
    assert not (folder.path / "curves.svg").exists()


def test_a_state_of_other_data_is_refused_by_what_is_other(folder: TrainingFolder, tmp_path: Path) -> None:
    folder.write(Progress(), {}, 0, is_last=False)
    now = {"another tool": "abc", "other weights": "def"}
    with pytest.raises(UserError, match="the training was begun with other weights"):
        TrainingFolder(tmp_path / "c.onnx", tiny_settings(), now).read()


@pytest.mark.parametrize("content", [b"", b"no state", b"PK\x03\x04"])
def test_a_damaged_state_is_refused(folder: TrainingFolder, content: bytes) -> None:
    folder.path.mkdir()
    (folder.path / STATE_FILE).write_bytes(content)
    with pytest.raises(UserError, match="no state of a training") as error:
        folder.read()
    assert "--restart" in error.value.remedy


def test_the_code_in_a_hostile_state_does_not_run(folder: TrainingFolder, tmp_path: Path) -> None:
    folder.path.mkdir()
    torch.save({"version": Hostile(tmp_path / "made")}, folder.path / STATE_FILE)
    with pytest.raises(UserError, match="no state of a training"):
        folder.read()
    assert not (tmp_path / "made").exists()


def test_means_are_over_the_steps_of_the_epoch() -> None:
    progress = Progress()
    progress.add_step({"loss": 1.0, "loss_heatmap": 3.0})
    progress.add_step({"loss": 2.0, "loss_heatmap": 5.0})
    assert progress.mean_losses == {"loss": 1.5, "loss_heatmap": 4.0}
    progress.finish_epoch(6)
    assert (progress.epoch, progress.step, progress.losses, progress.synthetic_volumes) == (1, 0, {}, 6)
