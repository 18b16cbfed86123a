"""The errors of a checkpoint in a study, from files alone."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.annotation import Annotation, VolumeReference, new_annotation
from annotations.documents.edits import place_keypoint, set_status
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.provenance import Contribution, PredictionOrigin, Viewing
from annotations.documents.record import changed
from annotations.documents.study import Study, StudyVolume, annotation_path, save_study
from annotations.documents.study_checks import check_study, is_wrong
from annotations.geometry.frames import Vector, vector
from annotations.prediction.errors.error_table import ErrorTable, HumanFloor
from annotations.prediction.errors.error_text import begun_text, error_text
from annotations.prediction.errors.study_errors import (
    Truth,
    errors_against,
    kept_predictions,
    read_truths,
    study_errors,
)
from annotations.prediction.errors.study_floor import floor_of_volumes
from annotations.prediction.prediction_file import save_prediction, study_prediction_path
from annotations.synthesis import write_study
from annotations.volumes.sampling import OMES_SAMPLING, Sampling
from tests.annotations.prediction.known_keypoints import FORCEPS, described
from tests.annotations.prediction.made_predictions import CHECKPOINT, TRUE_UM, VOLUME, made_prediction

IDS = ("v1", "v2", "v3")


def reference(volume_id: str) -> VolumeReference:
    return changed(VOLUME, path=f"../../volumes/{volume_id}.npy", fingerprint=f"{volume_id:0>64}")


def moved_um(by_um: Vector) -> dict[str, Vector]:
    return {name: vector(np.add(position_um, by_um)) for name, position_um in TRUE_UM.items()}


def annotate(
    folder: Path, annotator: str, volume_id: str, by_um: Vector = (0.0, 0.0, 0.0), *, done: bool = True
) -> Annotation:
    made = new_annotation(reference(volume_id), FORCEPS, annotator, "keypoints", ships=True)
    for name, position_um in moved_um(by_um).items():
        made = place_keypoint(made, name, position_um, "clicked")
    if done:
        made = set_status(made, "done")
    path = annotation_path(folder, annotator, volume_id, "keypoints")
    save_annotation(made, path, expected="", overwrite=True)
    return made


def predict(folder: Path, volume_id: str, by_um: Vector = (0.0, 0.0, 0.0), sha256: str | None = None) -> None:
    checkpoint = CHECKPOINT if sha256 is None else changed(CHECKPOINT, sha256=sha256)
    prediction = made_prediction(moved_um(by_um), reference(volume_id), checkpoint)
    save_prediction(prediction, study_prediction_path(folder, CHECKPOINT.name, CHECKPOINT.sha256, volume_id))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study of three volumes; anna is done with all of them."""
    study = Study(
        title="Phantoms",
        tool="magnetic-forceps",
        annotators=("anna", "ben"),
        volumes=tuple(StudyVolume(id=each, path=f"volumes/{each}.npy") for each in IDS),
    )
    save_study(study, tmp_path)
    for each in IDS:
        annotate(tmp_path, "anna", each)
    return tmp_path


def table_of(folder: Path, truth: Truth | None = None) -> ErrorTable:
    predictions, unread = kept_predictions(folder, CHECKPOINT.name, CHECKPOINT.sha256)
    return study_errors(folder, predictions, truth, unjudged=unread)


def floor_of(folder: Path, volumes: Sequence[str] | None = None) -> HumanFloor | None:
    floor = floor_of_volumes(folder, "keypoints")
    assert floor is not None
    return floor.of(volumes)


def test_errors_are_those_of_the_files(folder: Path) -> None:
    for number, each in enumerate(IDS):
        predict(folder, each, (300.0 * number, 0.0, 400.0 * number))

    table = table_of(folder)

    assert [row.volume for row in table.rows] == list(IDS)
    assert [row.targets["position_mm"] for row in table.rows] == pytest.approx([0.0, 0.5, 1.0])
    assert [row.mean_keypoint_um for row in table.rows] == pytest.approx([0.0, 500.0, 1000.0])
    position = table.by_formulas.targets["position_mm"]
    assert (position.mean, position.sd, position.n) == pytest.approx((0.5, 0.5, 3))
    assert table.by_fit.targets["position_mm"].mean == pytest.approx(0.5, abs=1e-3)
    assert table.checkpoint == CHECKPOINT
    assert {row.whose for row in table.rows} == {"anna"}
    assert table.human is None


def test_a_blunder_is_seen_by_the_fit(folder: Path) -> None:
    wrong_um = {**TRUE_UM, "k1": vector(np.add(TRUE_UM["k1"], (4000.0, 0.0, 4000.0)))}
    save_prediction(
        made_prediction(wrong_um, reference("v1")),
        study_prediction_path(folder, CHECKPOINT.name, CHECKPOINT.sha256, "v1"),
    )

    [row] = table_of(folder).rows

    assert row.left_out == ("k1",)
    assert row.targets["orientation_deg"] > 10
    assert row.targets_by_fit["orientation_deg"] < 0.1
    assert row.keypoints_um["k1"] == pytest.approx(math.hypot(4000, 4000))
    assert row.keypoints_by_fit_um["k1"] < 10


def test_a_keypoint_beyond_the_range_is_not_missing(folder: Path) -> None:
    far_um = (TRUE_UM["k5"][0], TRUE_UM["k5"][1], 30_000.0)
    document = place_keypoint(annotate(folder, "anna", "v1"), "k5", far_um, "clicked")
    path = annotation_path(folder, "anna", "v1", "keypoints")
    save_annotation(document, path, expected="", overwrite=True)
    seen_um = {name: TRUE_UM[name] for name in ("k0", "k1", "k2", "k3")}
    predictions = {"v1": made_prediction(seen_um, reference("v1"))}

    table = study_errors(folder, predictions, checkpoint=described())

    [row] = table.rows
    assert (row.missing, row.rightly_out_of_range) == (("k4",), ("k5",))
    assert (table.missing_share, table.rightly_out_of_range_share) == (1 / 6, 1 / 6)
    assert table.by_formulas.far_share == 1 / 5
    [row] = study_errors(folder, predictions).rows
    assert (row.missing, row.rightly_out_of_range) == (("k4", "k5"), ())


def test_the_human_floor_stands_beside(folder: Path) -> None:
    for each in IDS[:2]:
        annotate(folder, "ben", each, (0.0, 100.0, 0.0))
        predict(folder, each)

    table = table_of(folder, Truth(annotator="anna"))

    assert table.human is not None
    # Of two annotators each is half of their distance from the mean.
    assert table.human.targets["position_mm"].mean == pytest.approx(0.05)
    assert table.human.targets["position_mm"].n == 2
    assert table.human.volumes["v1"]["position_mm"] == pytest.approx(0.05)
    assert "v3" not in table.human.volumes
    assert table.human == floor_of(folder)


def test_the_human_floor_is_that_of_the_volumes_that_are_judged(folder: Path) -> None:
    for number, each in enumerate(IDS):
        annotate(folder, "ben", each, (0.0, 100.0 * (1 + number), 0.0))
    predict(folder, "v2")

    human = table_of(folder, Truth(annotator="anna")).human

    assert human is not None
    assert set(human.volumes) == {"v2"}
    assert human.targets["position_mm"].mean == pytest.approx(0.1)
    everyone = floor_of(folder)
    assert everyone is not None
    assert set(everyone.volumes) == set(IDS)
    assert floor_of(folder, ()) is None


def test_volumes_that_cannot_be_judged_say_why(folder: Path) -> None:
    annotate(folder, "ben", "v1", (0.0, 100.0, 0.0))
    annotate(folder, "anna", "v2", done=False)
    for each in IDS:
        predict(folder, each)
    other = annotate(folder, "anna", "v3")
    path = annotation_path(folder, "anna", "v3", "keypoints")
    rescanned = changed(other, volume=changed(other.volume, fingerprint="9" * 64))
    save_annotation(rescanned, path, expected="", overwrite=True)

    table = table_of(folder)

    assert table.rows == ()
    reasons = {each.volume: each.reason for each in table.unjudged}
    assert "anna, ben have annotated it" in reasons["v1"]
    assert "not done" in reasons["v2"]
    assert "fingerprints differ" in reasons["v3"]
    assert table.by_formulas.far_share is None
    assert error_text(table)


def test_another_spacing_is_no_truth(folder: Path) -> None:
    prediction = made_prediction(TRUE_UM, changed(reference("v1"), spacing_um=(15.9, 13.5, 9.5)))
    save_prediction(prediction, study_prediction_path(folder, CHECKPOINT.name, CHECKPOINT.sha256, "v1"))

    [reason] = [each.reason for each in table_of(folder).unjudged]

    assert "9.5" in reason
    assert "9.4" in reason


def test_what_a_network_placed_is_no_truth_for_it(folder: Path) -> None:
    document = annotate(folder, "anna", "v1")
    keypoints = (changed(document.keypoints[0], source="predicted"), *document.keypoints[1:])
    path = annotation_path(folder, "anna", "v1", "keypoints")
    save_annotation(changed(document, keypoints=keypoints), path, expected="", overwrite=True)
    predict(folder, "v1")

    [row] = table_of(folder).rows

    assert "k0" not in row.keypoints_um
    assert "position_mm" not in row.targets
    assert "theta1_deg" not in row.targets
    assert "theta2_deg" in row.targets
    assert row.missing == ()


def begin_from_prediction(folder: Path, volume_id: str, checkpoint: str = "Known") -> None:
    origin = PredictionOrigin(path="p.json", checkpoint=checkpoint, sha256="0" * 64)
    begun = changed(annotate(folder, "anna", volume_id), predicted_from=origin)
    save_annotation(
        begun, annotation_path(folder, "anna", volume_id, "keypoints"), expected="", overwrite=True
    )


def test_a_truth_that_was_begun_from_a_prediction_counts_in_no_figure(folder: Path) -> None:
    for number, each in enumerate(IDS):
        predict(folder, each, (300.0 * number, 0.0, 400.0 * number))
    begin_from_prediction(folder, "v1", "Another")

    table = table_of(folder)

    assert [row.volume for row in table.rows] == list(IDS)
    assert [row.begun_from for row in table.rows] == [("Another",), (), ()]
    position = table.by_formulas.targets["position_mm"]
    assert (position.mean, position.n) == pytest.approx((0.75, 2))
    assert table.by_fit.all_keypoints_um.n == 2 * len(FORCEPS.keypoint_names)
    assert table.with_begun is not None
    assert table.with_begun.targets["position_mm"].mean == pytest.approx(0.5)
    assert "2 volumes of" in error_text(table)
    assert "of 1 volume (v1) the annotation was begun from a prediction of Another" in begun_text(table)
    assert "With it: position (mm) 0.50 ± 0.50" in begun_text(table)


def test_where_every_truth_was_begun_from_a_prediction_there_are_no_figures(folder: Path) -> None:
    for each in IDS:
        predict(folder, each)
        begin_from_prediction(folder, each)

    table = table_of(folder)

    assert table.independent_rows == ()
    assert table.by_formulas.targets["position_mm"].n == 0
    assert table.missing_share is None
    assert "(v1, v2 and v3)" in begun_text(table)


def test_of_a_consensus_the_opinions_that_were_begun_from_a_prediction_count(folder: Path) -> None:
    opinion = Contribution(path="a.json", annotator="ben", sha256="0" * 64, predicted_from="Another")
    own = Contribution(path="b.json", annotator="anna", sha256="0" * 64)
    settled = changed(annotate(folder, "consensus", "v1"), consensus_of=(own, opinion))
    path = annotation_path(folder, "consensus", "v1", "keypoints")
    save_annotation(settled, path, expected="", overwrite=True)
    predict(folder, "v1")

    [row] = table_of(folder).rows

    assert (row.whose, row.begun_from) == ("consensus", ("Another",))


def test_predictions_of_an_earlier_checkpoint_of_the_name_are_passed_over(folder: Path) -> None:
    predict(folder, "v1")
    predict(folder, "v2", sha256="0" * 64)
    (study_prediction_path(folder, CHECKPOINT.name, CHECKPOINT.sha256, "v3")).write_text("{")

    predictions, unread = kept_predictions(folder, CHECKPOINT.name, CHECKPOINT.sha256)

    assert set(predictions) == {"v1"}
    reasons = {each.volume: each.reason for each in unread}
    assert "another checkpoint" in reasons["v2"]
    assert "cannot be read" in reasons["v3"]


def test_a_synthetic_study_is_judged_by_its_truth(tmp_path: Path) -> None:
    folder = tmp_path / "made"
    write_study(folder, FORCEPS, count=1, seed=1, shape=(22, 39, 23))
    truth = annotation_path(folder, "truth", "v001", "keypoints")
    document, _ = load_annotation(truth)
    prediction = made_prediction(document.positions_um, document.volume)
    save_prediction(prediction, study_prediction_path(folder, CHECKPOINT.name, CHECKPOINT.sha256, "v001"))

    table = table_of(folder)

    [row] = table.rows
    assert row.whose == "truth"
    assert row.targets["position_mm"] == pytest.approx(0.0)
    assert table.human is None


def test_the_table_has_the_published_layout(folder: Path) -> None:
    annotate(folder, "ben", "v1", (0.0, 100.0, 0.0))
    for number, each in enumerate(IDS):
        predict(folder, each, (300.0 * number, 0.0, 400.0 * number))

    lines = error_text(table_of(folder, Truth(annotator="anna"))).splitlines()

    columns = [cell.strip() for cell in lines[1].split("|")]
    assert columns == ["", "position (mm)", "orientation (°)", "θ1 (°)", "θ2 (°)"]
    assert [cell.strip() for cell in lines[2].split("|")] == [
        "predicted keypoints",
        "0.50 ± 0.50",
        "0.0 ± 0.0",
        "0.0 ± 0.0",
        "0.0 ± 0.0",
    ]
    assert lines[3].split("|")[0].strip() == "fitted pose"
    assert any(line.split("|")[0].strip().startswith("annotators by keypoints") for line in lines)
    assert any("keypoints more than 2 mm off, or not found: 0.0%" in line for line in lines)


def test_a_table_is_read_back_from_its_json(folder: Path) -> None:
    predict(folder, "v1", (100.0, 0.0, 0.0))
    table = table_of(folder)

    content = table.model_dump_json()

    assert ErrorTable.model_validate_json(content) == table
    assert "NaN" not in content


def test_a_studys_check_says_nothing_about_predictions(folder: Path) -> None:
    before = [str(found) for found in check_study(folder) if is_wrong(found[1])]
    for each in IDS:
        predict(folder, each)

    assert [str(found) for found in check_study(folder) if is_wrong(found[1])] == before


def test_a_changed_annotation_is_held_against_without_reading_the_others(folder: Path) -> None:
    for each in IDS:
        predict(folder, each)
    predictions, _ = kept_predictions(folder, CHECKPOINT.name, CHECKPOINT.sha256)
    truths = read_truths(folder)
    before = errors_against(truths, predictions)

    edited = annotate(folder, "anna", "v2", (0.0, 0.0, 700.0))
    after = errors_against(truths.with_annotation("v2", edited), predictions)

    anew = study_errors(folder, predictions)
    assert after.rows == anew.rows
    assert after.by_formulas == anew.by_formulas
    assert [row.targets["position_mm"] for row in after.rows] == pytest.approx([0.0, 0.7, 0.0])
    assert (before.rows[0], before.rows[2]) == (after.rows[0], after.rows[2])
    hashes = [
        (one.annotation_sha256, other.annotation_sha256)
        for one, other in zip(before.rows, after.rows, strict=True)
    ]
    assert [one == other for one, other in hashes] == [True, False, True]


def test_who_corrected_a_prediction_is_no_part_of_the_human_floor(folder: Path) -> None:
    for each in IDS:
        annotate(folder, "ben", each, (0.0, 100.0, 0.0))
        predict(folder, each)
    origin = PredictionOrigin(path="p.json", checkpoint="Known", sha256="0" * 64)
    begun = changed(annotate(folder, "ben", "v1", (0.0, 100.0, 0.0)), predicted_from=origin)
    save_annotation(begun, annotation_path(folder, "ben", "v1", "keypoints"), expected="", overwrite=True)
    shown = Viewing(moment=begun.created, shown="predictions", status="in_progress")
    seen = changed(annotate(folder, "ben", "v2", (0.0, 100.0, 0.0)), viewings=(shown,))
    save_annotation(seen, annotation_path(folder, "ben", "v2", "keypoints"), expected="", overwrite=True)

    human = table_of(folder, Truth(annotator="anna")).human

    assert human is not None
    assert set(human.volumes) == {"v3"}
    assert human.pairwise["v3"]["position_mm"] == pytest.approx(0.1)
    assert human.leave_one_out["v3"]["position_mm"] == pytest.approx(0.1)
    assert human.annotators == ("anna", "ben")


def test_a_row_says_what_its_error_may_depend_on(folder: Path) -> None:
    predict(folder, "v1", (100.0, 0.0, 0.0))
    predictions, _ = kept_predictions(folder, CHECKPOINT.name, CHECKPOINT.sha256)

    [row] = study_errors(folder, predictions, checkpoint=described()).rows

    assert row.true_angles_deg == pytest.approx({"theta1": 20.0, "theta2": 40.0})
    assert row.depth_um == pytest.approx(np.mean([position_um[2] for position_um in TRUE_UM.values()]))
    assert row.visible_share == 1.0
    spreads_um = [math.hypot(*each.confidence.spread_um) for each in predictions["v1"].keypoints]
    assert row.spread_um == pytest.approx(max(spreads_um))


def test_depth_runs_along_the_axis_of_the_checkpoint(folder: Path) -> None:
    predict(folder, "v1")
    predictions, _ = kept_predictions(folder, CHECKPOINT.name, CHECKPOINT.sha256)
    along_0 = described(changed_sampling(depth_axis=0))

    [row] = study_errors(folder, predictions, checkpoint=along_0).rows

    assert row.depth_um == pytest.approx(np.mean([position_um[0] for position_um in TRUE_UM.values()]))


def changed_sampling(**fields: object) -> Sampling:
    return OMES_SAMPLING.model_copy(update=fields)
