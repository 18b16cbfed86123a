import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.annotation import Annotation, VolumeReference
from annotations.documents.record import changed
from annotations.documents.volume_link import compare, reference_to, referenced_path, relative_path
from annotations.volumes import fingerprint, open_volume, write_sidecar

SPACING_UM = (15.9, 13.5, 9.4)

Write = Callable[..., Path]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    return tmp_path / "study"


@pytest.fixture
def annotation_path(study: Path) -> Path:
    return study / "annotations" / "anna" / "v001.keypoints.json"


@pytest.fixture
def volume_path(study: Path, write_volume: Write) -> Path:
    return write_volume(study / "volumes" / "v001.npy")


@pytest.fixture
def reference(volume_path: Path, annotation_path: Path) -> VolumeReference:
    with open_volume(volume_path) as volume:
        return reference_to(volume, SPACING_UM, annotation_path, fingerprint(volume))


def findings(reference: VolumeReference, path: Path) -> list[str]:
    with open_volume(path, dataset=reference.dataset) as volume:
        return [finding.kind for finding in compare(reference, volume, fingerprint(volume))]


def test_a_reference_describes_the_volume(reference: VolumeReference) -> None:
    assert reference.path == "../../volumes/v001.npy"
    assert reference.dataset is None
    assert reference.shape == (6, 5, 4)
    assert reference.dtype == "uint8"
    assert reference.spacing_um == SPACING_UM


def test_the_volume_of_a_reference_is_that_volume(
    reference: VolumeReference, volume_path: Path, annotation_path: Path
) -> None:
    assert referenced_path(reference, annotation_path) == volume_path
    assert findings(reference, volume_path) == []


def test_a_study_that_moved_as_a_whole_finds_its_volumes(
    study: Path, reference: VolumeReference, annotation_path: Path
) -> None:
    moved = study.parent / "far" / "away" / "moved study"
    shutil.copytree(study, moved)
    shutil.rmtree(study)
    found = referenced_path(reference, moved / annotation_path.relative_to(study))
    assert found == moved / "volumes" / "v001.npy"
    assert findings(reference, found) == []


def test_relative_paths_are_taken_from_the_documents_folder(
    study: Path, reference: VolumeReference, annotation_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    annotation_path.parent.mkdir(parents=True)
    monkeypatch.chdir(annotation_path.parent)
    assert referenced_path(reference, Path(annotation_path.name)) == study / "volumes" / "v001.npy"
    assert relative_path(study / "volumes" / "v001.npy", Path(annotation_path.name)) == reference.path


def test_a_volume_beside_its_document_is_named_by_its_name(study: Path) -> None:
    assert relative_path(study / "größe 1.npy", study / "v001.json") == "größe 1.npy"


def test_an_absolute_path_stays_one(reference: VolumeReference, annotation_path: Path) -> None:
    elsewhere = Path(Path.cwd().anchor) / "data" / "v001.npy"
    absolute = changed(reference, path=elsewhere.as_posix())
    assert referenced_path(absolute, annotation_path) == elsewhere


def test_another_content_is_found(reference: VolumeReference, study: Path, write_volume: Write) -> None:
    assert findings(reference, write_volume(study / "other.npy", seed=2)) == ["fingerprint"]


def test_another_shape_is_found(reference: VolumeReference, study: Path, write_volume: Write) -> None:
    path = write_volume(study / "other.npy", shape=(6, 4, 5))
    with open_volume(path) as volume:
        (finding,) = compare(reference, volume, fingerprint(volume))
    assert finding.kind == "shape"
    assert "(6, 4, 5)" in finding.problem
    assert "(6, 5, 4)" in finding.problem


def test_another_type_is_found(reference: VolumeReference, study: Path, write_volume: Write) -> None:
    assert findings(reference, write_volume(study / "other.npy", dtype="uint16")) == ["dtype"]
    both = write_volume(study / "both.npy", dtype="float32", shape=(2, 2, 2))
    assert findings(reference, both) == ["shape", "dtype"]


def test_another_spacing_is_found_where_the_volume_states_one(
    reference: VolumeReference, volume_path: Path
) -> None:
    write_sidecar(volume_path, (15.9, 13.5, 9.4), 2)
    assert findings(reference, volume_path) == []
    write_sidecar(volume_path, (15.9, 13.5, 9.4 * (1 + 1e-9)), 2)
    assert findings(reference, volume_path) == []
    write_sidecar(volume_path, (15.9, 13.5, 9.4 * (1 + 1e-5)), 2)
    assert findings(reference, volume_path) == ["spacing"]


def test_a_member_of_a_file_is_named(
    study: Path, volume_path: Path, annotation_path: Path, document: Annotation
) -> None:
    path = study / "two.npz"
    voxels = np.load(volume_path)
    np.savez(path, first=voxels, second=voxels[::-1])
    with open_volume(path, dataset="second") as volume:
        reference = reference_to(volume, SPACING_UM, annotation_path, fingerprint(volume))
    assert reference.dataset == "second"
    assert findings(reference, path) == []
    assert findings(changed(reference, dataset="first"), path) == ["fingerprint"]
