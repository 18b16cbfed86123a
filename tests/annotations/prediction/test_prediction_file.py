"""Prediction files: read back, refused when wrong, and never in the place of anything else."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from annotations.documents.files import DocumentError
from annotations.documents.record import changed
from annotations.documents.volume_link import reference_to
from annotations.durable_files import SaveError
from annotations.prediction.prediction import Prediction
from annotations.prediction.prediction_file import (
    PREDICTION_FILE,
    checkpoint_folder,
    checkpoint_folders,
    load_prediction,
    loose_prediction_path,
    predicted_volumes,
    prediction_bytes,
    save_prediction,
    study_prediction_path,
    study_prediction_paths,
)
from annotations.volumes import fingerprint, open_volume
from tests.annotations.prediction.made_predictions import (
    CHECKPOINT,
    SHA256,
    TRUE_UM,
    made_prediction,
    predictions,
)


@given(predictions())
def test_a_file_holds_the_whole_prediction(prediction: Prediction) -> None:
    assert PREDICTION_FILE.parse(prediction_bytes(prediction), "x") == prediction


@given(predictions())
@settings(max_examples=20)
def test_a_file_is_standard_json_without_nan_or_null(prediction: Prediction) -> None:
    def refuse(token: str) -> None:
        raise AssertionError(token)

    content = prediction_bytes(prediction)

    json.loads(content, parse_constant=refuse)
    assert b": null" not in content


def test_a_file_is_read_by_people_line_by_line(tmp_path: Path) -> None:
    save_prediction(
        made_prediction({name: TRUE_UM[name] for name in ("k0", "k1", "k2", "k3", "k4")}), tmp_path / "p"
    )

    lines = (tmp_path / "p").read_text().splitlines()

    assert lines[0] == '{"schema": "oct-prediction/1",'
    [first] = [line for line in lines if '"k0", "state"' in line]
    assert first.startswith('  {"name": "k0", "state": "placed", "position_um": [')
    assert '"source": "predicted", "confidence": {"peak": 0.2, "presence": 1.0, "spread_um": [' in first
    [last] = [line for line in lines if '"k5", "state"' in line]
    assert last.startswith('  {"name": "k5", "state": "unplaced", "confidence": {')


def test_what_is_saved_is_what_is_loaded(tmp_path: Path) -> None:
    prediction, path = made_prediction(), tmp_path / "predictions" / "Known" / "v001.json"

    save_prediction(prediction, path)

    assert load_prediction(path) == prediction


def test_an_earlier_prediction_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "v001.json"
    save_prediction(made_prediction({}), path)

    save_prediction(made_prediction(), path)

    assert load_prediction(path).positions_um == TRUE_UM


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"a letter to a friend",
        b'{"schema": "oct-annotation/1"}',
        b'{"schema": "oct-prediction/2"}',
        prediction_bytes(made_prediction())[:200],
    ],
    ids=["empty", "letter", "annotation", "newer", "cut off"],
)
def test_no_other_file_is_overwritten(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "v001.json"
    path.write_bytes(content)

    with pytest.raises(SaveError, match="is not overwritten"):
        save_prediction(made_prediction(), path)

    assert path.read_bytes() == content


def test_a_folder_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(SaveError):
        save_prediction(made_prediction(), tmp_path)


@pytest.mark.parametrize(
    ("right", "wrong", "problem"),
    [
        ('"state": "placed"', '"state": "lost"', "keypoints.0.state: Input should be 'placed'"),
        ('"source": "predicted"', '"source": "clicked"', "keypoints.0.source: Input should be 'predicted'"),
        ('"peak": 0.2', '"peak": "high"', "confidence.peak: Input should be a valid number, found 'high'"),
        ('"peak": 0.2', '"peak": NaN', "NaN is not a number"),
        (
            '"presence": 1.0',
            '"presence": 1.5',
            "confidence.presence: Input should be less than or equal to 1",
        ),
        ('"peak": 0.2, ', "", "the field 'keypoints.0.confidence.peak' is missing"),
        (
            '"peak": 0.2, ',
            '"peak": 0.2, "height": 1.0, ',
            "the field 'keypoints.0.confidence.height' is unknown",
        ),
        ('"name": "k1"', '"name": "k0"', "keypoint 'k0' stands more than once"),
        ('"sha256": "5feceb', '"sha256": "xyz', "checkpoint.sha256: String should match pattern"),
        ('"rms_um": ', '"rms_um": -1, "rms": ', "pose.rms_um: Input should be greater than or equal to 0"),
        ('"tool": "magnetic-forceps"', '"tool": 5', "tool: Input should be a valid string"),
        ('"shape": [1096', '"shape": [0', "volume.shape.0: Input should be greater than 0"),
        ('"schema": "oct-prediction/1"', '"schema": "oct-prediction/2"', "newer version of the program"),
        ('"schema": "oct-prediction/1"', '"schema": "oct-annotation/1"', "it is not a prediction file"),
        ('"program"', '"program": "0", "program"', "the field 'program' stands twice"),
    ],
)
def test_a_wrong_file_is_refused_in_words(tmp_path: Path, right: str, wrong: str, problem: str) -> None:
    text = prediction_bytes(made_prediction()).decode()
    assert right in text
    path = tmp_path / "wrong.json"
    path.write_text(text.replace(right, wrong, 1))

    with pytest.raises(DocumentError) as refused:
        load_prediction(path)

    assert problem in str(refused.value)
    assert str(path) in str(refused.value)
    assert refused.value.remedy


def test_the_line_of_what_is_wrong_is_named(tmp_path: Path) -> None:
    lines = prediction_bytes(made_prediction()).decode().splitlines()
    [number] = [number for number, line in enumerate(lines) if '"name": "k2"' in line]
    lines[number] = lines[number].replace("placed", "lost")
    path = tmp_path / "wrong.json"
    path.write_text("\n".join(lines))

    with pytest.raises(DocumentError, match=f"line {number + 1}"):
        load_prediction(path)


def test_a_file_that_is_cut_off_anywhere_is_refused() -> None:
    content = prediction_bytes(made_prediction())
    for length in range(0, len(content) - 1, 7):
        with pytest.raises(DocumentError):
            PREDICTION_FILE.parse(content[:length], "cut.json")


@pytest.mark.parametrize("content", [b"\x93NUMPY\x01\x00", b"[]", b"null", b"[" * 100_000, b"\xff\xfe{"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.json"
    path.write_bytes(content)

    with pytest.raises(DocumentError):
        load_prediction(path)


def test_an_absent_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="could not be read"):
        load_prediction(tmp_path / "absent.json")


def test_predictions_of_a_study_lie_by_checkpoint(tmp_path: Path) -> None:
    first = study_prediction_path(tmp_path, "Lean 2", SHA256, "v001")
    other = study_prediction_path(tmp_path, "a/b: of V2V?", SHA256, "v001")
    for path in (first, other):
        save_prediction(made_prediction(), path)
    (tmp_path / "predictions" / "notes.txt").write_text("mine")

    assert first == tmp_path / "predictions" / "Lean 2" / "v001.json"
    assert other.parent.parent == tmp_path / "predictions"
    assert set(checkpoint_folders(tmp_path)) == {first.parent, other.parent}
    assert set(study_prediction_paths(tmp_path, "v001")) == {first, other}
    assert study_prediction_paths(tmp_path, "v002") == ()


def test_checkpoints_of_one_name_keep_their_predictions_apart(tmp_path: Path) -> None:
    later, third = (changed(CHECKPOINT, sha256=digit * 64) for digit in "bc")
    paths = []
    for each in (CHECKPOINT, later, third):
        for volume_id in ("v001", "v002"):
            paths.append(study_prediction_path(tmp_path, "Lean", each.sha256, volume_id))
            save_prediction(made_prediction(checkpoint=each), paths[-1])

    folders = [tmp_path / "predictions" / name for name in ("Lean", "Lean-bbbbbbbb", "Lean-cccccccc")]
    assert [path.parent for path in paths[::2]] == folders
    for each, folder in zip((CHECKPOINT, later, third), folders, strict=True):
        assert checkpoint_folder(tmp_path, "Lean", each.sha256) == folder
        assert len(predicted_volumes(tmp_path, "Lean", each.sha256)) == 2


def test_a_checkpoint_stays_with_its_folder(tmp_path: Path) -> None:
    usual, later = tmp_path / "predictions" / "Lean", "b" * 64
    save_prediction(made_prediction(), usual / "v001.json")
    apart = checkpoint_folder(tmp_path, "Lean", later)
    save_prediction(made_prediction(checkpoint=changed(CHECKPOINT, sha256=later)), apart / "v001.json")

    (usual / "v001.json").unlink()

    assert checkpoint_folder(tmp_path, "Lean", later) == apart
    assert checkpoint_folder(tmp_path, "Lean", "c" * 64) == usual


def test_a_file_that_cannot_be_read_does_not_say_whose_folder_it_is(tmp_path: Path) -> None:
    usual = tmp_path / "predictions" / "Lean"
    save_prediction(made_prediction(), usual / "v002.json")
    (usual / "v001.json").write_text("{")

    assert checkpoint_folder(tmp_path, "Lean", SHA256) == usual
    assert checkpoint_folder(tmp_path, "Lean", "b" * 64) != usual
    (usual / "v002.json").unlink()
    assert checkpoint_folder(tmp_path, "Lean", "b" * 64) == usual


def test_a_study_without_predictions_has_none(tmp_path: Path) -> None:
    assert checkpoint_folders(tmp_path) == ()
    assert study_prediction_paths(tmp_path, "v001") == ()


def keep(volume_path: Path, folder: Path) -> Path:
    """Predict as the command line does, and return where it was kept."""
    volume_path.parent.mkdir(parents=True, exist_ok=True)
    if not volume_path.exists():
        np.save(volume_path.with_suffix(".npy"), np.zeros((3, 3, 3), dtype=np.uint8))
        volume_path.with_suffix(".npy").rename(volume_path)
    with open_volume(volume_path) as volume:
        path = loose_prediction_path(folder, volume)
        reference = reference_to(volume, (1.0, 1.0, 1.0), path, fingerprint(volume))
    save_prediction(made_prediction(volume=reference), path)
    return path


def test_volumes_of_one_name_have_predictions_of_their_own(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    volumes = [
        tmp_path / "a" / "v.npy",
        tmp_path / "b" / "v.npy",
        tmp_path / "b" / "v.arr",
        tmp_path / "c" / "v.npy",
    ]

    paths = [keep(volume, kept) for volume in volumes]

    assert [path.name for path in paths] == ["v.json", "v.npy.json", "v.arr.json", "v.npy-2.json"]
    # Predicted again, in another order, each replaces its own.
    assert [keep(volume, kept) for volume in reversed(volumes)] == paths[::-1]
    assert len(list(kept.iterdir())) == 4


def test_a_file_of_another_kind_keeps_its_name(tmp_path: Path) -> None:
    (tmp_path / "v.json").write_text('{"schema": "oct-annotation/1"}')

    assert keep(tmp_path / "v.npy", tmp_path).name == "v.npy.json"


def test_a_prediction_names_the_checkpoint_as_it_was(tmp_path: Path) -> None:
    prediction = made_prediction()
    bare = changed(prediction, checkpoint=changed(prediction.checkpoint, path=None))

    assert b'"checkpoint": {"name": "Known", "sha256": "5f' in prediction_bytes(bare)
    assert b'"path"' not in prediction_bytes(bare).split(b'"checkpoint"')[1]
