"""Who speaks for a volume, told by the training files that are made of a study."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from annotations.documents.annotation import Annotation
from annotations.documents.edits import clear, place_keypoint, set_status
from annotations.documents.provenance import Contribution
from annotations.documents.record import changed
from annotations.errors import UserError
from annotations.geometry.tool_library import shipped_tools
from annotations.interchange.training_file import ExportOptions, export_targets
from tests.annotations.interchange.conftest import read_csv, read_hdf5, reasons

FORCEPS = shipped_tools()["magnetic-forceps"]
MakeStudy = Callable[..., Any]


def test_the_consensus_speaks_for_a_volume(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    study.add(1, "anna")
    study.add(1, "ben")
    study.add(1, "consensus")
    export_targets(study.folder, tmp_path / "t.h5")

    assert read_hdf5(tmp_path / "t.h5")[0]["document/annotator"].tolist() == ["consensus"]


def test_volumes_of_several_annotators_without_consensus_are_left_out_and_named(
    make_study: MakeStudy, tmp_path: Path
) -> None:
    study = make_study(4)
    for number, annotator in [(1, "anna"), (1, "ben"), (2, "anna"), (2, "ben"), (3, "ben")]:
        study.add(number, annotator)
    study.add(2, "consensus", status="in_progress")
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert read_hdf5(tmp_path / "t.h5")[0]["volume_id"].tolist() == ["v003"]
    assert reasons(exported) == [
        ("v001", "several"),
        ("v002", "several"),
        ("v004", "unannotated"),
    ]
    assert [one.reason for one in exported.left_out[:2]] == [
        "anna, ben have annotated it, and there is no consensus",
        "anna, ben have annotated it, and the consensus is not done",
    ]


def test_a_stale_consensus_is_exported_and_said(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(3)
    for number in (1, 2, 3):
        sources = []
        for annotator in ("anna", "ben"):
            path = study.add(number, annotator)
            sources.append(
                Contribution(
                    path=f"../{annotator}/{path.name}",
                    annotator=annotator,
                    sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
                )
            )
        study.add(number, "consensus", consensus_of=tuple(sources))
    study.add(2, "anna", flag="Looked at again")
    (study.folder / "annotations" / "ben" / "v003.keypoints.json").unlink()
    for name in ("t.h5", "t.csv"):
        exported = export_targets(study.folder, tmp_path / name)

    assert exported.stale_volumes == ("v002", "v003")
    changed_since, gone = exported.remarks
    assert (
        changed_since == "v002: the consensus was settled before anna's annotation changed: settle it again"
    )
    assert gone.startswith("v003: the consensus was settled from an annotation of ben's that cannot be read")
    data, _ = read_hdf5(tmp_path / "t.h5")
    assert data["document/consensus_is_stale"].tolist() == [False, True, True]
    assert [row["consensus_is_stale"] for row in read_csv(tmp_path / "t.csv")] == ["0", "1", "1"]


def sourced(document: Annotation, source: Any) -> Annotation:
    """The document as if all of it had come about in one way."""
    parts = [part.model_copy(update={"source": source}) for part in document.parts]
    return changed(document, **{document.method: tuple(parts)})


@pytest.mark.parametrize("source", ["synthesized", "predicted", "fitted", "derived"])
def test_what_nobody_placed_is_nobodys_opinion(make_study: MakeStudy, tmp_path: Path, source: Any) -> None:
    study = make_study(2)
    study.add(1, "anna")
    for number in (1, 2):
        study.save(sourced(study.document(number, "truth"), source))
    one_each = export_targets(study.folder, tmp_path / "one.h5")
    every = export_targets(study.folder, tmp_path / "every.h5", ExportOptions(every_annotation=True))
    truth = export_targets(study.folder, tmp_path / "truth.h5", ExportOptions(annotator="truth"))

    for exported in (one_each, every):
        assert (exported.rows, reasons(exported)) == (1, [("v001", "unplaced"), ("v002", "unplaced")])
        assert exported.reasons["v001"] == "nobody placed anything in truth's annotation"
    assert (truth.rows, truth.left_out) == (2, ())


def test_one_part_that_a_person_has_moved_makes_it_an_opinion(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    document = sourced(study.document(1), "predicted")
    study.save(set_status(place_keypoint(document, "k0", (1.0, 2.0, 3.0), "dragged"), "done"))

    assert export_targets(study.folder, tmp_path / "t.h5").rows == 1


def test_a_study_of_nothing_but_a_simulation_is_exported(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    for number in (1, 2):
        study.save(sourced(study.document(number, "truth"), "synthesized"))
    study.save(sourced(study.document(1, "net"), "predicted"))
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert read_hdf5(tmp_path / "t.h5")[0]["document/annotator"].tolist() == ["truth", "truth"]
    assert reasons(exported) == [("v001", "unplaced")]
    # Whoever has only looked has done nothing.
    begun = study.document(1, "anna")
    for part in begun.parts:
        begun = clear(begun, part.name)
    study.save(set_status(begun, "in_progress"))
    assert export_targets(study.folder, tmp_path / "looked.h5").rows == 2
    study.add(1, "anna", status="in_progress")
    with pytest.raises(UserError, match="nobody placed anything in net's annotation"):
        export_targets(study.folder, tmp_path / "begun.h5")


def test_what_holds_no_position_teaches_nothing(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1)
    empty = study.document(2)
    for part in empty.parts:
        empty = clear(empty, part.name)
    study.save(set_status(empty, "done"))
    exported = export_targets(study.folder, tmp_path / "t.h5", ExportOptions(annotator="anna"))

    assert (exported.rows, reasons(exported)) == (1, [("v002", "unplaced")])


def test_a_volume_is_named_once_with_all_its_reasons(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1)
    for annotator in ("anna", "ben", "carl"):
        study.add(2, annotator, status="in_progress" if annotator == "carl" else "done")
    study.add(2, "consensus").write_text("{")
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert list(exported.reasons) == ["v002"]
    assert exported.reasons["v002"].startswith(
        "anna, ben have annotated it, and v002.keypoints.json of consensus cannot be used"
    )
    assert exported.reasons["v002"].endswith("; carl's annotation is not done")


def test_one_annotator_can_speak_for_all(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    for number, annotator in [(1, "anna"), (1, "ben"), (1, "consensus"), (2, "anna")]:
        study.add(number, annotator)
    exported = export_targets(study.folder, tmp_path / "t.h5", ExportOptions(annotator="ben"))

    assert read_hdf5(tmp_path / "t.h5")[0]["document/annotator"].tolist() == ["ben"]
    assert reasons(exported) == [("v002", "unannotated")]
    assert exported.left_out[0].reason == "ben has not annotated it by keypoints"


def test_repeats_are_no_second_opinion(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(1)
    study.add(1)
    study.add(1, repeat=1)
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert (exported.rows, exported.left_out) == (1, ())
    assert read_hdf5(tmp_path / "t.h5")[0]["document/repeat"].tolist() == [0]


def test_unfinished_annotations_count_on_demand(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1)
    study.add(2, status="in_progress")
    without = export_targets(study.folder, tmp_path / "without.h5")
    with_them = export_targets(study.folder, tmp_path / "with.h5", ExportOptions(include_unfinished=True))

    assert (without.rows, reasons(without)) == (1, [("v002", "unfinished")])
    assert (with_them.rows, with_them.left_out) == (2, ())
    assert read_hdf5(tmp_path / "with.h5")[0]["document/status"].tolist() == ["done", "in_progress"]


def test_a_broken_document_leaves_its_volume_out_and_is_named(make_study: MakeStudy, tmp_path: Path) -> None:
    study = make_study(2)
    study.add(1, "anna")
    study.add(1, "ben").write_text("{")
    study.add(2)
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert (exported.rows, reasons(exported)) == (1, [("v001", "unusable")])
    assert "v001.keypoints.json of ben" in exported.left_out[0].reason


def test_a_document_of_another_tool_is_left_out_but_one_of_other_lengths_is_not(
    make_study: MakeStudy, tmp_path: Path
) -> None:
    study = make_study(2)
    links = tuple(link.model_copy(update={"length_um": 1.01 * link.length_um}) for link in FORCEPS.links)
    calibrated = FORCEPS.model_copy(update={"name": "mine", "links": links})
    same = {"tool": "mine", "tool_copy": calibrated, "tool_fingerprint": calibrated.fingerprint}
    study.add(1, **same)
    needle = shipped_tools()["needle"]
    study.add(
        2, tool="needle", tool_copy=needle, tool_fingerprint=needle.fingerprint, keypoints=(), status="done"
    )
    exported = export_targets(study.folder, tmp_path / "t.h5")

    assert (exported.rows, reasons(exported)) == (1, [("v002", "unusable")])
    assert "needle" in exported.left_out[0].reason
