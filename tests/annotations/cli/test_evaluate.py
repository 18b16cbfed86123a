import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from annotations.cli import evaluate, main
from annotations.documents.files import load_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path, load_study
from annotations.prediction.checkpoint_description import TrainingOrigin, TrainingSummary
from annotations.prediction.report.file_names import REPORT_NAMES
from tests.annotations.prediction.known_keypoints import COARSE, described, heatmaps_of, save_knowing

SETTINGS = """
[synthetic]
seed = 5

[annotated]
shares = [0.5, 0.5]
split_seed = 2
"""


def saved(path: Path, truth_path: Path, **training: Any) -> Path:
    """Write a checkpoint that always sees what is in the first volume."""
    document, _ = load_annotation(truth_path)
    truth_um = {each.name: each.position_um for each in document.parts if each.position_um is not None}
    description = changed(described(COARSE), training=TrainingSummary(**training))
    save_knowing(path, description, heatmaps_of(description, truth_um, document.volume.spacing_um))
    return path


@pytest.fixture
def checkpoint(tmp_path: Path, truth_path: Path) -> Path:
    return saved(tmp_path / "known.onnx", truth_path)


def test_the_errors_come_as_the_published_table(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", str(checkpoint), str(study)]) == 0

    words = capsys.readouterr().out
    assert "position (mm)" in words
    assert "θ2 (°)" in words
    assert "predicted keypoints" in words
    assert "fitted pose" in words


def test_everything_for_programs(
    checkpoint: Path, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "errors.json"

    assert main(["evaluate", str(checkpoint), str(study), "--json", str(output)]) == 0
    assert "position (mm)" in capsys.readouterr().out
    assert main(["evaluate", str(checkpoint), str(study), "--json"]) == 0

    printed, written = json.loads(capsys.readouterr().out), json.loads(output.read_text())
    first, second = written["errors"]["rows"]
    assert (written["split"], first["volume"], second["volume"]) == ("all", "v001", "v002")
    assert first["targets"]["position_mm"] < 0.02 < second["targets"]["position_mm"]
    assert printed["errors"]["rows"] == written["errors"]["rows"]


def test_the_report_has_the_figures_of_the_command(
    checkpoint: Path, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report, output = tmp_path / "report", tmp_path / "errors.json"

    arguments = ["evaluate", str(checkpoint), str(study), "--report", str(report), "--json", str(output)]
    assert main(arguments) == 0

    assert sorted(path.name for path in report.iterdir()) == sorted(REPORT_NAMES.values())
    assert (report / "errors.txt").read_text() == capsys.readouterr().out
    of_command = json.loads(output.read_text())["errors"]
    [of_report] = json.loads((report / "errors.json").read_text())["checkpoints"]
    assert of_report["errors"]["rows"] == of_command["rows"]
    assert of_report["errors"]["by_formulas"] == of_command["by_formulas"]


def test_where_no_report_can_be_written_nothing_is_predicted(
    checkpoint: Path, study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "report" / "errors-csv").mkdir(parents=True)
    (tmp_path / "report" / "errors-csv" / "thesis.tex").write_text("years of work")
    monkeypatch.setattr(evaluate, "evaluate_study", lambda *_args, **_options: pytest.fail("predicted"))

    assert main(["evaluate", str(checkpoint), str(study), "--report", str(tmp_path / "report")]) == 1


def test_several_checkpoints_stand_side_by_side(
    checkpoint: Path, study: Path, tmp_path: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other_truth = annotation_path(study, "truth", "v002", "keypoints")
    other = saved(tmp_path / "other.onnx", other_truth)
    assert main(["evaluate", str(checkpoint), str(study), "--against", str(other), "--json"]) == 0
    [against] = (fields := json.loads(capsys.readouterr().out))["against"]

    assert main(["evaluate", str(checkpoint), str(study), "--against", str(other)]) == 0

    words = capsys.readouterr().out
    assert "Checkpoints on the same 2 volumes" in words
    near, far = (each["targets"]["position_mm"] for each in fields["errors"]["rows"])
    assert near < 0.02 < far
    far, near = (each["targets"]["position_mm"] for each in against["rows"])
    assert near < 0.02 < far


def test_a_checkpoint_is_not_compared_with_itself(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["evaluate", str(checkpoint), str(study), "--against", str(checkpoint)])

    assert "compared with itself" in capsys.readouterr().err


def test_kept_predictions_are_taken_unless_they_are_to_be_made_anew(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["predict", str(checkpoint), "--study", str(study)]) == 0
    [kept] = study.glob("predictions/*/v001.json")
    capsys.readouterr()

    def position_mm(*options: str) -> float:
        assert main(["evaluate", str(checkpoint), str(study), "--json", *options]) == 0
        error: float = json.loads(capsys.readouterr().out)["errors"]["rows"][0]["targets"]["position_mm"]
        return error

    assert position_mm() == position_mm("--anew")
    fields = json.loads(kept.read_text())
    for keypoint in fields["keypoints"]:
        keypoint["position_um"][0] += 1000.0
    kept.write_text(json.dumps(fields))
    assert position_mm() == pytest.approx(1.0, abs=0.05)
    assert position_mm("--anew") < 0.02


def test_two_checkpoints_of_one_name_keep_their_predictions_apart(
    checkpoint: Path, study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    later = saved(tmp_path / "later.onnx", annotation_path(study, "truth", "v002", "keypoints"))
    for path in (checkpoint, later):
        assert main(["predict", str(path), "--study", str(study)]) == 0
    folders = sorted((study / "predictions").iterdir())
    for folder, volume in zip(folders, ("v001", "v002"), strict=True):
        kept = folder / f"{volume}.json"
        fields = json.loads(kept.read_text())
        for keypoint in fields["keypoints"]:
            keypoint["position_um"][0] += 1000.0
        kept.write_text(json.dumps(fields))
    capsys.readouterr()

    assert main(["evaluate", str(checkpoint), str(study), "--against", str(later), "--json"]) == 0

    fields = json.loads(capsys.readouterr().out)
    tables = (fields["errors"], *fields["against"])
    near_mm = [table["rows"][place]["targets"]["position_mm"] for place, table in enumerate(tables)]
    assert near_mm == pytest.approx([1.0, 1.0], abs=0.05)


def test_a_kept_prediction_that_cannot_be_read_is_told_and_made_again(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["predict", str(checkpoint), "--study", str(study)]) == 0
    [kept] = study.glob("predictions/*/v001.json")
    kept.write_text("{")
    capsys.readouterr()

    assert main(["evaluate", str(checkpoint), str(study)]) == 0

    [line] = capsys.readouterr().err.splitlines()
    assert str(kept) in line
    assert line.endswith("The volume was predicted again")
    assert kept.read_text() == "{"


def test_annotations_that_cannot_be_read_are_named(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [annotation_path(study, "truth", name, "keypoints") for name in ("v001", "v002")]
    paths[0].write_text(paths[0].read_text().replace('"source": "synthesized"', '"source": "guessed"'))

    assert main(["evaluate", str(checkpoint), str(study), "--json"]) == 1
    [left_out] = json.loads(capsys.readouterr().out)["errors"]["unjudged"]
    assert (left_out["volume"], str(paths[0]) in left_out["reason"]) == ("v001", True)

    paths[1].write_text("{")
    for options in ([], ["--annotator", "truth"]):
        assert main(["evaluate", str(checkpoint), str(study), *options]) == 1
        said = capsys.readouterr().err
        assert f"{paths[0]}, line " in said
        assert "keypoints.0.source" in said


def test_volumes_of_the_training_can_be_left_out(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    title = load_study(study).title
    checkpoint = saved(tmp_path / "c.onnx", truth_path, studies=(title,), settings=SETTINGS)

    main(["evaluate", str(checkpoint), str(study)])
    assert "was trained on volumes of" in capsys.readouterr().out
    rows = []
    for split in ("train", "validation"):
        assert main(["evaluate", str(checkpoint), str(study), "--split", split, "--json"]) == 0
        fields = json.loads(capsys.readouterr().out)
        assert (fields["shares"], fields["split_seed"], fields["remark"]) == ([0.5, 0.5, 0.0], 2, "")
        rows += [row["volume"] for row in fields["errors"]["rows"]]
    assert sorted(rows) == ["v001", "v002"]


def test_volumes_that_were_trained_on_are_left_out_wherever_the_split_puts_them_now(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fingerprints = {
        name: load_annotation(annotation_path(study, "truth", name, "keypoints"))[0].volume.fingerprint
        for name in ("v001", "v002")
    }
    about = {"studies": (load_study(study).title,), "settings": SETTINGS}

    def judged(split: str, *trained_on: str) -> tuple[list[str], int] | str:
        path = tmp_path / "c.onnx"
        path.unlink(missing_ok=True)
        saved(path, truth_path, training_fingerprints=[fingerprints[name] for name in trained_on], **about)
        code = main(["evaluate", str(path), str(study), "--split", split, "--json"])
        told = capsys.readouterr()
        if code:
            return told.err
        errors = json.loads(told.out)["errors"]
        return [row["volume"] for row in errors["rows"]], errors["trained_on"]

    [held_out], [other] = judged("validation")[0], judged("train")[0]

    assert judged("validation", other) == ([held_out], 0)
    assert judged("train", other, held_out) == ([other], 0)
    assert "none of the 1 that it was trained on" in judged("validation", other, held_out)
    shares = ["--shares", "0", "1", "--split-seed", "1"]
    path = saved(tmp_path / "d.onnx", truth_path, training_fingerprints=[fingerprints[other]])
    assert main(["evaluate", str(path), str(study), "--split", "validation", *shares]) == 0
    assert "left out: 1 volume that the network was trained on" in capsys.readouterr().out


def test_the_annotations_are_those_of_the_training_unless_others_are_asked_for(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = SETTINGS + 'annotator = "nobody"\n'
    checkpoint = saved(tmp_path / "c.onnx", truth_path, studies=(load_study(study).title,), settings=settings)
    elsewhere = saved(tmp_path / "d.onnx", truth_path, studies=("Another",), settings=settings)

    assert main(["evaluate", str(checkpoint), str(study)]) == 1
    assert "no volume has an annotation" in capsys.readouterr().err
    assert main(["evaluate", str(checkpoint), str(study), "--annotator", "truth"]) == 0
    assert main(["evaluate", str(elsewhere), str(study)]) == 0


def test_commands_that_take_annotations_say_whose_alike(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("evaluate", "experiment"):
        with pytest.raises(SystemExit):
            main([command, "--help"])
        told = " ".join(capsys.readouterr().out.split())
        assert "--annotator NAME whose annotations (the consensus, or the only one who is done)" in told
        assert "--method {keypoints,boxes} which annotations (" in told


def test_it_needs_no_torch(checkpoint: Path, study: Path) -> None:
    # None in sys.modules makes Python refuse the import, as if the package were not installed.
    script = "import sys; sys.modules['torch'] = None\nfrom annotations.cli import main; sys.exit(main())"

    done = subprocess.run(
        [sys.executable, "-c", script, "evaluate", str(checkpoint), str(study)],
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("settings", ['lr = "fast"', "made by hand"])
def test_a_checkpoint_with_settings_of_another_program_is_judged(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str], settings: str
) -> None:
    checkpoint = saved(tmp_path / "c.onnx", truth_path, studies=("a",), settings=settings)

    assert main(["evaluate", str(checkpoint), "--synthetic", "1"]) == 0
    assert main(["evaluate", str(checkpoint), str(study), "--split", "validation"]) == 1
    assert "knows of no split" in capsys.readouterr().err


def test_a_checkpoint_that_knows_no_split_says_so(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", str(checkpoint), str(study), "--split", "test"]) == 1
    assert "knows of no split" in capsys.readouterr().err

    options = ["--split", "train", "--shares", "0.5", "0.5", "--split-seed", "1"]
    assert main(["evaluate", str(checkpoint), str(study), *options]) == 0


def test_volumes_split_together_with_those_of_other_studies_are_known_by_their_names_alone(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["evaluate", "", str(study), "--json", "--split"]
    checkpoint = saved(tmp_path / "c.onnx", truth_path, studies=("a", "b"), settings=SETTINGS)
    command[1] = str(checkpoint)
    assert main([*command, "validation"]) == 1
    assert "several studies" in capsys.readouterr().err

    first, second = (
        load_annotation(annotation_path(study, "truth", name, "keypoints"))[0].volume.fingerprint
        for name in ("v001", "v002")
    )
    about = {"training_fingerprints": (second,), "validation_fingerprints": (first, "0" * 64)}
    path = saved(tmp_path / "d.onnx", truth_path, studies=("a", "b"), settings=SETTINGS, **about)
    command[1] = str(path)
    for split, expected in (("validation", "v001"), ("train", "v002")):
        assert main([*command, split]) == 0
        rows = json.loads(capsys.readouterr().out)["errors"]["rows"]
        assert [row["volume"] for row in rows] == [expected]
    assert main([*command, "test"]) == 1
    assert "does not name those of this part" in capsys.readouterr().err


def test_what_was_learned_before_counts_as_well(
    tmp_path: Path, study: Path, truth_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    earlier = TrainingSummary(studies=(load_study(study).title,), settings=SETTINGS)
    origin = TrainingOrigin(name="earlier", sha256="0" * 64, training=earlier)
    checkpoint = saved(tmp_path / "c.onnx", truth_path, synthetic_volumes=3, origin=origin)

    assert main(["evaluate", str(checkpoint), "--synthetic", "1", "--seed", "5"]) == 1
    assert "has seen the volumes of seed 5" in capsys.readouterr().err
    assert main(["evaluate", str(checkpoint), str(study)]) == 0
    assert "was trained on volumes of" in capsys.readouterr().out
    assert main(["evaluate", str(checkpoint), str(study), "--split", "validation", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["split_seed"] == 2


def test_a_volume_that_cannot_be_judged_is_a_finding(
    checkpoint: Path, study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (study / "volumes" / "v002.npy").unlink()

    assert main(["evaluate", str(checkpoint), str(study)]) == 1
    assert "not judged, v002" in capsys.readouterr().out


def test_synthetic_volumes_are_made_under_the_conditions_that_are_asked_for(
    checkpoint: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["evaluate", str(checkpoint), "--synthetic", "2", "--json", "-", "--seed", "9"]

    assert main([*command, "--conditions", "plain", "--noise-sigma-grey", "8", "--looks", "1"]) == 0

    fields = json.loads(capsys.readouterr().out)
    assert (fields["synthetic"]["seed"], fields["synthetic"]["count"]) == (9, 2)
    assert fields["synthetic"]["conditions"]["noise_sigma_grey"] == [8.0, 8.0]
    assert fields["synthetic"]["conditions"]["clutter"] == [0, 0]
    assert len(fields["errors"]["rows"]) == 2
    assert "looks 1–1" in fields["remark"]
    assert fields["errors"]["title"].endswith("plain conditions, looks 1, noise sigma 8 grey, seed 9")
    assert np.isfinite(fields["errors"]["by_formulas"]["targets"]["position_mm"]["mean"])


@pytest.mark.parametrize("seed", ["5", "1000001"])
def test_volumes_that_the_training_has_seen_are_refused(
    tmp_path: Path, truth_path: Path, seed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    checkpoint = saved(tmp_path / "c.onnx", truth_path, settings=SETTINGS)

    assert main(["evaluate", str(checkpoint), "--synthetic", "1", "--seed", seed]) == 1
    assert f"has seen the volumes of seed {seed}" in capsys.readouterr().err


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["STUDY", "--synthetic", "3"],
        ["STUDY", "--seed", "3"],
        ["STUDY", "--looks", "3"],
        ["STUDY", "--shares", "0.5", "0.5"],
        ["--synthetic", "3", "--annotator", "anna"],
        ["--synthetic", "3", "--split", "test"],
        ["--synthetic", "3", "--looks", "0"],
    ],
)
def test_options_that_do_not_go_together_are_misuse(
    checkpoint: Path, study: Path, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as raised:
        main(["evaluate", str(checkpoint), *(str(study) if each == "STUDY" else each for each in options)])

    assert raised.value.code == 2
    assert "annotations evaluate" in capsys.readouterr().err
