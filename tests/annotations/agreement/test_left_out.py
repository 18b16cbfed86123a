"""What cannot be compared is left out, and the reason is given."""

import os
from pathlib import Path
from typing import Any

import pytest

from annotations.agreement.collecting import collect
from annotations.documents.files import annotation_bytes
from annotations.documents.provenance import Contribution
from annotations.geometry.tool_library import find_tool
from tests.annotations.agreement.written import (
    FORCEPS,
    SPACING_UM,
    WrittenStudy,
    document,
    with_part,
    write,
)


def test_documents_in_progress_can_be_left_out(study: WrittenStudy) -> None:
    study.add(document("anna", status="in_progress"), document("ben"))

    material = study.collect(done_only=True)

    assert material.passes["keypoints"][0].annotators == ("ben",)
    assert [each.reason for each in material.left_out] == ["it is not marked as done"]


def test_in_a_study_what_does_not_fit_is_left_out_and_said(study: WrittenStudy) -> None:
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


def test_other_files_are_passed_over(study: WrittenStudy) -> None:
    study.add(document("anna"))
    own = study.folder / "annotations" / "anna"
    write(own / "settings.json", b'{"colour": "red"}')
    write(own / "v1.keypoints.json.bak", annotation_bytes(document("anna")))
    write(own / "v1.keypoints.json.lock", b"{}")
    write(study.folder / "annotations" / "notes.json", b"{}")

    assert (len(study.collect().inputs), study.collect().left_out) == (1, ())


def test_of_a_volume_that_differs_the_odd_ones_are_left_out(study: WrittenStudy) -> None:
    study.add(document("anna"), document("zoe"), document("ben", fingerprint="f" * 64))

    assert list(study.reasons()) == ["ben/v1.keypoints.json"]
    assert "it was made on another volume" in study.reasons()["ben/v1.keypoints.json"]


def test_positions_by_another_spacing_are_not_compared(study: WrittenStudy) -> None:
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


def test_another_tool_than_most_is_left_out(study: WrittenStudy) -> None:
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


def test_an_unknown_tool_or_keypoint_is_said(study: WrittenStudy) -> None:
    text = annotation_bytes(document("ben"))
    study.add(document("anna"))
    write(study.folder / "annotations/ben/v1.keypoints.json", text.replace(b'"k5"', b'"k9"'))
    write(study.folder / "annotations/ben/v2.keypoints.json", text.replace(b'"magnetic-', b'"electric-'))

    reasons = study.reasons()

    assert "'k9' is unknown to the tool" in reasons["ben/v1.keypoints.json"]
    assert "there is no tool specification 'electric-forceps'" in reasons["ben/v2.keypoints.json"]


def test_one_of_whom_no_point_counts_is_no_annotator(study: WrittenStudy) -> None:
    exact = document("truth")
    for index in range(6):
        exact = with_part(exact, index, source="synthesized")
    study.add(document("anna"), exact)

    assert study.collect().passes["keypoints"][0].annotators == ("anna",)
    assert study.reasons() == {
        "truth/v1.keypoints.json": "'truth': 1 file, no point placed by a person (synthesized)"
    }


def test_many_files_of_one_of_whom_no_point_counts_are_one_line(tmp_path: Path) -> None:
    write(tmp_path / "ben.json", document("ben"))
    for name in ("a", "b"):
        for volume in ("v1", "v2"):
            net = document(f"net {name}", volume)
            for index in range(6):
                net = with_part(net, index, source=None, state="unplaced", position_um=None)
            write(tmp_path / (f"nets/{name}" if name == "a" else volume) / f"{name}{volume}.json", net)

    assert {each.path: (each.files, each.reason) for each in collect(tmp_path).left_out} == {
        "nets/a": (2, "'net a': 2 files, no point placed by a person (no position)"),
        ".": (2, "'net b': 2 files, no point placed by a person (no position)"),
    }


def test_a_consensus_is_known_by_what_it_comes_from(study: WrittenStudy) -> None:
    source = Contribution(path="../ben/v1.keypoints.json", annotator="ben", sha256="0" * 64)
    study.add(document("anna", consensus_of=(source,)), document("ben"))

    assert list(study.reasons().values()) == ["it is a consensus, not an annotator's own work"]


@pytest.mark.parametrize("in_study", [True, False])
def test_a_folder_that_cannot_be_read_is_said(
    study: WrittenStudy, monkeypatch: pytest.MonkeyPatch, in_study: bool
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
