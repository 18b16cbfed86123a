"""Pictures of a checkpoint's worst volumes."""

from dataclasses import replace
from pathlib import Path

import pytest

from annotations.documents.edits import place_keypoint
from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path
from annotations.errors import Cancelled
from annotations.prediction.report.exporting import export_errors
from annotations.prediction.report.material import ReportMaterial
from annotations.prediction.report.thumbnails import thumbnails


def drawn(material: ReportMaterial, study: Path) -> list[str]:
    [photos] = thumbnails(material, study, lambda _share: None, lambda: False)
    assert all(photo.png.startswith(b"\x89PNG") for photo in photos)
    return [photo.caption for photo in photos]


def test_the_worst_comes_first_with_its_volume(study: Path, of_study: ReportMaterial) -> None:
    shares: list[float] = []

    [photos] = thumbnails(of_study, study, shares.append, lambda: False)

    assert len(photos) == 3
    assert "volume v002, against truth" in photos[0].caption
    assert "keypoint k3, which is furthest off (2,00" in photos[0].caption
    assert "the brightest voxels" in photos[0].caption
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_without_its_volume_the_keypoints_are_drawn_alone(study: Path, of_study: ReportMaterial) -> None:
    (study / "volumes" / "v002.npy").unlink()

    assert "not at hand" in drawn(of_study, study)[0]


def test_an_annotation_that_was_begun_from_a_prediction_is_said_to_be(
    study: Path, of_study: ReportMaterial
) -> None:
    [checkpoint] = of_study.checkpoints
    rows = [
        changed(row, begun_from=("Lean", "V2V")) if row.volume == "v002" else row
        for row in checkpoint.table.rows
    ]
    begun = replace(checkpoint, table=changed(checkpoint.table, rows=tuple(rows)))

    first, *others = drawn(replace(of_study, checkpoints=(begun,)), study)

    assert "begun from a prediction of Lean and V2V: it counts in no figure" in first
    assert not any("begun" in caption for caption in others)


def test_an_annotation_that_was_changed_since_is_not_drawn(study: Path, of_study: ReportMaterial) -> None:
    path = annotation_path(study, "truth", "v002", "keypoints")
    truth, identity = load_annotation(path)
    x, y, z = truth.positions_um["k0"]
    save_annotation(place_keypoint(truth, "k0", (x + 1.0, y, z), "clicked"), path, expected=identity)

    assert not any("volume v002" in caption for caption in drawn(of_study, study))


def test_what_was_not_predicted_is_not_drawn(study: Path, of_study: ReportMaterial) -> None:
    [checkpoint] = of_study.checkpoints
    fewer = {name: each for name, each in checkpoint.predictions.items() if name != "v002"}
    material = replace(of_study, checkpoints=(replace(checkpoint, predictions=fewer),))

    assert len(drawn(material, study)) == 2


def test_it_can_be_cancelled(study: Path, of_study: ReportMaterial) -> None:
    with pytest.raises(Cancelled):
        thumbnails(of_study, study, lambda _share: None, lambda: True)


def test_they_stand_in_the_report(study: Path, of_study: ReportMaterial, tmp_path: Path) -> None:
    export_errors(of_study, study, {"html": tmp_path / "r.html"})

    page = (tmp_path / "r.html").read_text()
    assert page.count("data:image/png") == 3
    assert page.index("volume v002, against") < page.index("volume v001, against")
