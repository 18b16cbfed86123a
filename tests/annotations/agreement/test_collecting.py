import json
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from annotations.agreement.collecting import collect
from annotations.agreement.compared import Material
from annotations.agreement.comparison import agreement_of
from annotations.agreement.standing import STANDINGS
from annotations.documents.annotation import Annotation, VolumeReference, new_annotation
from annotations.documents.edits import place_box, place_keypoint, set_status
from annotations.documents.files import annotation_bytes
from annotations.documents.provenance import Contribution, Viewing
from annotations.documents.record import Method, changed
from annotations.documents.representations import keypoint_positions_um
from annotations.documents.study import Study, StudyError, StudyVolume, annotation_path, save_study
from annotations.errors import Cancelled, UserError
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.synthesis.demo import make_demo_study

FORCEPS = find_tool("magnetic-forceps")
POSE = ToolPose((4e3, 5e3, 3e3), about_axis((1, 2, 3), 40.0), {"theta1": 35.0, "theta2": 50.0})
SPACING_UM = (15.9, 13.5, 9.4)


def document(
    annotator: str = "anna",
    volume: str = "v1",
    method: Method = "keypoints",
    *,
    tool: ToolSpecification = FORCEPS,
    spacing_um: tuple[float, float, float] = SPACING_UM,
    fingerprint: str | None = None,
    **fields: Any,
) -> Annotation:
    """Return a document whose annotator placed everything; of an own volume for each name."""
    reference = VolumeReference(
        path=f"../../volumes/{volume}.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=spacing_um,
        fingerprint=fingerprint or f"{volume:0>64}",
    )
    ships = tool is FORCEPS
    made = new_annotation(reference, tool, annotator, method, ships=ships, repeat=fields.pop("repeat", 0))
    if tool.joints and method == "keypoints":
        for name, position_um in keypoints_um(POSE, tool).items():
            made = place_keypoint(made, name, position_um, "clicked")
    elif tool.joints:
        for link, box in link_boxes(POSE, tool).items():
            made = place_box(made, link, box, "clicked")
    else:
        for name in tool.keypoint_names:
            made = place_keypoint(made, name, (1.0, 2.0, 3.0), "clicked")
    return changed(set_status(made, "done"), **fields)


def with_part(whole: Annotation, index: int, **fields: Any) -> Annotation:
    parts = list(whole.parts)
    parts[index] = changed(parts[index], **fields)
    return changed(whole, **{whole.method: tuple(parts)})


def write(path: Path, content: Annotation | bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else annotation_bytes(content))
    return path


class AStudy:
    """A study's folder, without volumes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        save_study(
            Study(
                title="Trial",
                tool=FORCEPS.name,
                methods=("keypoints", "boxes"),
                annotators=("ben", "anna"),
                volumes=tuple(StudyVolume(id=name, path=f"volumes/{name}.npy") for name in ("v2", "v1")),
            ),
            folder,
        )

    def add(self, *documents: Annotation, volume: str | None = None) -> None:
        for each in documents:
            volume_id = volume or Path(each.volume.path).stem
            path = annotation_path(self.folder, each.annotator, volume_id, each.method, each.repeat)
            write(path, each)

    def collect(self, **options: Any) -> Material:
        return collect(self.folder, **options)

    def reasons(self) -> dict[str, str]:
        return {each.path.removeprefix("annotations/"): each.reason for each in self.collect().left_out}


@pytest.fixture
def study(tmp_path: Path) -> AStudy:
    folder = tmp_path / "study"
    folder.mkdir()
    return AStudy(folder)


def test_a_study_is_in_its_own_order(study: AStudy) -> None:
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


def test_a_study_can_be_named_by_its_file(study: AStudy) -> None:
    study.add(document("anna"))

    assert collect(study.folder / "study.toml").inputs == study.collect().inputs


def test_inputs_say_what_was_read(study: AStudy) -> None:
    study.add(document("anna", repeat=2, status="in_progress"), document("anna"))

    inputs = study.collect().inputs

    assert [(each.path, each.repeat, each.status) for each in inputs] == [
        ("annotations/anna/v1.keypoints.json", 0, "done"),
        ("annotations/anna/v1.keypoints.repeat2.json", 2, "in_progress"),
    ]
    assert all(type(each).model_validate(each.model_dump()) == each for each in inputs)
    assert len({each.sha256 for each in inputs}) == 2


def test_passes_are_apart_and_have_the_volumes_that_they_have(study: AStudy) -> None:
    study.add(document("anna"), document("anna", "v2"), document("ben", "v2", repeat=3))

    first, again = study.collect().passes["keypoints"]

    assert (first.volumes, again.volumes) == (("v2", "v1"), ("v2",))
    assert first.annotators == again.annotators == ("ben", "anna")
    assert again.has_document.tolist() == [[True, False]]


def test_a_repeat_without_a_first_pass_is_no_first_pass(study: AStudy) -> None:
    study.add(document("anna", repeat=1))

    first, again = study.collect().passes["keypoints"]

    assert (first.volumes, again.volumes) == ((), ("v1",))


def test_keypoints_of_boxes_are_their_ends(study: AStudy) -> None:
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
def test_points_that_nobody_placed_do_not_count(study: AStudy, source: str) -> None:
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
def test_points_placed_in_doubt_count_and_are_marked(study: AStudy, doubt: dict[str, str]) -> None:
    study.add(with_part(document("anna"), 2, **doubt))

    (compared,) = study.collect().passes["keypoints"]

    assert np.isfinite(compared.positions_um).all()
    assert np.flatnonzero(compared.doubtful[0, 0]).tolist() == [2]
    assert np.isnan(compared.without_doubtful().positions_um[0, 0, 2]).all()


def test_a_keypoint_without_a_position_does_not_count(study: AStudy) -> None:
    study.add(with_part(document("anna"), 5, state="unplaced", position_um=None, source=None))

    (compared,) = study.collect().passes["keypoints"]

    assert STANDINGS[compared.standing[0, 0, 5]] == "no_position"


def test_both_ends_of_a_box_stand_as_it_does(study: AStudy) -> None:
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


def test_what_a_document_says_of_itself_is_kept(study: AStudy) -> None:
    moment = datetime(2026, 1, 2, tzinfo=UTC)
    looked = Viewing(moment=moment, shown="annotations", status="in_progress")
    study.add(
        document("anna", status="in_progress", flag="look at k3", active_seconds=12.5),
        document("ben", viewings=(looked,)),
    )

    (compared,) = study.collect().passes["keypoints"]

    assert compared.is_done.tolist() == [[True, False]]
    assert compared.is_blind.tolist() == [[False, True]]
    assert compared.is_flagged.tolist() == [[False, True]]
    assert compared.active_seconds.tolist() == [[0.0, 12.5]]


def test_documents_in_progress_can_be_left_out(study: AStudy) -> None:
    study.add(document("anna", status="in_progress"), document("ben"))

    material = study.collect(done_only=True)

    assert material.passes["keypoints"][0].annotators == ("ben",)
    assert [each.reason for each in material.left_out] == ["it is not marked as done"]


def test_in_a_study_what_does_not_fit_is_left_out_and_said(study: AStudy) -> None:
    study.add(document("anna"), document("ben"))
    own = study.folder / "annotations" / "anna"
    write(own / "v2.keypoints.json", document("ben", "v2"))
    write(own / "v2.boxes.json", document("anna", "v2"))
    write(own / "v3.keypoints.json", document("anna", "v3"))
    write(own / "something.json", document("anna", "v2"))
    write(own / "v1.boxes.json", annotation_bytes(document("anna", method="boxes"))[:-40])
    write(
        own / "v2.keypoints.repeat1.json",
        annotation_bytes(document("anna")).replace(b"annotation/1", b"annotation/9"),
    )
    write(study.folder / "annotations" / "consensus" / "v1.keypoints.json", document("consensus"))

    reasons = study.reasons()

    assert reasons["anna/v2.keypoints.json"] == "it lies in the folder of 'anna', and its annotator is 'ben'"
    assert reasons["anna/v2.boxes.json"].startswith(
        "its name says boxes, repeat 0, and its content keypoints"
    )
    assert reasons["anna/v3.keypoints.json"] == "the study has no volume 'v3'"
    assert reasons["anna/something.json"].startswith("it is not named like an annotation of a study")
    assert reasons["anna/v1.boxes.json"].startswith("line ")
    assert "truncated" in reasons["anna/v1.boxes.json"]
    assert "'oct-annotation/9'" in reasons["anna/v2.keypoints.repeat1.json"]
    assert reasons["consensus/v1.keypoints.json"] == "it is a consensus, not an annotator's own work"
    assert len(reasons) == 7
    assert len(study.collect().inputs) == 2


def test_other_files_are_passed_over(study: AStudy) -> None:
    study.add(document("anna"))
    own = study.folder / "annotations" / "anna"
    write(own / "settings.json", b'{"colour": "red"}')
    write(own / "v1.keypoints.json.bak", annotation_bytes(document("anna")))
    write(own / "v1.keypoints.json.lock", b"{}")
    write(study.folder / "annotations" / "notes.json", b"{}")

    assert (len(study.collect().inputs), study.collect().left_out) == (1, ())


def test_of_a_volume_that_differs_the_odd_ones_are_left_out(study: AStudy) -> None:
    study.add(document("anna"), document("zoe"), document("ben", fingerprint="f" * 64))

    assert list(study.reasons()) == ["ben/v1.keypoints.json"]
    assert "it was made on another volume" in study.reasons()["ben/v1.keypoints.json"]


def test_positions_by_another_spacing_are_not_compared(study: AStudy) -> None:
    nearly = (SPACING_UM[0] * (1 + 5e-7), *SPACING_UM[1:])
    study.add(
        document("anna"),
        document("cleo"),
        document("ben", spacing_um=(15.9, 13.5, 9.5)),
        document("zoe", spacing_um=nearly),
    )

    reasons = study.reasons()

    assert list(reasons) == ["ben/v1.keypoints.json"]
    assert "(15.9, 13.5, 9.5) µm" in reasons["ben/v1.keypoints.json"]


def test_another_tool_than_most_is_left_out(study: AStudy) -> None:
    longer = FORCEPS.model_copy(update={"title": "Another version"})
    study.add(
        document("anna"),
        document("anna", "v2"),
        document("ben", tool=find_tool("needle").model_copy(update={"name": "pin"})),
        document("zoe", tool=longer),
    )

    assert study.reasons() == {
        "ben/v1.keypoints.json": "its tool is 'pin', that of most files 'magnetic-forceps'",
        "zoe/v1.keypoints.json": (
            "it was made with another version of the tool 'magnetic-forceps' than most files"
        ),
    }


def test_an_unknown_tool_or_keypoint_is_said(study: AStudy) -> None:
    text = annotation_bytes(document("ben"))
    study.add(document("anna"))
    write(study.folder / "annotations/ben/v1.keypoints.json", text.replace(b'"k5"', b'"k9"'))
    write(study.folder / "annotations/ben/v2.keypoints.json", text.replace(b'"magnetic-', b'"electric-'))

    reasons = study.reasons()

    assert "'k9' is unknown to the tool" in reasons["ben/v1.keypoints.json"]
    assert "there is no tool specification 'electric-forceps'" in reasons["ben/v2.keypoints.json"]


def test_one_of_whom_no_point_counts_is_no_annotator(study: AStudy) -> None:
    exact = document("truth")
    for index in range(6):
        exact = with_part(exact, index, source="synthesized")
    study.add(document("anna"), exact)

    assert study.collect().passes["keypoints"][0].annotators == ("anna",)
    assert study.reasons() == {"truth/v1.keypoints.json": "'truth' placed no point anywhere (synthesized)"}


def test_a_consensus_is_known_by_what_it_comes_from(study: AStudy) -> None:
    source = Contribution(path="../ben/v1.keypoints.json", annotator="ben", sha256="0" * 64)
    study.add(document("anna", consensus_of=(source,)), document("ben"))

    assert list(study.reasons().values()) == ["it is a consensus, not an annotator's own work"]


def test_a_study_without_annotations_is_empty(study: AStudy) -> None:
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


@pytest.mark.parametrize("in_study", [True, False])
def test_a_folder_that_cannot_be_read_is_said(
    study: AStudy, monkeypatch: pytest.MonkeyPatch, in_study: bool
) -> None:
    study.add(document("anna"), document("ben"))
    if not in_study:
        (study.folder / "study.toml").unlink()
    scan = os.scandir

    def refuse(path: str | Path) -> Any:
        if Path(path).name == "ben":
            raise PermissionError(13, "Permission denied", str(path))
        return scan(path)

    monkeypatch.setattr(os, "scandir", refuse)

    material = study.collect()

    assert [each.annotator for each in material.inputs] == ["anna"]
    assert [(each.path, each.reason) for each in material.left_out] == [
        ("annotations/ben", "the folder could not be read (Permission denied)")
    ]


@pytest.mark.parametrize("files", [[], ["other.json"], ["v1.keypoints.json"]], ids=str)
def test_a_folder_with_nothing_to_compare_is_an_error(tmp_path: Path, files: list[str]) -> None:
    for name in files:
        write(tmp_path / name, b"{}")

    with pytest.raises(UserError, match=r"annotation file"):
        collect(tmp_path)


def test_what_is_no_folder_and_a_study_that_is_wrong_are_errors(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such folder"):
        collect(tmp_path / "absent")
    write(tmp_path / "study.toml", b"title = 3")
    with pytest.raises(StudyError):
        collect(tmp_path)


def test_collecting_says_how_far_it_is_and_can_be_cancelled(study: AStudy) -> None:
    study.add(document("anna"), document("ben"))
    shares: list[float] = []

    study.collect(progress=shares.append)

    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    with pytest.raises(Cancelled):
        study.collect(cancelled=lambda: True)


def test_the_truth_of_the_demo_study_is_no_annotator(tmp_path: Path) -> None:
    folder = make_demo_study(tmp_path / "demo")

    material = collect(folder)

    assert material.passes == {}
    assert material.left_out
    assert all("synthesized" in each.reason for each in material.left_out)
