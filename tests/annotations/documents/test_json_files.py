"""Which files of a folder are looked through, and in which order."""

from pathlib import Path

from annotations.documents.json_files import json_files
from annotations.documents.study import annotation_files


def _make(folder: Path, *names: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_bytes(b"{}")


def test_json_files_come_in_the_order_of_their_names(tmp_path: Path) -> None:
    _make(tmp_path, "b.json", "a.json.bak", "c.json", "a.json", "notes.txt")
    assert list(json_files(tmp_path)) == [tmp_path / name for name in ("a.json", "b.json", "c.json")]
    assert list(json_files(tmp_path, "c")) == [tmp_path / "c.json"]


def test_what_cannot_be_listed_has_none(tmp_path: Path) -> None:
    _make(tmp_path, "a.json")
    assert list(json_files(tmp_path / "absent")) == []
    assert list(json_files(tmp_path / "a.json")) == []


def test_annotation_files_are_those_of_all_people_or_of_one_volume_alone(tmp_path: Path) -> None:
    names = ("v1.keypoints.json", "v1.keypoints.repeat1.json", "v10.keypoints.json", "v1.keypoints.json.lock")
    for person in ("ben", "anna"):
        _make(tmp_path / "annotations" / person, *names)
    _make(tmp_path / "annotations", "stray.json")

    found = annotation_files(tmp_path)
    assert [(path.parent.name, path.name) for path in found] == [
        (person, name) for person in ("anna", "ben") for name in names[:3]
    ]
    of_one = annotation_files(tmp_path, "v1")
    assert [(path.parent.name, path.name) for path in of_one] == [
        (person, name) for person in ("anna", "ben") for name in names[:2]
    ]
    assert annotation_files(tmp_path / "absent") == []
