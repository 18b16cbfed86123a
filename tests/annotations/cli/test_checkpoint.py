import importlib.util
from pathlib import Path
from typing import Any

import pytest

from annotations.cli import main
from annotations.documents.record import changed
from annotations.prediction.checkpoint import load_checkpoint, save_checkpoint
from annotations.prediction.heatmaps import HeatmapConvention
from tests.annotations.prediction.tiny_networks import DESCRIPTION, network, save_tiny
from tests.needs_torch import needs_torch


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return save_tiny(tmp_path / "tiny.onnx").path


def test_info_says_everything_in_words(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["checkpoint", "info", str(path)]) == 0

    captured = capsys.readouterr()
    assert captured.err == ""
    for text in (
        str(path),
        "Tiny",
        "test, 18 parameters",
        "needle (Needle: tip and shaft)",
        "tip, shaft",
        "uint8, light along axis 2",
        "6 × 10 × 8, every 600 × 200 × 100 µm",
        "means along the light",
        "37.7358 × 14.8148 × 10.6383 voxels of a full volume",
        "1 × 1 × 2 before and 1 × 1 × 2 after",
        "8 × 12 × 12",
        "0 to 255 become 0 to 1",
        "4 × 6 × 6, a voxel over 2 × 2 × 2",
        "the mean of the softmax; taught as distribution",
        "0.30 × 0.10 × 0.15 mm before",
        "1,200 synthetic volumes, 40 annotated volumes of Needles, 30 epochs, 62 minutes",
        "position (mm) 0.31 ± 0.12, on 8 other volumes",
        "2026-05-04 03:02 UTC",
        "oct-checkpoint/1",
        load_checkpoint(path).sha256,
    ):
        assert text in captured.out


def test_info_says_the_published_convention_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    convention = HeatmapConvention(
        target="gaussian", decoding="soft-argmax", temperature=100.0, sigma_voxel=(1.7, 1.7, 1.7), shrink=0.8
    )
    path = tmp_path / "published.onnx"
    save_checkpoint(path, changed(DESCRIPTION, heatmaps=convention), network().SerializeToString())

    assert main(["checkpoint", "info", str(path)]) == 0

    printed = capsys.readouterr().out
    assert "softmax of 100 times the heatmap; taught as gaussian, σ of 1.7 × 1.7 × 1.7" in printed
    assert "shrunk by 0.8" in printed


def test_info_as_json_has_every_field(path: Path, run_json: Any) -> None:
    code, [fields], messages = run_json("checkpoint", "info", path)

    assert (code, messages) == (0, "")
    assert fields["path"] == str(path)
    assert fields["sha256"] == load_checkpoint(path).sha256
    assert fields["input_shape"] == [1, 1, 8, 12, 12]
    assert fields["output_shape"] == [1, 2, 4, 6, 6]
    assert fields["strides_of_realtime_volume"] == pytest.approx([0.9646, 14.8148, 10.6383])
    assert fields["margin_before_um"] == pytest.approx([300, 100, 150])
    assert fields["description"] == DESCRIPTION.model_dump(mode="json")


def test_what_would_steer_a_terminal_is_not_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "odd.onnx"
    description = changed(DESCRIPTION, name="odd\x1b[2Jname\nsecond line")
    save_checkpoint(path, description, network().SerializeToString())

    assert main(["checkpoint", "info", str(path)]) == 0

    printed = capsys.readouterr().out
    assert "\x1b" not in printed
    assert "odd�[2Jname�second line" in printed


def test_a_wrong_file_keeps_no_other_from_its_turn(tmp_path: Path, path: Path, run_json: Any) -> None:
    wrong = tmp_path / "wrong.onnx"
    wrong.write_bytes(b"PK\x03\x04")

    code, objects, messages = run_json("checkpoint", "info", wrong, path)

    assert code == 1
    assert "PyTorch" in messages
    assert "annotations checkpoint convert" in messages
    assert ["error" in fields for fields in objects] == [True, False]


def test_a_conversion_without_torch_names_the_extra(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)

    assert main(["checkpoint", "convert", str(tmp_path / "best.pt"), "-o", str(tmp_path / "c.onnx")]) == 1

    assert "pip install 'oct-annotator[train]'" in capsys.readouterr().err


def test_a_conversion_replaces_nothing(
    tmp_path: Path, path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # So that it is tested without torch as well.
    monkeypatch.setattr("annotations.cli.checkpoint.require_torch", lambda _what: None)
    before = path.read_bytes()

    assert main(["checkpoint", "convert", str(tmp_path / "best.pt"), "-o", str(path)]) == 1
    assert "not overwritten" in capsys.readouterr().err
    assert main(["checkpoint", "convert", str(tmp_path / "best.pt"), "-o", str(tmp_path)]) == 1
    assert "folder" in capsys.readouterr().err
    assert path.read_bytes() == before


@needs_torch
def test_weights_become_a_checkpoint(tmp_path: Path, run_json: Any) -> None:
    from annotations.learning.architectures.networks import build_network
    from annotations.learning.settings.network_settings import NetworkSettings
    from annotations.learning.training.state_file import write_state
    from annotations.volumes.sampling import Sampling

    sampling = Sampling(shape=(16, 32, 32), spacing_um=(600.0, 200.0, 100.0))
    description = changed(DESCRIPTION, sampling=sampling)
    settings = NetworkSettings(keypoints=2, input_shape=(16, 32, 32), width=0.1)
    state, output = tmp_path / "best.pt", tmp_path / "c.onnx"
    write_state(state, description, settings, build_network(settings).state_dict())

    code, [fields], messages = run_json("checkpoint", "convert", state, "-o", output)

    assert (code, messages) == (0, "")
    assert fields["original"] == str(state)
    assert load_checkpoint(output).sha256 == fields["sha256"]
    assert load_checkpoint(output).description == description


@needs_torch
def test_weights_that_are_none_are_refused(tmp_path: Path, run_json: Any) -> None:
    (tmp_path / "best.pt").write_bytes(b"PK\x03\x04")

    code, [fields], messages = run_json(
        "checkpoint", "convert", tmp_path / "best.pt", "-o", tmp_path / "c.onnx"
    )

    assert code == 1
    assert "best.pt" in messages
    assert "error" in fields
    assert not (tmp_path / "c.onnx").exists()


@pytest.mark.parametrize("arguments", [[], ["info"], ["convert", "best.pt"]])
def test_misuse_is_told(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["checkpoint", *arguments])
    assert caught.value.code == 2
    assert "usage: annotations checkpoint" in capsys.readouterr().err
