"""``annotations train``."""

import csv
import importlib.util
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from annotations.cli import main
from annotations.documents.record import changed
from annotations.learning.settings.training_settings import TrainingSettings, parse_settings
from annotations.prediction.checkpoint import load_checkpoint, save_checkpoint
from annotations.prediction.checkpoint_description import TrainingSummary
from annotations.synthesis import write_study
from tests.annotations.learning.tiny_training import TINY, TOOL
from tests.annotations.prediction.known_keypoints import described
from tests.needs_torch import needs_torch


@pytest.fixture
def recipe(tmp_path: Path) -> Path:
    path = tmp_path / "recipe.toml"
    path.write_text(tomli_w.dumps(TINY | {"threads": 1}), encoding="utf-8")
    return path


def log(checkpoint: Path) -> list[dict[str, str]]:
    path = checkpoint.with_name(checkpoint.name + ".training") / "log.csv"
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_usual_settings_are_printed_and_nothing_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "--print-config"]) == 0
    assert parse_settings(capsys.readouterr().out, "printed") == TrainingSettings()


def test_settings_of_a_file_are_printed_whole(recipe: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "--print-config", "--config", str(recipe), "--threads", "2"]) == 0
    printed = parse_settings(capsys.readouterr().out, "printed")
    assert (printed.threads, printed.optimization.batch) == (2, 3)


def test_wrong_settings_are_said_with_their_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "recipe.toml"
    path.write_text("[optimization]\nbatch = 0\n", encoding="utf-8")
    assert main(["train", "-o", str(tmp_path / "c.onnx"), "--config", str(path)]) == 1
    assert f"{path}: optimization.batch" in capsys.readouterr().err


@needs_torch
def test_a_folder_is_no_checkpoint_and_nothing_is_trained(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "c.onnx").mkdir()
    assert main(["train", "-o", str(tmp_path / "c.onnx"), "--config", str(recipe)]) == 1
    assert "it is a folder" in capsys.readouterr().err
    assert not (tmp_path / "c.onnx.training").exists()


def test_a_checkpoint_must_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["train"])
    assert "-o/--output" in capsys.readouterr().err


def test_without_torch_it_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "torch" else found(name, *rest)
    )
    assert main(["train", "-o", str(tmp_path / "c.onnx")]) == 1
    assert "pip install 'oct-annotator[train]'" in capsys.readouterr().err


@needs_torch
def test_a_study_makes_a_checkpoint(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path / "study", TOOL, count=4, seed=3, shape=(20, 40, 40), title="Four")
    path = tmp_path / "forceps.onnx"

    assert main(["train", str(tmp_path / "study"), "-o", str(path), "--config", str(recipe)]) == 0

    out, err = capsys.readouterr()
    assert out.strip() == str(path)
    assert "annotated 2/2: loss" in err
    description = load_checkpoint(path).description
    assert (description.name, description.network, description.tool) == ("forceps", "lean", TOOL)
    training = description.training
    assert (training.studies, training.annotated_volumes, training.synthetic_volumes) == (("Four",), 3, 12)
    assert training.validation_volumes == 1
    assert len(training.training_fingerprints) == 3
    assert parse_settings(training.settings, "checkpoint").annotated.epochs == 2
    assert [row["part"] for row in log(path)] == ["synthetic"] * 2 + ["annotated"] * 3


def saved_network(path: Path) -> Path:
    """Write a checkpoint of a tiny network that says that it has learned from three synthetic volumes."""
    from annotations.learning.architectures.networks import build_network
    from annotations.learning.exporting import onnx_bytes

    settings = parse_settings(tomli_w.dumps(TINY), "tiny")
    description = changed(
        described(settings.sampling, settings.heatmaps, name="first"),
        network="lean",
        training=TrainingSummary(synthetic_volumes=3, settings=settings.as_toml()),
    )
    network = build_network(settings.network_settings(len(TOOL.keypoint_names), outputs=0)).eval()
    save_checkpoint(path, description, onnx_bytes(network))
    return path


@needs_torch
def test_a_checkpoint_is_tuned_on_a_study(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = saved_network(tmp_path / "first.onnx"), tmp_path / "second.onnx"
    write_study(tmp_path / "study", TOOL, count=4, seed=3, shape=(20, 40, 40), title="Four")
    tuning = {name: TINY[name] for name in ("device", "network", "heatmaps", "sampling", "optimization")}
    recipe.write_text(tomli_w.dumps(tuning | {"threads": 1, "annotated": {"epochs": 1}}), encoding="utf-8")

    arguments = ["train", str(tmp_path / "study"), "-o", str(second), "--config", str(recipe)]
    assert main([*arguments, "--from", str(first)]) == 0

    training = load_checkpoint(second).description.training
    assert (training.synthetic_volumes, training.annotated_volumes, training.epochs) == (0, 3, 1)
    assert len(training.validation_fingerprints) == 1
    assert training.origin is not None
    assert training.origin.sha256 == load_checkpoint(first).sha256
    assert training.origin.training == load_checkpoint(first).description.training
    assert [(row["part"], row["epoch"]) for row in log(second)] == [("annotated", "0"), ("annotated", "1")]
    assert main(["checkpoint", "info", str(second)]) == 0
    assert "3 synthetic volumes" in (told := capsys.readouterr().out)
    assert "from there (first) on 3 annotated volumes of Four" in told


@needs_torch
def test_what_a_training_begins_with_is_not_replaced_by_it(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = saved_network(tmp_path / "c.onnx")
    before = path.read_bytes()
    assert main(["train", "-o", str(path), "--config", str(recipe), "--from", str(path)]) == 1
    assert "would replace what it begins with" in capsys.readouterr().err
    assert path.read_bytes() == before


@needs_torch
def test_weights_of_another_network_are_refused_before_volumes_are_read(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path / "study", TOOL, count=1, seed=3, shape=(20, 40, 40))
    recipe.write_text("[network]\nkind = 'v2v'\n", encoding="utf-8")
    monkeypatch.setattr(
        "annotations.learning.examples.annotated_examples.annotated_examples",
        lambda *_rest: pytest.fail("read"),
    )
    arguments = ["-o", str(tmp_path / "c.onnx"), "--config", str(recipe), "--from", "magnetic-forceps"]
    assert main(["train", str(tmp_path / "study"), *arguments]) == 1
    assert "Say network.kind = 'lean' in the settings" in capsys.readouterr().err


@needs_torch
def test_a_network_without_keypoints_makes_no_checkpoint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "recipe.toml"
    path.write_text("[network]\nkind = 'resnext3d'\n", encoding="utf-8")
    assert main(["train", "-o", str(tmp_path / "c.onnx"), "--config", str(path)]) == 1
    assert "tells no keypoints" in capsys.readouterr().err


@needs_torch
def test_the_tool_is_the_studys(tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_study(tmp_path / "study", TOOL, count=1, seed=3, shape=(20, 40, 40))
    arguments = ["-o", str(tmp_path / "c.onnx"), "--config", str(recipe), "--tool", "needle"]
    assert main(["train", str(tmp_path / "study"), *arguments]) == 1
    assert "of the tool 'magnetic-forceps', not of 'needle'" in capsys.readouterr().err


@needs_torch
@pytest.mark.parametrize("asked", [signal.SIGINT, signal.SIGTERM])
def test_a_training_that_is_interrupted_goes_on_when_the_command_is_given_again(
    asked: signal.Signals,
    tmp_path: Path,
    recipe: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from annotations.learning.training.training import Training

    path, steps = tmp_path / "c.onnx", []
    arguments = ["train", "-o", str(path), "--config", str(recipe)]
    step = Training._step

    def interrupted_step(training: Training, *rest: Any) -> dict[str, float]:
        steps.append(training.progress.step)
        if len(steps) == 3:
            signal.raise_signal(asked)
        return step(training, *rest)

    monkeypatch.setattr(Training, "_step", interrupted_step)
    assert main(arguments) == 130
    assert "the same command goes on from here" in capsys.readouterr().err
    assert not path.exists()

    assert main(arguments) == 0
    assert "going on from" in capsys.readouterr().err
    assert steps == [0, 1, 0, 1]
    assert [row["epoch"] for row in log(path)] == ["1", "2"]


@needs_torch
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_training_that_was_killed_goes_on_from_its_last_epoch(
    tmp_path: Path, recipe: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "c.onnx"
    arguments = ["train", "-o", str(path), "--config", str(recipe)]
    process = subprocess.Popen([sys.executable, "-m", "annotations.cli", *arguments], stderr=subprocess.PIPE)
    with process:
        assert process.stderr is not None
        # What comes first is said before the second epoch is saved, and after the first was.
        for line in process.stderr:
            if line.startswith(b"synthetic 2/2:"):
                process.kill()
                break
    assert process.returncode == -signal.SIGKILL
    assert not path.exists()

    assert main(arguments) == 0

    assert "going on from" in capsys.readouterr().err
    assert [row["epoch"] for row in log(path)] == ["1", "2"]
    assert load_checkpoint(path).description.training.synthetic_volumes == 12
