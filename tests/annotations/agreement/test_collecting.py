import json
import os
import re
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.collecting import collect
from annotations.agreement.comparison import agreement_of
from annotations.agreement.results import Statistics
from annotations.demo import make_demo_study
from annotations.documents.provenance import PredictionOrigin, Viewing
from annotations.documents.record import changed
from annotations.documents.representations import keypoint_positions_um
from annotations.documents.standing import STANDINGS
from annotations.documents.study import StudyError
from annotations.errors import Cancelled, UserError
from annotations.geometry.kinematics import keypoints_um
from tests.annotations.agreement.written import (
    FORCEPS,
    POSE,
    WrittenStudy,
    document,
    with_part,
    write,
)


def test_a_study_is_in_its_own_order(study: WrittenStudy) -> None:
    study.add(document("zoe"), document("anna"), document("ben", "v2"), document("anna", "v2"))

    material = study.collect()
    (compared,) = material.passes["keypoints"]

    assert material.title == "Trial"
    assert material.tool == FORCEPS
    assert compared.annotators == ("ben", "anna", "zoe")
    assert compared.volumes == ("v2", "v1")
    assert compared.has_document.tolist() == [[True, True, False], [False, True, True]]
    assert np.isnan(compared.positions_um[0, 2]).all()
    assert compared.positions_um[1, 2] == pytest.approx(np.array(list(keypoints_um(POSE, FORCEPS).values())))
    assert [each.volume for each in material.inputs] == ["v1", "v2", "v2", "v1"]
    assert material.left_out == ()


def test_a_study_can_be_named_by_its_file(study: WrittenStudy) -> None:
    study.add(document("anna"))

    assert collect(study.folder / "study.toml").inputs == study.collect().inputs


def test_inputs_say_what_was_read(study: WrittenStudy) -> None:
    study.add(document("anna", repeat=2, status="in_progress"), document("anna"))

    inputs = study.collect().inputs

    assert [(each.path, each.repeat, each.status) for each in inputs] == [
        ("annotations/anna/v1.keypoints.json", 0, "done"),
        ("annotations/anna/v1.keypoints.repeat2.json", 2, "in_progress"),
    ]
    assert all(type(each).model_validate(each.model_dump()) == each for each in inputs)
    assert len({each.sha256 for each in inputs}) == 2


def test_passes_are_apart_and_have_the_volumes_that_they_have(study: WrittenStudy) -> None:
    study.add(document("anna"), document("anna", "v2"), document("ben", "v2", repeat=3))

    first, again = study.collect().passes["keypoints"]

    assert (first.volumes, again.volumes) == (("v2", "v1"), ("v2",))
    assert first.annotators == again.annotators == ("ben", "anna")
    assert again.has_document.tolist() == [[True, False]]


def test_a_repeat_without_a_first_pass_is_no_first_pass(study: WrittenStudy) -> None:
    study.add(document("anna", repeat=1))

    first, again = study.collect().passes["keypoints"]

    assert (first.volumes, again.volumes) == ((), ("v1",))


def test_keypoints_of_boxes_are_their_ends(study: WrittenStudy) -> None:
    of_boxes = document("anna", method="boxes")
    study.add(of_boxes)

    (compared,) = study.collect().passes["boxes"]

    expected = keypoint_positions_um(of_boxes, FORCEPS)
    assert compared.positions_um[0, 0] == pytest.approx(
        np.array([expected[k] for k in FORCEPS.keypoint_names])
    )
    assert compared.rotations_wxyz is not None
    assert compared.rotations_wxyz[0, 0] == pytest.approx(
        np.array([box.rotation_wxyz for box in of_boxes.placed_boxes.values()])
    )


@pytest.mark.parametrize("source", ["fitted", "predicted", "derived", "synthesized"])
def test_points_that_nobody_placed_do_not_count(study: WrittenStudy, source: str) -> None:
    study.add(with_part(document("anna"), 3, source=source, state="occluded"))

    (compared,) = study.collect().passes["keypoints"]

    assert [STANDINGS[code] for code in compared.standing[0, 0]] == [
        *["counted"] * 3,
        source,
        *["counted"] * 2,
    ]
    assert np.isnan(compared.positions_um[0, 0]).any(axis=1).tolist() == [False] * 3 + [True] + [False] * 2
    assert not compared.doubtful.any()


@pytest.mark.parametrize(
    "doubt", [{"state": "occluded"}, {"state": "out_of_view"}, {"certainty": "unsure"}], ids=str
)
def test_points_placed_in_doubt_count_and_are_marked(study: WrittenStudy, doubt: dict[str, str]) -> None:
    study.add(with_part(document("anna"), 2, **doubt))

    (compared,) = study.collect().passes["keypoints"]

    assert np.isfinite(compared.positions_um).all()
    assert np.flatnonzero(compared.doubtful[0, 0]).tolist() == [2]
    assert np.isnan(compared.without_doubtful().positions_um[0, 0, 2]).all()


def test_a_keypoint_without_a_position_does_not_count(study: WrittenStudy) -> None:
    study.add(with_part(document("anna"), 5, state="unplaced", position_um=None, source=None))

    (compared,) = study.collect().passes["keypoints"]

    assert STANDINGS[compared.standing[0, 0, 5]] == "no_position"


def test_both_ends_of_a_box_stand_as_it_does(study: WrittenStudy) -> None:
    boxes = with_part(document("anna", method="boxes"), 0, source="fitted")
    boxes = with_part(boxes, 1, certainty="unsure")
    boxes = with_part(
        boxes, 2, state="unplaced", center_um=None, size_um=None, rotation_wxyz=None, source=None
    )
    study.add(boxes)

    (compared,) = study.collect().passes["boxes"]

    assert [STANDINGS[code] for code in compared.standing[0, 0]] == [
        *["fitted"] * 2, *["counted"] * 2, *["no_position"] * 2
    ]  # fmt: skip
    assert np.flatnonzero(compared.doubtful[0, 0]).tolist() == [2, 3]
    assert (
        np.isfinite(compared.positions_um[0, 0]).all(axis=1).tolist()
        == [False] * 2 + [True] * 2 + [False] * 2
    )
    assert compared.rotations_wxyz is not None
    assert np.isfinite(compared.rotations_wxyz[0, 0]).all(axis=1).tolist() == [False, True, False]


def test_what_a_document_says_of_itself_is_kept(study: WrittenStudy) -> None:
    moment = datetime(2026, 1, 2, tzinfo=UTC)
    looked = Viewing(moment=moment, shown="annotations", status="in_progress")
    study.add(
        document("anna", status="in_progress", flag="look at k3", active_seconds=12.5),
        document("ben", viewings=(looked,)),
    )
    shown = changed(looked, shown="predictions")
    origin = PredictionOrigin(path="p.json", checkpoint="Lean", sha256="0" * 64)
    study.add(document("anna", "v2", viewings=(shown,)), document("ben", "v2", predicted_from=origin))

    compared = study.collect().passes["keypoints"][0]

    assert compared.volumes == ("v2", "v1")
    assert compared.is_from_prediction.tolist() == [[True, False], [False, False]]
    assert compared.is_independent.tolist() == [[False, False], [False, True]]
    assert compared.is_blind.tolist() == [[True, False], [False, True]]
    assert compared.is_done[1].tolist() == [True, False]
    assert compared.is_flagged[1].tolist() == [False, True]
    assert compared.active_seconds[1].tolist() == [0.0, 12.5]


def test_a_study_without_annotations_is_empty(study: WrittenStudy) -> None:
    material = study.collect()

    assert (material.passes, material.inputs, material.tool) == ({}, (), FORCEPS)


def test_a_folder_without_a_study_is_compared_by_fingerprints(tmp_path: Path) -> None:
    write(tmp_path / "one.json", document("anna", "scan"))
    write(tmp_path / "deep" / "down" / "two.json", document("ben", "renamed", fingerprint=f"{'scan':0>64}"))
    write(tmp_path / "three.json", document("ben", "another"))
    write(tmp_path / "coco.json", json.dumps({"images": []}).encode())
    write(tmp_path / "broken.json", b"{")

    material = collect(tmp_path)
    (compared,) = material.passes["keypoints"]

    assert material.title == tmp_path.name
    assert compared.annotators == ("anna", "ben")
    assert compared.volumes == ("another", "scan")
    assert compared.has_document.tolist() == [[False, True], [True, True]]
    assert material.left_out == ()


def test_volumes_of_one_name_are_told_apart(tmp_path: Path) -> None:
    write(tmp_path / "a.json", document("anna", "scan", fingerprint="a" * 64))
    write(tmp_path / "b.json", document("anna", "scan", fingerprint="b" * 64))
    write(tmp_path / "c.json", document("anna", "other"))

    material = collect(tmp_path)

    assert material.passes["keypoints"][0].volumes == ("other", "scan (aaaaaaaa)", "scan (bbbbbbbb)")
    assert {each.path: each.volume for each in material.inputs}["b.json"] == "scan (bbbbbbbb)"


def test_of_two_documents_of_one_piece_of_work_the_later_counts(tmp_path: Path) -> None:
    early, late = datetime(2026, 1, 1, tzinfo=UTC), datetime(2026, 1, 2, tzinfo=UTC)
    write(tmp_path / "copy.json", document("anna", modified=early))
    write(tmp_path / "own.json", document("anna", modified=late))
    write(tmp_path / "own2.json", document("anna", modified=late))
    write(tmp_path / "boxes.json", document("anna", method="boxes", modified=early))

    material = collect(tmp_path)

    same = "it is the same volume, annotator, method and pass as own.json"
    assert [each.path for each in material.inputs] == ["boxes.json", "own.json"]
    assert {each.path: each.reason for each in material.left_out} == {
        "copy.json": f"{same}, which was modified later",
        "own2.json": same,
    }


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere every name is Unicode")
def test_names_that_are_no_unicode_do_not_stop_a_comparison(tmp_path: Path) -> None:
    write(tmp_path / os.fsdecode(b"a\xff.json"), document("anna", "scan"))
    write(tmp_path / os.fsdecode(b"b\xff.json"), document("ben", "scan").model_copy(update={"repeat": 1}))
    write(tmp_path / os.fsdecode(b"c\xff.keypoints.json"), b"{")

    agreement = agreement_of(tmp_path, resamples=10)

    assert [each.path for each in (*agreement.inputs, *agreement.left_out)] == [
        "a?.json", "b?.json", "c?.keypoints.json"
    ]  # fmt: skip
    assert "a?.json" in agreement.model_dump_json()


@pytest.mark.parametrize("files", [[], ["other.json"]], ids=str)
def test_a_folder_without_an_annotation_is_an_error(tmp_path: Path, files: list[str]) -> None:
    for name in files:
        write(tmp_path / name, b"{}")

    with pytest.raises(UserError, match=r"no annotation file"):
        collect(tmp_path)


def test_a_folder_of_damaged_annotations_is_empty_and_says_why(tmp_path: Path) -> None:
    write(tmp_path / "v1.keypoints.json", b"{}")

    agreement = agreement_of(tmp_path, resamples=10)

    assert (agreement.tool, agreement.methods, agreement.targets) == (None, {}, ())
    assert [each.path for each in agreement.left_out] == ["v1.keypoints.json"]


def test_where_no_point_counts_the_figures_are_absent_by_name(tmp_path: Path) -> None:
    for annotator in ("anna", "ben"):
        derived = document(annotator, method="boxes")
        for index in range(3):
            derived = with_part(derived, index, source="derived")
        write(tmp_path / f"{annotator}.json", derived)

    agreement = agreement_of(tmp_path, resamples=10)

    assert list(agreement.methods) == ["boxes"]
    assert agreement.methods["boxes"].targets["theta2_deg"] == Statistics()
    assert (agreement.annotators, len(agreement.left_out)) == ((), 2)


def test_what_is_no_folder_and_a_study_that_is_wrong_are_errors(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such folder"):
        collect(tmp_path / "absent")
    write(tmp_path / "study.toml", b"title = 3")
    with pytest.raises(StudyError):
        collect(tmp_path)


def test_collecting_says_how_far_it_is_and_can_be_cancelled(study: WrittenStudy) -> None:
    study.add(document("anna"), document("ben"))
    shares: list[float] = []

    study.collect(progress=shares.append)

    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    for steps in range(5):
        answers = iter([*[False] * steps, True])
        with pytest.raises(Cancelled):
            study.collect(cancelled=lambda answers=answers: next(answers))


def test_the_truth_of_the_demo_study_is_no_annotator(tmp_path: Path) -> None:
    folder = make_demo_study(tmp_path / "demo")

    material = collect(folder)

    (first,) = material.passes["keypoints"]
    assert (first.annotators, first.volumes) == ((), ())
    (line,) = material.left_out
    assert line.path == "annotations/truth"
    assert re.fullmatch(r"'truth': \d+ files, no point placed by a person \(synthesized\)", line.reason)
