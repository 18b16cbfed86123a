from collections.abc import Callable
from pathlib import Path

import pytest

from annotations.agreement.comparison import agreement_of
from annotations.agreement.report.scenes import read_scene
from annotations.agreement.report.thumbnails import MOST, thumbnails
from annotations.agreement.results import Agreement
from annotations.documents.edits import place_keypoint, set_status
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path
from annotations.errors import Cancelled
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import write_study


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two synthetic volumes; ben has k3 of the second 2 mm off."""
    folder = tmp_path / "study"
    study = write_study(folder, shipped_tools()["magnetic-forceps"], count=2, seed=3, shape=(22, 39, 23))
    for volume in study.volumes:
        truth, _ = load_annotation(annotation_path(folder, "truth", volume.id, "keypoints"))
        for name in ("anna", "ben"):
            document = changed(truth, annotator=name, status="in_progress")
            for number, (keypoint, (x, y, z)) in enumerate(truth.positions_um.items()):
                aside_um = 15.0 * number * (name == "ben")
                off_um = 2000.0 if (name, volume.id, keypoint) == ("ben", "v002", "k3") else 0.0
                position_um = (x + aside_um**1.1 + off_um, y + aside_um, z - aside_um)
                document = place_keypoint(document, keypoint, position_um, "clicked")
            path = annotation_path(folder, name, volume.id, "keypoints")
            save_annotation(set_status(document, "done"), path, expected="")
    return folder


@pytest.fixture
def compared(study: Path) -> Agreement:
    return agreement_of(study, resamples=100)


Progress = Callable[[float], None]


def test_the_worst_comes_first_with_its_volume(study: Path, compared: Agreement) -> None:
    shares: list[float] = []

    photos = thumbnails(compared, "keypoints", study, shares.append, lambda: False)

    assert 1 <= len(photos) <= MOST
    assert "volume v002" in photos[0].caption
    assert "keypoint k3" in photos[0].caption
    assert "the brightest voxels" in photos[0].caption
    assert photos[0].png.startswith(b"\x89PNG")
    assert shares[-1] == 1.0


def test_the_scene_holds_what_each_placed(study: Path, compared: Agreement) -> None:
    volume = next(each for each in compared.methods["keypoints"].volumes if each.volume == "v002")

    scene = read_scene(compared, "keypoints", volume, study)

    assert scene is not None
    assert list(scene.placed) == ["anna", "ben"]
    assert scene.worst == "k3"
    assert scene.placed["ben"]["k3"][0] - scene.placed["anna"]["k3"][0] == pytest.approx(2000, rel=0.1)
    assert scene.level is not None


def test_without_its_volume_the_keypoints_are_drawn_alone(study: Path, compared: Agreement) -> None:
    (study / "volumes" / "v002.npy").unlink()

    photos = thumbnails(compared, "keypoints", study, lambda _share: None, lambda: False)

    assert "not at hand" in photos[0].caption
    assert photos[0].png.startswith(b"\x89PNG")


def test_an_annotation_that_changed_since_is_not_drawn(study: Path, compared: Agreement) -> None:
    for name in ("anna", "ben"):
        path = annotation_path(study, name, "v002", "keypoints")
        path.write_bytes(path.read_bytes() + b" ")
    annotation_path(study, "ben", "v001", "keypoints").unlink()

    photos = thumbnails(compared, "keypoints", study, lambda _share: None, lambda: False)

    assert not any("volume v002" in photo.caption for photo in photos)


def test_it_can_be_cancelled(study: Path, compared: Agreement) -> None:
    with pytest.raises(Cancelled):
        thumbnails(compared, "keypoints", study, lambda _share: None, lambda: True)
