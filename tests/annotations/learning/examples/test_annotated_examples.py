"""Examples from studies."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.files import load_annotation, save_annotation
from annotations.documents.record import changed
from annotations.documents.study import annotation_path, load_study, save_study
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool_library import load_tool
from annotations.learning.examples.annotated_examples import annotated_examples, find_studies
from annotations.learning.settings.training_settings import AnnotatedSettings
from annotations.synthesis import write_study
from annotations.volumes import open_volume
from annotations.volumes.sampling import sample_volume
from tests.annotations.learning.tiny_training import TOOL, tiny_settings

SAMPLING = tiny_settings().sampling
USUAL = AnnotatedSettings()
SHAPE = (20, 40, 40)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("studies") / "study"
    write_study(folder, TOOL, count=5, seed=3, shape=SHAPE, title="Five")
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "study"))


def test_volumes_are_sampled_and_keypoints_are_those_of_the_annotations(made: Path) -> None:
    found = annotated_examples(find_studies([made]), SAMPLING, USUAL)
    assert (len(found.training), len(found.validation), found.studies) == (4, 1, ("Five",))

    everything = [*found.training, *found.validation]
    for volume_id in ("v001", "v005"):
        annotation, _ = load_annotation(annotation_path(made, "truth", volume_id, "keypoints"))
        keypoints_um = np.array([keypoint.position_um for keypoint in annotation.keypoints])
        (example,) = (one for one in everything if np.array_equal(one.keypoints_um, keypoints_um))
        assert example.spacing_um == annotation.volume.spacing_um
        with open_volume(made / f"volumes/{volume_id}.npy") as volume:
            samples = sample_volume(volume, example.spacing_um, SAMPLING)
        np.testing.assert_array_equal(example.samples, samples.astype(np.float16))


def test_the_volumes_to_train_on_are_known_by_their_fingerprints(made: Path) -> None:
    found = annotated_examples(find_studies([made, made]), SAMPLING, USUAL)

    trained_on = {one.keypoints_um.tobytes() for one in found.training}
    expected = []
    for volume in load_study(made).volumes:
        annotation, _ = load_annotation(annotation_path(made, "truth", volume.id, "keypoints"))
        if np.array([each.position_um for each in annotation.keypoints]).tobytes() in trained_on:
            expected.append(annotation.volume.fingerprint)
    assert found.training_fingerprints == tuple(sorted(expected))
    assert 0 < len(expected) < 5


def test_volumes_that_the_network_learned_from_before_are_not_held_out(made: Path) -> None:
    studies = find_studies([made])
    usual = annotated_examples(studies, SAMPLING, USUAL)
    (held_out,) = usual.validation_fingerprints
    assert held_out not in usual.training_fingerprints

    seeds = [USUAL.model_copy(update={"split_seed": seed}) for seed in range(3)]
    learned = usual.training_fingerprints
    found = [annotated_examples(studies, SAMPLING, settings, learned=learned) for settings in seeds]

    assert {each.validation_fingerprints for each in found} == {(held_out,), ()}
    assert {len(each.training) + len(each.validation) for each in found} == {5}


def test_what_a_network_said_and_nobody_touched_is_no_label(folder: Path) -> None:
    path = annotation_path(folder, "truth", "v001", "keypoints")
    document, expected = load_annotation(path)
    first, *others = document.keypoints
    begun = changed(document, keypoints=(changed(first, source="predicted"), *others))
    save_annotation(begun, path, expected=expected)

    found = annotated_examples(find_studies([folder]), SAMPLING, USUAL)

    last_um = others[-1].position_um
    (example,) = (
        one
        for one in (*found.training, *found.validation)
        if one.keypoints_um[-1].tolist() == list(last_um or ())
    )
    assert np.isnan(example.keypoints_um[0]).all()
    assert np.isfinite(example.keypoints_um[1:]).all()


def test_the_split_is_by_the_seed_and_the_third_share_is_left_alone(made: Path) -> None:
    studies = find_studies([made])
    settings = AnnotatedSettings(shares=(0.4, 0.2, 0.4))
    found = annotated_examples(studies, SAMPLING, settings)
    assert (len(found.training), len(found.validation)) == (2, 1)
    again = annotated_examples(studies, SAMPLING, settings)
    assert again.fingerprint == found.fingerprint
    np.testing.assert_array_equal(again.validation[0].keypoints_um, found.validation[0].keypoints_um)
    fingerprints = {
        annotated_examples(studies, SAMPLING, settings.model_copy(update={"split_seed": seed})).fingerprint
        for seed in range(4)
    }
    assert len(fingerprints) > 1


def test_volumes_with_the_same_data_stay_together_across_studies(made: Path, folder: Path) -> None:
    found = annotated_examples(find_studies([made, folder]), SAMPLING, USUAL)
    held_out = {one.keypoints_um.tobytes() for one in found.validation}
    assert len(found.training) + len(found.validation) == 10
    assert len(held_out) == len(found.validation) / 2
    assert not held_out & {one.keypoints_um.tobytes() for one in found.training}


def test_a_volume_that_is_not_the_one_that_was_annotated_is_refused(folder: Path) -> None:
    path = folder / "volumes/v002.npy"
    np.save(path, np.zeros(SHAPE, dtype=np.uint8))
    with pytest.raises(UserError, match="is not the one that was annotated") as error:
        annotated_examples(find_studies([folder]), SAMPLING, USUAL)
    assert "v002.npy" in str(error.value)


def test_volumes_that_are_too_coarse_ask_for_another_sampling(made: Path) -> None:
    finer = SAMPLING.model_copy(update={"spacing_um": (622.0, 189.0, 131.6)})
    with pytest.raises(UserError, match="apart along axis") as error:
        annotated_examples(find_studies([made]), finer, USUAL)
    assert "[sampling]" in error.value.remedy


def test_a_study_without_annotations_is_refused_and_what_is_left_out_is_said(folder: Path) -> None:
    annotation_path(folder, "truth", "v001", "keypoints").unlink()
    said: list[str] = []
    found = annotated_examples(find_studies([folder]), SAMPLING, USUAL, said.append)
    assert len(found.training) + len(found.validation) == 4
    assert "1 without a finished annotation" in said[0]

    shutil.rmtree(folder / "annotations")
    with pytest.raises(UserError, match="no volume has an annotation by keypoints"):
        annotated_examples(find_studies([folder]), SAMPLING, USUAL)


def test_studies_of_different_tools_are_refused(made: Path, folder: Path) -> None:
    study = load_study(folder)
    save_study(study.model_copy(update={"tool": "needle"}), folder)
    with pytest.raises(UserError, match="'needle', not 'magnetic-forceps'"):
        find_studies([made, folder])
    with pytest.raises(UserError):
        load_tool(folder / "tools" / "absent.toml")


def test_it_can_be_stopped(made: Path) -> None:
    with pytest.raises(Cancelled):
        annotated_examples(find_studies([made]), SAMPLING, USUAL, stopped=lambda: True)
