"""What a person may know of the others' work, as a study's files show it."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from annotations.documents.annotation import VolumeReference, new_annotation, stamped
from annotations.documents.edits import place_keypoint
from annotations.documents.exposure import exposure
from annotations.documents.files import save_annotation
from annotations.documents.provenance import NO_STAMPS, Stamps, Viewing
from annotations.documents.record import Method, Status, changed
from annotations.documents.study import Study, StudyVolume, ViewingRules, annotation_path
from annotations.geometry.tool_library import find_tool

MOMENT = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)
STUDY = Study(
    title="Pilot",
    tool="needle",
    methods=("keypoints", "boxes"),
    annotators=("anna", "ben"),
    assignments={"anna": ("keypoints",)},
    volumes=(StudyVolume(id="v1", path="v1.npy", repeats=1), StudyVolume(id="v10", path="v10.npy")),
)


def write(
    folder: Path,
    annotator: str,
    volume_id: str = "v1",
    *,
    repeat: int = 0,
    method: Method = "keypoints",
    status: Status = "done",
    stamps: Stamps = NO_STAMPS,
) -> None:
    reference = VolumeReference(
        path="v.npy", shape=(4, 5, 6), dtype="uint8", spacing_um=(1.0, 1.0, 1.0), fingerprint="0" * 64
    )
    document = new_annotation(
        reference, find_tool("needle", ()), annotator, method, ships=True, repeat=repeat
    )
    if method == "keypoints":
        document = place_keypoint(document, "tip", (1.0, 2.0, 3.0), "clicked")
    path = annotation_path(folder, annotator, volume_id, method, repeat)
    path.parent.mkdir(parents=True, exist_ok=True)
    save_annotation(stamped(changed(document, status=status), stamps), path, expected="")


def test_others_can_be_seen_from_when_every_pass_is_done_and_there_is_something_to_see(
    tmp_path: Path,
) -> None:
    write(tmp_path, "anna")
    write(tmp_path, "ben", "v10")
    assert not exposure(STUDY, tmp_path, "anna", "v1").could_see
    write(tmp_path, "ben", status="in_progress")
    assert not exposure(STUDY, tmp_path, "anna", "v1").could_see
    write(tmp_path, "anna", "v10")
    assert not exposure(STUDY, tmp_path, "anna", "v1").could_see
    write(tmp_path, "anna", repeat=1)
    assert exposure(STUDY, tmp_path, "anna", "v1").could_see
    never = changed(STUDY, viewing=ViewingRules(others="never"))
    assert not exposure(never, tmp_path, "anna", "v1").could_see


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_what_was_shown_over_any_own_document_stays_known(tmp_path: Path, method: Method) -> None:
    late = Viewing(moment=MOMENT + timedelta(days=1), shown="annotations", status="in_progress")
    early = Viewing(moment=MOMENT, shown="predictions", status="in_progress")
    write(tmp_path, "anna", status="in_progress", stamps=Stamps(viewings=(late,)))
    write(tmp_path, "anna", repeat=1, method=method, stamps=Stamps(viewings=(early,)))
    found = exposure(STUDY, tmp_path, "anna", "v1")
    assert found.could_see
    assert found.viewings == (early, late)
    assert exposure(STUDY, tmp_path, "ben", "v1").viewings == ()


def test_predictions_alone_show_nothing_of_the_others(tmp_path: Path) -> None:
    shown = Viewing(moment=MOMENT, shown="predictions", status="in_progress")
    write(tmp_path, "anna", status="in_progress", stamps=Stamps(viewings=(shown,)))
    assert not exposure(STUDY, tmp_path, "anna", "v1").could_see


def test_who_reopened_one_document_could_see_the_others_before(tmp_path: Path) -> None:
    write(tmp_path, "anna", status="in_progress", stamps=Stamps(reopened=MOMENT))
    assert exposure(STUDY, tmp_path, "anna", "v1").could_see
