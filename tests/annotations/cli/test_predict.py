import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import annotations
from annotations.cli import main
from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import load_study, save_study
from annotations.prediction import shipped
from annotations.prediction.heatmaps import HeatmapConvention
from annotations.prediction.prediction_file import load_prediction
from annotations.volumes import sidecar_path
from tests.annotations.prediction.known_keypoints import COARSE, described, heatmaps_of, save_knowing

RunJson = Callable[..., tuple[int, list[dict[str, Any]], str]]


@pytest.fixture
def checkpoint(tmp_path: Path, truth_path: Path) -> Path:
    """A checkpoint that knows the first volume, and takes any other for it."""
    document, _ = load_annotation(truth_path)
    description = described(COARSE, HeatmapConvention(sigma_voxel=(0.5, 0.5, 0.5)))
    heatmaps = heatmaps_of(description, document.positions_um, document.volume.spacing_um)
    return save_knowing(tmp_path / "known.onnx", description, heatmaps).path


def test_a_volume_is_predicted_into_a_folder(
    checkpoint: Path, volume_path: Path, truth_path: Path, tmp_path: Path, run_json: RunJson
) -> None:
    code, [fields], messages = run_json("predict", checkpoint, volume_path, "-o", tmp_path / "out")

    assert (code, messages) == (0, "")
    path = tmp_path / "out" / "v001.json"
    assert (fields["path"], fields["prediction"]) == (str(volume_path), str(path))
    prediction = load_prediction(path)
    truth, _ = load_annotation(truth_path)
    assert prediction.volume.fingerprint == truth.volume.fingerprint
    assert (path.parent / prediction.volume.path).resolve() == volume_path
    assert prediction.checkpoint.path is not None
    assert (path.parent / prediction.checkpoint.path).resolve() == checkpoint
    for name, position_um in prediction.positions_um.items():
        assert position_um == pytest.approx(truth.positions_um[name], abs=30)
        assert fields["keypoints"][name] == list(position_um)
    assert len(prediction.positions_um) >= 4


def test_a_checkpoint_that_ships_goes_by_its_name(
    checkpoint: Path, volume_path: Path, tmp_path: Path, run_json: RunJson, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped, "shipped_checkpoints", lambda: {"magnetic-forceps": checkpoint})

    assert run_json("predict", "magnetic-forceps", volume_path, "-o", tmp_path / "out")[0] == 0
    assert load_prediction(tmp_path / "out" / "v001.json").checkpoint.name == "Known"
    assert run_json("checkpoint", "info", "magnetic-forceps")[1][0]["path"] == str(checkpoint)
    code, _, messages = run_json("predict", "forceps", volume_path, "-o", tmp_path / "out")
    assert code == 1
    assert "magnetic-forceps" in messages


def test_a_prediction_names_no_place_of_a_checkpoint_that_ships(
    checkpoint: Path, volume_path: Path, tmp_path: Path, run_json: RunJson, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(annotations, "__file__", str(checkpoint.parent / "__init__.py"))

    assert run_json("predict", checkpoint, volume_path, "-o", tmp_path / "out")[0] == 0

    assert load_prediction(tmp_path / "out" / "v001.json").checkpoint.path is None


def test_a_study_keeps_its_predictions(checkpoint: Path, study: Path, run_json: RunJson) -> None:
    code, objects, _ = run_json("predict", checkpoint, "--study", study)

    assert code == 0
    kept = [study / "predictions" / "Known" / f"v00{number}.json" for number in (1, 2)]
    assert [fields["prediction"] for fields in objects] == list(map(str, kept))
    assert [load_prediction(path).volume.path for path in kept] == [
        "../../volumes/v001.npy",
        "../../volumes/v002.npy",
    ]
    # Again: they are replaced.
    assert run_json("predict", checkpoint, "--study", study)[0] == 0


def test_a_volume_that_fails_does_not_keep_the_others(
    checkpoint: Path, study: Path, volume_path: Path, run_json: RunJson
) -> None:
    volume_path.write_bytes(volume_path.read_bytes()[:200])

    code, objects, messages = run_json("predict", checkpoint, "--study", study)

    assert code == 1
    assert [("error" in fields) for fields in objects] == [True, False]
    assert str(volume_path) in messages
    assert not (study / "predictions" / "Known" / "v001.json").exists()
    assert (study / "predictions" / "Known" / "v002.json").exists()


def test_an_unknown_spacing_is_asked_for(
    checkpoint: Path, volume_path: Path, truth_path: Path, tmp_path: Path, run_json: RunJson
) -> None:
    sidecar_path(volume_path).unlink()

    code, [fields], messages = run_json("predict", checkpoint, volume_path, "-o", tmp_path / "out")

    assert code == 1
    assert "--spacing-um" in messages
    assert "error" in fields
    assert not (tmp_path / "out").exists()

    spacing_um = load_annotation(truth_path)[0].volume.spacing_um
    code, [fields], _ = run_json(
        "predict", checkpoint, volume_path, "-o", tmp_path / "out", "--spacing-um", *spacing_um
    )

    assert code == 0
    assert load_prediction(tmp_path / "out" / "v001.json").volume.spacing_um == spacing_um


def test_a_study_says_the_spacing_that_a_file_does_not(
    checkpoint: Path, study: Path, volume_path: Path, run_json: RunJson
) -> None:
    sidecar_path(volume_path).unlink()
    said = load_study(study)
    volumes = (changed(said.volumes[0], spacing_um=(790.0, 669.0, 469.0)), *said.volumes[1:])
    save_study(changed(said, volumes=volumes), study)

    assert run_json("predict", checkpoint, "--study", study)[0] == 0

    prediction = load_prediction(study / "predictions" / "Known" / "v001.json")
    assert prediction.volume.spacing_um == (790.0, 669.0, 469.0)


def test_volumes_of_equal_names_do_not_share_a_file(
    checkpoint: Path, study: Path, volume_path: Path, tmp_path: Path, run_json: RunJson
) -> None:
    copied = shutil.copytree(study / "volumes", tmp_path / "other") / "v001.npy"

    code, objects, _ = run_json("predict", checkpoint, volume_path, copied, "-o", tmp_path / "out")

    assert code == 0
    assert [Path(fields["prediction"]).name for fields in objects] == ["v001.json", "v001.npy.json"]


def test_one_of_several_arrays_is_chosen_by_name(
    checkpoint: Path, volume_path: Path, tmp_path: Path, run_json: RunJson
) -> None:
    several = tmp_path / "several.npz"
    voxels = np.load(volume_path)
    np.savez(several, first=voxels, second=voxels)
    arguments = ("predict", checkpoint, several, "-o", tmp_path / "out", "--spacing-um", 791, 669, 470)

    code, _, messages = run_json(*arguments)
    assert code == 1
    assert "--dataset" in messages

    assert run_json(*arguments, "--dataset", "second")[0] == 0
    assert load_prediction(tmp_path / "out" / "several.json").volume.dataset == "second"


def test_in_words(
    checkpoint: Path, volume_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["predict", str(checkpoint), str(volume_path), "-o", str(tmp_path / "out")]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == str(volume_path)
    assert lines[1] == f"  prediction   {tmp_path / 'out' / 'v001.json'}"
    assert lines[-1].startswith("  pose         theta1 ")


@pytest.mark.parametrize(
    "arguments",
    [
        ["known.onnx"],
        ["known.onnx", "v.npy"],
        ["known.onnx", "v.npy", "--study", "s", "-o", "d"],
        ["known.onnx", "--study", "s", "-o", "d"],
        ["known.onnx", "--study", "s", "--dataset", "d"],
        ["known.onnx", "v.npy", "-o", "d", "--spacing-um", "1", "2", "0"],
        ["known.onnx", "v.npy", "-o", "d", "--spacing-um", "1", "2", "nan"],
    ],
)
def test_misuse_is_explained(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["predict", *arguments])

    assert ended.value.code == 2
    assert "usage: annotations predict" in capsys.readouterr().err


def test_a_file_that_is_no_checkpoint_is_refused(
    volume_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["predict", str(volume_path), str(volume_path), "-o", str(tmp_path / "out")])

    assert code == 1
    assert str(volume_path) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_neither_torch_nor_a_screen_is_needed(checkpoint: Path, volume_path: Path, tmp_path: Path) -> None:
    script = (
        "import sys; sys.modules.update(dict.fromkeys(('torch', 'PySide6', 'vtk', 'mayavi')))\n"
        "from annotations.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    arguments = ["predict", str(checkpoint), str(volume_path), "-o", str(tmp_path / "out"), "--json"]

    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["prediction"] == str(tmp_path / "out" / "v001.json")
