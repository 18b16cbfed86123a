import hashlib
import json
import os
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from annotations.documents import seen_volumes
from annotations.documents.annotation import Annotation, new_annotation
from annotations.documents.checks import Finding
from annotations.documents.edits import place_keypoint, set_status
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.locks import DocumentLock
from annotations.documents.provenance import Contribution, Viewing
from annotations.documents.record import Method, changed
from annotations.documents.study import STUDY_FILE, annotation_path, load_study, save_study
from annotations.documents.study_building import create_study, study_of_volumes, volumes_at, with_rules
from annotations.documents.study_checks import by_path, check_study, is_wrong
from annotations.documents.volume_link import reference_to
from annotations.errors import Cancelled
from annotations.geometry.tool_library import shipped_tools
from annotations.volumes import fingerprint, open_volume

NEEDLE = shipped_tools()["needle"]
SPACING_UM = (500.0, 500.0, 500.0)
PEOPLE = ("anna", "ben")
WriteVolume = Callable[..., Path]
Keep = Callable[..., Path]


@pytest.fixture
def folder(tmp_path: Path, write_volume: WriteVolume) -> Path:
    """A study of two volumes and two annotators, in which nothing is begun."""
    folder = tmp_path / "study"
    for number in (1, 2):
        write_volume(folder / "volumes" / f"v{number}.npy", number)
    create_study(study_of_volumes(volumes_at([folder]), "needle", folder, annotators=PEOPLE), folder, NEEDLE)
    return folder


@pytest.fixture
def keep(folder: Path) -> Keep:
    """Write somebody's finished annotation of a volume, changed in some fields."""

    def keep(
        person: str, volume_id: str = "v1", method: Method = "keypoints", repeat: int = 0, **fields: Any
    ) -> Path:
        path = annotation_path(folder, person, volume_id, method, repeat)
        with open_volume(folder / "volumes" / f"{volume_id}.npy") as volume:
            reference = reference_to(volume, SPACING_UM, path, fingerprint(volume))
        document = new_annotation(reference, NEEDLE, person, "keypoints", ships=True, repeat=repeat)
        document = place_keypoint(document, "tip", (200.0, 200.0, 200.0), "clicked")
        document = place_keypoint(document, "shaft", (2200.0, 200.0, 200.0), "clicked")
        save_annotation(changed(set_status(document, "done"), **fields), path, expected="")
        return path

    return keep


@pytest.fixture
def finished(folder: Path, keep: Keep) -> Path:
    """The same study, with everything done."""
    for person in PEOPLE:
        for volume_id in ("v1", "v2"):
            keep(person, volume_id)
    return folder


def found(folder: Path, **options: Any) -> list[tuple[str, str, str]]:
    """Return (path in the study, kind, problem) of all findings."""
    return [
        ("" if path is None else path.relative_to(folder).as_posix(), finding.kind, finding.problem)
        for path, finding in check_study(folder, [folder / "tools"], **options)
    ]


def only(folder: Path) -> tuple[str, str, str]:
    [one] = found(folder)
    return one


def change_rules(folder: Path, **rules: Any) -> None:
    save_study(with_rules(load_study(folder), **rules), folder)


def rewrite(path: Path, **fields: Any) -> None:
    """Change a document as a program that knows no better might."""
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def test_a_finished_study_has_no_findings(finished: Path) -> None:
    assert found(finished) == []


def test_what_is_not_begun_and_not_done_is_counted_per_annotator_and_method(folder: Path, keep: Keep) -> None:
    change_rules(folder, methods=("keypoints", "boxes"), assignments={"ben": ("keypoints",)})
    keep("ben", "v1", status="in_progress")
    assert found(folder) == [
        ("study.toml", "note", "only anna annotates by boxes: there is no deviation of one"),
        ("annotations/anna", "missing", "anna, by keypoints: of 2, 2 are not begun"),
        ("annotations/anna", "missing", "anna, by boxes: of 2, 2 are not begun"),
        ("annotations/ben", "missing", "ben, by keypoints: of 2, 1 is not begun and 1 is in progress"),
    ]


def test_repeats_are_to_be_done_as_well(finished: Path, keep: Keep) -> None:
    volumes = load_study(finished).volumes
    change_rules(finished, volumes=(changed(volumes[0], repeats=1), volumes[1]))
    keep("anna", "v1", repeat=1)
    assert only(finished) == (
        "annotations/ben",
        "missing",
        "ben, by keypoints: of 3, 1 is not begun",
    )


def test_a_volume_that_is_gone_is_said_once(finished: Path) -> None:
    (finished / "volumes" / "v1.npy").unlink()
    path, kind, problem = only(finished)
    assert (path, kind) == ("volumes/v1.npy", "volume")
    assert problem.startswith("v1: ")


def test_a_volume_that_cannot_be_read_is_said(finished: Path) -> None:
    (finished / "volumes" / "v2.npy").write_bytes(b"\x93NUMPY cut short")
    assert only(finished)[:2] == ("volumes/v2.npy", "volume")


def test_another_content_is_noticed_in_each_annotation(finished: Path, write_volume: WriteVolume) -> None:
    write_volume(finished / "volumes" / "v1.npy", 77)
    assert [(path, kind) for path, kind, _ in found(finished)] == [
        ("annotations/anna/v1.keypoints.json", "fingerprint"),
        ("annotations/ben/v1.keypoints.json", "fingerprint"),
    ]


def test_annotators_who_worked_on_different_contents_are_told_apart(finished: Path, keep: Keep) -> None:
    path = annotation_path(finished, "ben", "v1", "keypoints")
    document, _ = load_annotation(path)
    path.unlink()
    keep("ben", volume=changed(document.volume, fingerprint="f" * 64, spacing_um=(1.0, 2.0, 3.0)))
    (finished / "volumes" / "v1.npy").unlink()
    problems = [problem for where, _, problem in found(finished) if where == "study.toml"]
    assert len(problems) == 2
    assert problems[0].startswith("v1 has not one fingerprint in all annotations: ")
    assert "ffffffff… in the files of ben" in problems[0]
    assert "(1.0, 2.0, 3.0) in the files of ben" in problems[1]


def test_one_volume_under_two_ids_is_noticed(finished: Path, write_volume: WriteVolume) -> None:
    write_volume(finished / "volumes" / "v2.npy", 1)
    assert found(finished)[0] == (
        "study.toml",
        "duplicate",
        "v1 and v2 are the same volume (equal fingerprints)",
    )


def test_a_file_with_several_arrays_and_no_dataset_is_noticed(folder: Path) -> None:
    np.savez(folder / "volumes" / "v3.npz", a=np.zeros((2, 3, 4)), b=np.ones((2, 3, 4)))
    study = load_study(folder)
    change_rules(folder, volumes=(*study.volumes, changed(study.volumes[0], id="v3", path="volumes/v3.npz")))
    [(path, _, problem)] = [each for each in found(folder) if each[1] == "volume"]
    assert path == "volumes/v3.npz"
    assert problem.endswith("and study.toml names no dataset")


def test_a_spacing_that_the_volume_states_otherwise_is_noticed(finished: Path) -> None:
    (finished / "volumes" / "v1.npy.volume.toml").write_text(
        'schema = "oct-volume/1"\nspacing_um = [500.0, 500.0, 500.0]\ndepth_axis = 2\n'
    )
    volumes = load_study(finished).volumes
    change_rules(finished, volumes=(changed(volumes[0], spacing_um=(1.0, 2.0, 3.0)), volumes[1]))
    assert only(finished)[:2] == ("volumes/v1.npy", "spacing")


def test_a_moved_volume_is_found_by_the_study_and_said_in_the_annotation(finished: Path) -> None:
    (finished / "moved").mkdir()
    (finished / "volumes" / "v1.npy").rename(finished / "moved" / "v1.npy")
    volumes = load_study(finished).volumes
    change_rules(finished, volumes=(changed(volumes[0], path="moved/v1.npy"), volumes[1]))
    for path, kind, problem in found(finished):
        assert path.endswith("v1.keypoints.json")
        assert kind == "name"
        assert str(finished / "moved" / "v1.npy") in problem


@pytest.mark.parametrize(
    ("person", "options", "problem"),
    [
        ("anna", {"volume_id": "v2", "repeat": 1}, "the study has no pass 2 over v2"),
        ("anna", {"method": "boxes"}, "the study is not annotated by boxes"),
        ("consensus", {"repeat": 1}, "the study has no pass 2 over v1"),
    ],
)
def test_what_the_study_does_not_ask_for_is_orphaned(
    finished: Path, keep: Keep, person: str, options: dict[str, Any], problem: str
) -> None:
    path = keep(person, **options)
    assert (path.relative_to(finished).as_posix(), "orphan", problem) in found(finished)


def test_a_method_of_somebody_elses_is_orphaned(finished: Path) -> None:
    change_rules(finished, methods=("keypoints", "boxes"), assignments={"ben": ("boxes",)})
    problems = [problem for _, kind, problem in found(finished) if kind == "orphan"]
    assert problems == ["ben is not to annotate by keypoints"] * 2


def test_annotations_of_a_volume_that_left_the_study_are_orphaned(finished: Path) -> None:
    change_rules(finished, volumes=load_study(finished).volumes[:1])
    assert [(path, kind) for path, kind, _ in found(finished)] == [
        ("annotations/anna/v2.keypoints.json", "orphan"),
        ("annotations/ben/v2.keypoints.json", "orphan"),
    ]


def test_a_stranger_is_said_once(finished: Path, keep: Keep) -> None:
    keep("Anna2", "v1")
    keep("Anna2", "v2")
    assert only(finished) == (
        "annotations/Anna2",
        "orphan",
        "2 annotations of 'Anna2', who is not among the study's annotators",
    )


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"annotator": "ben"}, "its annotator is 'ben', but by its name and folder 'anna'"),
        ({"repeat": 2}, "its pass is 3, but by its name and folder 1"),
    ],
)
def test_a_file_that_says_something_else_than_its_name_is_found(
    finished: Path, fields: dict[str, Any], problem: str
) -> None:
    path = annotation_path(finished, "anna", "v1", "keypoints")
    rewrite(path, **fields)
    assert only(finished) == ("annotations/anna/v1.keypoints.json", "name", problem)


def test_a_copy_under_another_volumes_name_is_found(finished: Path) -> None:
    first, second = (annotation_path(finished, "anna", each, "keypoints") for each in ("v1", "v2"))
    second.write_bytes(first.read_bytes())
    kinds = [kind for path, kind, _ in found(finished) if path.endswith("anna/v2.keypoints.json")]
    assert kinds == ["name", "fingerprint"]


def test_a_file_that_cannot_be_read_is_not_counted_as_missing(finished: Path) -> None:
    annotation_path(finished, "anna", "v1", "keypoints").write_text("{")
    assert only(finished)[:2] == ("annotations/anna/v1.keypoints.json", "file")


def test_another_tool_than_the_studys_is_found(finished: Path) -> None:
    change_rules(finished, tool="magnetic-forceps")
    problems = {(kind, problem) for _, kind, problem in found(finished)}
    assert problems == {("tool", "it was made with the tool 'needle', but the study's is 'magnetic-forceps'")}


def test_a_tool_that_is_nowhere_is_found(finished: Path) -> None:
    change_rules(finished, tool="lost")
    path, kind, problem = found(finished)[0]
    assert (path, kind) == ("study.toml", "tool")
    assert "there is no tool specification 'lost'" in problem


def test_a_tool_that_is_nowhere_is_found_beside_a_volume_that_is_gone(finished: Path) -> None:
    change_rules(finished, tool="lost")
    (finished / "volumes" / "v1.npy").unlink()
    kinds = [kind for _, kind, _ in found(finished)]
    assert kinds[0] == "tool"
    assert "volume" in kinds
    assert any("made with the tool 'needle'" in problem for _, _, problem in found(finished))


def test_documents_of_another_tool_are_named_also_where_theirs_is_nowhere(finished: Path) -> None:
    rewrite(annotation_path(finished, "anna", "v1", "keypoints"), tool="lost")
    problems = [problem for path, _, problem in found(finished) if path.startswith("annotations/anna/")]
    assert any("there is no tool specification 'lost'" in problem for problem in problems)
    assert any("the study's is 'needle'" in problem for problem in problems)


def test_paths_are_told_without_ways_up(finished: Path) -> None:
    volumes = load_study(finished).volumes
    (finished.parent / "new").mkdir()
    (finished / "volumes" / "v1.npy").rename(finished.parent / "new" / "v1.npy")
    change_rules(finished, volumes=(changed(volumes[0], path="../new/v1.npy"), *volumes[1:]))
    (finished.parent / "new" / "v1.npy").unlink()
    told = [(path, finding.problem) for path, finding in check_study(finished)]
    assert finished.parent / "new" / "v1.npy" in [path for path, _ in told]
    assert not [each for each in told if ".." in f"{each}"]


def test_what_check_file_says_of_a_document_is_said(finished: Path, keep: Keep) -> None:
    path = annotation_path(finished, "anna", "v1", "keypoints")
    document, identity = load_annotation(path)
    save_annotation(changed(document, keypoints=document.keypoints[:1]), path, expected=identity)
    assert only(finished) == (
        "annotations/anna/v1.keypoints.json",
        "keypoint",
        "it is marked as done, but shaft are unplaced",
    )


def test_consensus_whose_sources_changed_or_went_is_stale(finished: Path, keep: Keep) -> None:
    sources = [annotation_path(finished, person, "v1", "keypoints") for person in PEOPLE]
    contributions = tuple(
        Contribution(
            path=f"../{path.parent.name}/{path.name}",
            annotator=path.parent.name,
            sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        )
        for path in sources
    )
    keep("consensus", consensus_of=contributions)
    assert found(finished) == []
    begun = (changed(contributions[0], predicted_from="Lean"), *contributions[1:])
    keep("consensus", "v2", consensus_of=begun)
    assert only(finished) == (
        "annotations/consensus/v2.keypoints.json",
        "note",
        "it was made from anna's annotation, which was begun from a prediction of Lean",
    )
    annotation_path(finished, "consensus", "v2", "keypoints").unlink()
    document, identity = load_annotation(sources[0])
    save_annotation(
        place_keypoint(document, "tip", (0.0, 0.0, 0.0), "dragged"), sources[0], expected=identity
    )
    sources[1].unlink()
    stale = [(path, problem) for path, kind, problem in found(finished) if kind == "consensus"]
    assert [path for path, _ in stale] == ["annotations/consensus/v1.keypoints.json"] * 2
    assert "anna's annotation, from which it was made, has changed since" in stale[0][1]
    assert "ben's annotation, from which it was made, is not to be read any more" in stale[1][1]


def test_locks_of_the_living_are_notes_and_of_the_dead_findings(finished: Path) -> None:
    path = annotation_path(finished, "anna", "v1", "keypoints")
    lock = DocumentLock.acquire(path, "anna")
    # The checker's own window is no news to whoever sits before it.
    assert found(finished) == []
    lock_file = path.with_name(f"{path.name}.lock")
    fields = json.loads(lock_file.read_text()) | {"token": "another window's"}
    other = psutil.Process(os.getppid())
    started = other.create_time() - (psutil.boot_time() if sys.platform == "linux" else 0.0)
    lock_file.write_text(json.dumps(fields | {"process_id": other.pid, "process_started": started}))
    assert only(finished)[:2] == ("annotations/anna/v1.keypoints.json.lock", "note")
    # No process has a number as high.
    lock_file.write_text(json.dumps(fields | {"process_id": 2**30}))
    _, kind, problem = only(finished)
    assert kind == "lock"
    assert "has ended without giving it up" in problem
    lock_file.write_text(json.dumps(fields | {"host": "elsewhere"}))
    long_ago = time.time() - 600
    os.utime(lock_file, (long_ago, long_ago))
    _, kind, problem = only(finished)
    assert kind == "lock"
    assert "has not renewed it for 10 minutes" in problem
    lock_file.unlink()
    lock.release()


def test_stray_files_are_named_and_those_of_the_system_are_not(finished: Path) -> None:
    folder = finished / "annotations"
    strays = [
        folder / "notes.txt",
        folder / "anna" / "v1.json",
        folder / "anna" / "old",
        folder / "anna/a.bak",
    ]
    strays[2].mkdir()
    for path in (
        strays[0],
        strays[1],
        strays[3],
        folder / "anna" / ".DS_Store",
        folder / "ben" / "Thumbs.db",
    ):
        path.write_text("")
    assert {(path, kind) for path, kind, _ in found(finished)} == {
        (path.relative_to(finished).as_posix(), "stray") for path in strays
    }


def test_a_backup_without_its_annotation_is_what_is_left_of_it(finished: Path) -> None:
    path = annotation_path(finished, "anna", "v1", "keypoints")
    path.rename(path.with_name(f"{path.name}.bak"))
    assert [each for each in found(finished) if "bak" in each[0]] == [
        (
            "annotations/anna/v1.keypoints.json.bak",
            "missing",
            "v1.keypoints.json is gone, and this backup is what is left of it",
        )
    ]


def test_what_a_save_left_is_named_once_no_save_can_be_at_it(finished: Path) -> None:
    left = [finished / ".abc.partial", finished / "annotations" / "anna" / ".def.partial"]
    for path in left:
        path.write_text("")
    assert found(finished) == []
    for path in left:
        os.utime(path, (0, 0))
    assert [(path, kind) for path, kind, _ in found(finished)] == [
        (".abc.partial", "stray"),
        ("annotations/anna/.def.partial", "stray"),
    ]


def test_what_is_good_to_know_is_a_note(finished: Path, keep: Keep) -> None:
    moment = datetime(2026, 11, 22, 5, 0, tzinfo=UTC)
    path = annotation_path(finished, "anna", "v1", "keypoints")
    path.unlink()
    keep(
        "anna",
        flag="a second needle?",
        reopened=moment,
        viewings=(
            Viewing(moment=moment, shown="annotations", status="in_progress"),
            Viewing(moment=moment, shown="predictions", status="done"),
        ),
    )
    findings = check_study(finished)
    assert [finding.problem for _, finding in findings] == [
        "it is flagged: a second needle?",
        "its annotator was shown other people's annotations before it was done",
        "it was changed after the others' work could be seen, first at 2026-11-22 05:00 UTC",
    ]
    assert not any(is_wrong(finding) for _, finding in findings)
    assert list(by_path(findings)) == [path]


@pytest.mark.parametrize(
    ("rules", "problem"),
    [
        ({"annotators": ()}, "it names no annotators"),
        ({"volumes": ()}, "it has no volumes"),
        (
            {"methods": ("keypoints", "boxes"), "assignments": dict.fromkeys(PEOPLE, ("keypoints",))},
            "nobody is assigned to annotate by boxes",
        ),
    ],
)
def test_rules_by_which_nothing_comes_about_are_found(
    folder: Path, rules: dict[str, Any], problem: str
) -> None:
    change_rules(folder, **rules)
    assert ("study.toml", "study", problem) in found(folder)


def test_each_volume_is_read_once_however_many_documents_name_it(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = []

    def counted(volume: Any) -> str:
        read.append(volume.path.name)
        return fingerprint(volume)

    monkeypatch.setattr(seen_volumes, "fingerprint", counted)
    assert found(finished) == []
    assert read == ["v1.npy", "v2.npy"]


def test_a_judge_says_more_of_each_document(finished: Path) -> None:
    def judge(document: Annotation) -> list[Finding]:
        return [Finding("plausibility", document.annotator)] if document.annotator == "ben" else []

    assert [each[2] for each in found(finished, judge=judge)] == ["ben", "ben"]


def test_progress_goes_from_nothing_to_all_and_work_can_be_cancelled(finished: Path) -> None:
    shares: list[float] = []
    found(finished, progress=shares.append)
    assert shares == sorted(shares)
    assert (shares[0], shares[-1], len(shares)) == (0.0, 1.0, 7)
    with pytest.raises(Cancelled):
        found(finished, cancelled=lambda: True)


def test_checking_changes_nothing(finished: Path) -> None:
    before = {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()}
    (finished / STUDY_FILE).chmod(0o444)
    found(finished)
    assert {path: path.read_bytes() for path in finished.rglob("*") if path.is_file()} == before
