from collections.abc import Callable
from pathlib import Path

import pytest

from annotations.documents import permission as documents_permission
from annotations.documents.annotation import Annotation, with_all_parts
from annotations.documents.edits import place_box, place_keypoint
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.permission import FREE, check_may_see_all, keeps_passes_apart, permission
from annotations.documents.queue import queue
from annotations.documents.record import Method, Status, changed
from annotations.documents.study import Study, StudyVolume, ViewingRules, annotation_path
from annotations.documents.study_building import with_rules
from annotations.errors import UserError
from annotations.geometry.boxes import Box
from annotations.geometry.tool_library import shipped_tools

FORCEPS = shipped_tools()["magnetic-forceps"]
STUDY = Study(
    title="trial",
    tool="magnetic-forceps",
    methods=("keypoints", "boxes"),
    annotators=("anna", "ben"),
    assignments={"ben": ("keypoints",)},
    volumes=(
        StudyVolume(id="v001", path="volumes/v001.npy"),
        StudyVolume(id="v002", path="volumes/v002.npy"),
    ),
)

Keep = Callable[..., Path]


def begun(document: Annotation, method: Method) -> Annotation:
    """Return the document by a method with its first part placed."""
    if method == "keypoints":
        return place_keypoint(document, "k0", (1.0, 2.0, 3.0), "clicked")
    empty = with_all_parts(changed(document, method=method, keypoints=()), FORCEPS)
    box = Box((1.0, 2.0, 3.0), (9.0, 4.0, 4.0), (1.0, 0.0, 0.0, 0.0))
    return place_box(empty, FORCEPS.links[0].name, box, "clicked")


@pytest.fixture
def keep(tmp_path: Path, document: Annotation) -> Keep:
    """Write somebody's annotation of a volume."""

    def keep(
        person: str,
        volume_id: str,
        method: Method,
        repeat: int = 0,
        status: Status = "done",
        is_placed: bool = True,
    ) -> Path:
        path = annotation_path(tmp_path, person, volume_id, method, repeat)
        placed = begun(document, method) if is_placed else changed(document, method=method, keypoints=())
        kept = changed(placed, annotator=person, repeat=repeat, status=status)
        save_annotation(kept, path, expected="", overwrite=True)
        return path

    return keep


@pytest.fixture
def anna_is_done(keep: Keep) -> None:
    """The work of each of anna's methods on v001."""
    for method in ("keypoints", "boxes"):
        keep("anna", "v001", method)


def test_nothing_is_seen_before_ones_own_work_is_begun(tmp_path: Path) -> None:
    now = permission(STUDY, tmp_path, "anna", "v001")
    assert (now.may_see, now.may_look) == (False, False)
    assert now.reason == "Your own annotation of this volume is not done yet by each of your methods"
    assert permission(STUDY, tmp_path, "ben", "v001").reason == (
        "Your own annotation of this volume is not done yet"
    )


def test_everything_is_seen_once_every_method_is_done(tmp_path: Path, anna_is_done: None) -> None:
    assert permission(STUDY, tmp_path, "anna", "v001") == FREE
    assert not permission(STUDY, tmp_path, "anna", "v002").may_see
    assert not permission(STUDY, tmp_path, "ben", "v001").may_see


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_one_method_that_is_missing_in_progress_or_empty_keeps_all_hidden(
    tmp_path: Path, anna_is_done: None, keep: Keep, method: Method
) -> None:
    path = annotation_path(tmp_path, "anna", "v001", method)
    path.unlink()
    assert not permission(STUDY, tmp_path, "anna", "v001").may_see
    keep("anna", "v001", method, status="in_progress")
    assert not permission(STUDY, tmp_path, "anna", "v001").may_see
    keep("anna", "v001", method, is_placed=False)
    assert not permission(STUDY, tmp_path, "anna", "v001").may_see


def test_where_volumes_come_again_every_volume_gives_the_same_answer(tmp_path: Path, keep: Keep) -> None:
    """Else the answer for a volume that is done would tell that it is still to come."""
    repeated = changed(STUDY, volumes=(changed(STUDY.volumes[0], repeats=1), STUDY.volumes[1]))
    keep("ben", "v001", "keypoints")
    keep("ben", "v002", "keypoints")
    answers = {permission(repeated, tmp_path, "ben", each.id) for each in repeated.volumes}
    assert len(answers) == 1
    assert not answers.pop().may_see
    keep("ben", "v001", "keypoints", 1)
    assert all(permission(repeated, tmp_path, "ben", each.id) == FREE for each in repeated.volumes)


def test_a_file_that_cannot_be_read_is_not_done(tmp_path: Path, anna_is_done: None) -> None:
    annotation_path(tmp_path, "anna", "v001", "boxes").write_text("{")
    assert not permission(STUDY, tmp_path, "anna", "v001").may_see


def test_only_assigned_methods_have_to_be_done(tmp_path: Path, keep: Keep) -> None:
    keep("ben", "v002", "keypoints")
    assert permission(STUDY, tmp_path, "ben", "v002") == FREE


def test_looking_before_is_possible_only_where_the_study_allows_it(tmp_path: Path) -> None:
    allowed = with_rules(STUDY, viewing=ViewingRules(may_look=True))
    now = permission(allowed, tmp_path, "anna", "v001")
    assert (now.may_see, now.may_look) == (False, True)
    assert now.reason


def test_where_nobody_sees_the_others_being_done_changes_nothing(tmp_path: Path, anna_is_done: None) -> None:
    closed = with_rules(STUDY, viewing=ViewingRules(others="never"))
    now = permission(closed, tmp_path, "anna", "v001")
    assert (now.may_see, now.may_look) == (False, False)
    assert now.reason == "In this study annotators see neither each other's work nor predictions"


def test_where_nobody_sees_the_others_nobody_is_told_to_finish_first(
    tmp_path: Path, anna_is_done: None
) -> None:
    closed = with_rules(STUDY, viewing=ViewingRules(others="never"))
    with pytest.raises(UserError) as refused:
        check_may_see_all(closed, tmp_path, "anna", "it shows what the others found")
    assert str(refused.value) == (
        "it shows what the others found. In this study annotators see neither each other's work nor "
        "predictions. Leave this to the study's reviewers."
    )
    with pytest.raises(UserError, match="Finish your own work"):
        check_may_see_all(STUDY, tmp_path, "anna", "it shows what the others found")


def test_where_volumes_come_again_every_file_is_read_once_for_all_of_them(
    tmp_path: Path, keep: Keep, monkeypatch: pytest.MonkeyPatch
) -> None:
    repeated = changed(STUDY, volumes=tuple(changed(each, repeats=1) for each in STUDY.volumes))
    queued = queue(repeated, "ben", "keypoints")
    paths = [keep("ben", place.volume.id, "keypoints", place.repeat) for place in queued]
    read: list[Path] = []
    monkeypatch.setattr(
        documents_permission, "load_annotation", lambda path: read.append(path) or load_annotation(path)
    )
    check_may_see_all(repeated, tmp_path, "ben", "it shows what the others found")
    assert sorted(read) == sorted(paths)


def test_whoever_does_not_annotate_reviews_where_no_reviewer_is_named(tmp_path: Path) -> None:
    assert permission(STUDY, tmp_path, "rita", "v001") == FREE


def test_where_reviewers_are_named_others_see_nothing(tmp_path: Path) -> None:
    named = with_rules(STUDY, viewing=ViewingRules(reviewers=("rita",)))
    assert permission(named, tmp_path, "rita", "v001") == FREE
    assert not permission(named, tmp_path, "otto", "v001").may_see


def test_a_reviewer_who_annotates_does_so_blindly_too(tmp_path: Path, anna_is_done: None) -> None:
    closed = with_rules(STUDY, viewing=ViewingRules(others="never", reviewers=("anna",)))
    assert not permission(closed, tmp_path, "anna", "v002").may_see
    assert permission(closed, tmp_path, "anna", "v001") == FREE


def test_where_nobody_works_blind_everything_is_seen_at_once(tmp_path: Path) -> None:
    study = changed(STUDY, viewing=ViewingRules(others="always"))

    assert permission(study, tmp_path, "anna", "v001") == FREE
    assert not permission(STUDY, tmp_path, "anna", "v001").may_see


def test_passes_are_kept_apart_until_all_work_is_done_and_only_in_blind_work(
    tmp_path: Path, keep: Keep
) -> None:
    volumes = (changed(STUDY.volumes[0], repeats=1), *STUDY.volumes[1:])
    repeated = changed(STUDY, blind=True, methods=("keypoints",), assignments={}, volumes=volumes)
    assert keeps_passes_apart(repeated, tmp_path, "anna")
    assert not keeps_passes_apart(changed(repeated, blind=False), tmp_path, "anna")
    assert not keeps_passes_apart(changed(repeated, volumes=STUDY.volumes), tmp_path, "anna")
    for place in queue(repeated, "anna", "keypoints"):
        assert keeps_passes_apart(repeated, tmp_path, "anna")
        keep("anna", place.volume.id, "keypoints", repeat=place.repeat)
    assert not keeps_passes_apart(repeated, tmp_path, "anna")
