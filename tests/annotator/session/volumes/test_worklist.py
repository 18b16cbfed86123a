"""What a path offers: a study, an annotation, a folder of volumes, a volume, or a clear error."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.record import Method, changed
from annotations.documents.study import Study, StudyVolume, load_study, save_study
from annotations.errors import UserError
from annotator.session import Session
from annotator.session.volumes.worklist import read_worklist


def make_study(folder: Path, volume_path: Path) -> Path:
    """A study of two volumes, in an order that is not that of their names."""
    (folder / "volumes").mkdir(parents=True)
    for name in ("b.npy", "a.npy"):
        shutil.copy(volume_path, folder / "volumes" / name)
    volumes = (
        StudyVolume(id="second", path="volumes/b.npy", spacing_um=(1.0, 2.0, 3.0)),
        StudyVolume(id="first", path="volumes/a.npy"),
    )
    save_study(Study(title="Pilot", tool="needle", annotators=("anna",), volumes=volumes), folder)
    return folder


@pytest.mark.parametrize("name", ["", "study.toml"])
def test_a_study_keeps_its_own_order_tool_and_paths(tmp_path: Path, volume_path: Path, name: str) -> None:
    folder = make_study(tmp_path / "study", volume_path)
    worklist = read_worklist(folder / name, "anna")
    assert worklist.title == "Pilot"
    assert worklist.tool_name == "needle"
    assert [item.label for item in worklist.items] == ["second", "first"]
    assert worklist.items[0].volume_path == folder / "volumes" / "b.npy"
    assert worklist.items[0].annotation_path == folder / "annotations" / "anna" / "second.keypoints.json"
    assert worklist.items[0].spacing_um == (1.0, 2.0, 3.0)


def test_a_volume_comes_with_its_siblings_and_is_first(volume_path: Path) -> None:
    for name in ("v000.npy", "v010.npy", "v002.npy"):
        shutil.copy(volume_path, volume_path.parent / name)
    (volume_path.parent / "notes.txt").write_text("not a volume")
    worklist = read_worklist(volume_path, "anna")
    assert [item.label for item in worklist.items] == ["v000.npy", "v001.npy", "v002.npy", "v010.npy"]
    assert worklist.items[worklist.first].volume_path == volume_path


def test_volumes_that_differ_in_their_suffix_alone_have_their_own_annotations(volume_path: Path) -> None:
    np.savez(volume_path.with_suffix(".npz"), np.load(volume_path))
    items = read_worklist(volume_path.parent, "anna").items
    assert len({item.annotation_path for item in items}) == len(items) == 2


def test_an_annotation_leads_to_its_volume(session: Session, volume_path: Path) -> None:
    session.place((1.0, 2.0, 3.0))
    session.set_status("done")
    assert session.annotation_path is not None
    (item,) = read_worklist(session.annotation_path, "ben").items
    assert item.volume_path == volume_path
    assert item.annotation_path == session.annotation_path
    assert item.status == "done"
    assert read_worklist(volume_path, "anna").items[0].status == "done"


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda folder: folder / "absent.npy", "no such file"),
        (lambda folder: folder, "no volume"),
    ],
)
def test_what_offers_nothing_is_named(tmp_path: Path, make: object, says: str) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    with pytest.raises(UserError, match=says):
        read_worklist(make(folder), "anna")  # type: ignore[operator]


def study_of(folder: Path, volume_path: Path, methods: tuple[Method, ...]) -> Path:
    make_study(folder, volume_path)
    save_study(changed(load_study(folder), methods=methods), folder)
    return folder


@pytest.mark.parametrize(
    ("methods", "wanted", "used"),
    [
        (("keypoints",), "boxes", "keypoints"),
        (("boxes",), "keypoints", "boxes"),
        (("keypoints", "boxes"), "boxes", "boxes"),
        (("boxes", "keypoints"), "keypoints", "keypoints"),
    ],
)
def test_a_study_says_by_which_methods_it_is_annotated(
    tmp_path: Path, volume_path: Path, methods: tuple[Method, ...], wanted: Method, used: Method
) -> None:
    folder = study_of(tmp_path / "study", volume_path, methods)
    worklist = read_worklist(folder, "anna", wanted)
    assert worklist.method == used
    assert worklist.methods == methods
    assert worklist.items[0].annotation_path.name == f"second.{used}.json"


def test_each_method_has_files_and_a_status_of_its_own(session: Session, volume_path: Path) -> None:
    session.place((1.0, 2.0, 3.0))
    session.set_status("done")
    for path in (volume_path, volume_path.parent):
        keypoints = read_worklist(path, "anna")
        boxes = read_worklist(path, "anna", "boxes")
        assert (keypoints.items[0].status, boxes.items[0].status) == ("done", "new")
        assert boxes.items[0].annotation_path.name == "v001.npy.boxes.json"
        assert keypoints.with_method("boxes") == boxes
        assert boxes.with_method("keypoints") == keypoints
        assert keypoints.with_method("keypoints") is keypoints


def test_a_file_that_is_not_named_after_its_method_is_found_again(session: Session, tmp_path: Path) -> None:
    session.place((1.0, 2.0, 3.0))
    mine = tmp_path / "mine.json"
    assert session.save_as(mine)
    worklist = read_worklist(mine, "anna", "boxes")
    assert worklist.method == "keypoints", "the file says it"
    boxes = worklist.with_method("boxes")
    assert boxes.items[0].annotation_path == tmp_path / "mine.boxes.json"
    assert boxes.items[0].status == "new"
    again = boxes.with_method("keypoints")
    assert again.items[0].annotation_path == mine
    assert again.items[0].status == "in_progress"
    # One that is named after it comes first, and what is no annotation by it does not count.
    shutil.copy(mine, tmp_path / "mine.keypoints.json")
    assert boxes.with_method("keypoints").items[0].annotation_path == tmp_path / "mine.keypoints.json"
    (tmp_path / "mine.keypoints.json").unlink()
    mine.write_text("{")
    assert boxes.with_method("keypoints").items[0].annotation_path == tmp_path / "mine.keypoints.json"
