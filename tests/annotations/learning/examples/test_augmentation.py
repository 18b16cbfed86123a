from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotations.geometry.tool_library import shipped_tools
from annotations.learning.examples.augmentation import (
    augmented,
    background,
    flipped,
    mixed_samples,
    random_block,
    shifted,
)
from annotations.learning.examples.examples import Example
from annotations.learning.settings.augmentation_settings import AugmentationSettings
from annotations.prediction.heatmaps import HeatmapConvention, axis_profiles
from annotations.synthesis.grid import Grid
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scanner import Scanner
from annotations.synthesis.scene import Scene, SceneSeed
from annotations.volumes.sampling import Sampling
from tests.annotations.geometry.mirrored_poses import mirrored_pose

SAMPLING = Sampling(
    shape=(8, 20, 12),
    spacing_um=(622.0, 189.0, 131.6),
    padding_before=(2, 6, 2),
    padding_after=(2, 6, 2),
)
SPACING_UM = (15.9, 13.5, 9.4)
EVERYWHERE = tuple(np.ndindex(SAMPLING.shape))


def marked(*index: tuple[int, int, int]) -> Example:
    """Return an example on a background of noise whose keypoints are its bright samples."""
    samples = np.random.default_rng(1).integers(10, 30, SAMPLING.shape).astype(np.float16)
    for place, at in enumerate(index):
        samples[at] = 200 + place
    in_input = np.array(index) + np.array(SAMPLING.padding_before)
    return Example(samples, SAMPLING.to_um(in_input, SPACING_UM), SPACING_UM)


def places(example: Example) -> np.ndarray:
    """Return the samples that the keypoints lie on, with their fractions, shape (K, 3)."""
    in_input = SAMPLING.to_index(example.keypoints_um, example.spacing_um)
    return np.asarray(in_input - np.array(SAMPLING.padding_before))


def assert_labels_are_where_the_marks_are(example: Example) -> None:
    for place, at in enumerate(places(example)):
        index = np.rint(at).astype(int)
        np.testing.assert_allclose(at, index, atol=1e-6)
        if ((index >= 0) & (index < SAMPLING.shape)).all():
            assert example.samples[tuple(index)] == 200 + place


marks = st.lists(st.sampled_from(EVERYWHERE), min_size=1, max_size=4, unique=True)


@given(index=marks, axis=st.integers(0, 2))
def test_a_flip_keeps_labels_on_what_they_label(index: list[tuple[int, int, int]], axis: int) -> None:
    found = flipped(marked(*index), SAMPLING, axis)
    assert_labels_are_where_the_marks_are(found)
    expected = np.array(index)
    expected[:, axis] = SAMPLING.shape[axis] - 1 - expected[:, axis]
    np.testing.assert_allclose(places(found), expected, atol=1e-6)
    again = flipped(found, SAMPLING, axis)
    np.testing.assert_array_equal(again.samples, marked(*index).samples)
    np.testing.assert_allclose(again.keypoints_um, marked(*index).keypoints_um, atol=1e-9)


@given(
    index=marks,
    steps=st.tuples(st.integers(-9, 9), st.integers(-22, 22), st.integers(-14, 14)),
    filling=st.sampled_from(["noise", "zeros", "mirror"]),
)
def test_a_shift_moves_samples_and_labels_alike(
    index: list[tuple[int, int, int]], steps: tuple[int, int, int], filling: str
) -> None:
    rng = np.random.default_rng(2)
    found = shifted(marked(*index), SAMPLING, steps, filling, rng)  # type: ignore[arg-type]
    assert found.samples.shape == SAMPLING.shape
    assert found.samples.dtype == np.float16
    assert_labels_are_where_the_marks_are(found)
    np.testing.assert_allclose(places(found), np.array(index) + steps, atol=1e-6)


def test_what_comes_in_at_the_border_is_what_was_asked_for() -> None:
    example = marked((3, 4, 5))
    rng = np.random.default_rng(3)
    zeros = shifted(example, SAMPLING, (0, 5, 0), "zeros", rng).samples
    assert (zeros[:, :5] == 0).all()
    np.testing.assert_array_equal(zeros[:, 5:], example.samples[:, :-5])
    noise = shifted(example, SAMPLING, (0, -5, 0), "noise", rng).samples
    assert (noise[:, -5:] >= 10).all()
    assert (noise[:, -5:] < 30).all()
    assert len(np.unique(noise[:, -5:])) == 20
    mirror = shifted(example, SAMPLING, (0, 0, 3), "mirror", rng).samples
    np.testing.assert_array_equal(mirror[..., 3:], example.samples[..., :-3])
    np.testing.assert_array_equal(mirror[..., :3], example.samples[..., 2::-1])


def test_keypoints_that_are_shifted_out_are_out_of_range() -> None:
    example, convention = marked((1, 10, 6), (6, 10, 6)), HeatmapConvention()
    shape = convention.heatmap_shape(SAMPLING.padded_shape)
    found = shifted(example, SAMPLING, (-5, 0, 0), "noise", np.random.default_rng(4))
    in_input = SAMPLING.to_index(found.keypoints_um, SPACING_UM)
    index = convention.to_heatmap(in_input, SAMPLING.padded_shape)
    assert axis_profiles(index, shape, convention).is_in_range.tolist() == [False, True]


def test_a_keypoint_of_which_nothing_is_known_stays_so() -> None:
    example = marked((3, 4, 5), (2, 2, 2))
    keypoints_um = example.keypoints_um.copy()
    keypoints_um[1] = np.nan
    settings = AugmentationSettings(shift_voxels=(2, 2, 2), flip_axes=(0, 1, 2))
    rng = np.random.default_rng(5)
    found = augmented(replace(example, keypoints_um=keypoints_um), SAMPLING, settings, rng)
    assert np.isnan(found.keypoints_um[1]).all()
    assert np.isfinite(found.keypoints_um[0]).all()


def test_by_default_half_of_the_examples_are_flipped_along_each_axis_across_the_light() -> None:
    example = marked((1, 4, 5))
    rng = np.random.default_rng(6)
    found = np.array(
        [places(augmented(example, SAMPLING, AugmentationSettings(), rng))[0] for _ in range(400)]
    )
    np.testing.assert_allclose(np.unique(found[:, 0]), (1, 6), atol=1e-6)
    np.testing.assert_allclose(np.unique(np.rint(found[:, 1])), (4, 15))
    np.testing.assert_allclose(found[:, 2], 5, atol=1e-6)
    np.testing.assert_allclose((found[:, :2] - (1, 4) > 0.5).mean(axis=0), 0.5, atol=0.1)


def test_the_depth_is_not_flipped_whichever_axis_it_is() -> None:
    sampling = SAMPLING.model_copy(update={"depth_axis": 0})
    example = marked((1, 4, 5))
    rng = np.random.default_rng(7)
    for _ in range(50):
        found = augmented(example, sampling, AugmentationSettings(), rng)
        assert found.keypoints_um[0, 0] == example.keypoints_um[0, 0]


@given(seed=st.integers(0, 2**32 - 1), index=marks)
def test_all_at_once_keeps_labels_and_depends_on_the_generator_alone(
    seed: int, index: list[tuple[int, int, int]]
) -> None:
    settings = AugmentationSettings(flip_axes=(0, 1, 2), shift_voxels=(2, 5, 3))
    example = marked(*index)
    before = example.samples.copy()
    found, again = (augmented(example, SAMPLING, settings, np.random.default_rng(seed)) for _ in range(2))
    assert_labels_are_where_the_marks_are(found)
    np.testing.assert_array_equal(found.samples, again.samples)
    np.testing.assert_array_equal(found.keypoints_um, again.keypoints_um)
    np.testing.assert_array_equal(example.samples, before)


@given(seed=st.integers(0, 2**32 - 1))
def test_a_block_has_edges_between_the_shares(seed: int) -> None:
    block = random_block((28, 139, 83), (0.1, 0.4), np.random.default_rng(seed))
    for place, count in zip(block, (28, 139, 83), strict=True):
        assert 0 <= place.start < place.stop <= count
        assert round(0.1 * count) <= place.stop - place.start <= round(0.4 * count)


@pytest.mark.parametrize("filling", ["noise", "zeros"])
def test_an_occlusion_hides_a_block_and_moves_no_label(filling: str) -> None:
    example = Example(np.full(SAMPLING.shape, 50, np.float16), np.array([[1.0, 2.0, 3.0]]), SPACING_UM)
    example.samples[:2] = 100
    settings = AugmentationSettings.model_validate(
        {
            "flip_axes": (),
            "occlusion_chance": 1.0,
            "occlusion_share": (0.5, 0.5),
            "occlusion_filling": filling,
        }
    )
    found = augmented(example, SAMPLING, settings, np.random.default_rng(8))
    np.testing.assert_array_equal(found.keypoints_um, example.keypoints_um)
    if filling == "zeros":
        assert (found.samples == 0).sum() == 4 * 10 * 6
    else:
        # The brighter structure is hidden by the background.
        assert set(np.unique(found.samples)) == {50, 100}
        assert (found.samples == 50).sum() > (example.samples == 50).sum()


def test_occlusions_have_their_chance() -> None:
    example = marked((1, 1, 1))
    settings = AugmentationSettings(flip_axes=(), occlusion_chance=0.3, occlusion_filling="zeros")
    rng = np.random.default_rng(9)
    hidden = [(augmented(example, SAMPLING, settings, rng).samples == 0).any() for _ in range(400)]
    assert np.mean(hidden) == pytest.approx(0.3, abs=0.08)


def test_noise_is_that_of_the_background_and_not_of_the_tool_or_of_what_is_empty() -> None:
    rng = np.random.default_rng(10)
    samples = rng.normal(60, 6, (28, 139, 83)).astype(np.float16)
    samples[5:15, 40:90, 20:50] = rng.normal(180, 20, (10, 50, 30))
    samples[:, :, 70:] = 0
    found = background(samples, 0.0, rng).astype(np.float64)
    assert found.mean() == pytest.approx(60, abs=0.5)
    assert found.std() == pytest.approx(6, rel=0.05)


def test_a_volume_without_anything_has_a_background_without_anything() -> None:
    found = background(np.zeros((4, 4, 4), np.float16), 0.0, np.random.default_rng(11))
    assert len(found)
    assert not found.any()


def test_mixup_lays_two_volumes_over_each_other_by_the_share_that_it_tells() -> None:
    first, second = marked((1, 2, 3)), marked((4, 5, 6))
    rng = np.random.default_rng(12)
    shares = []
    for _ in range(2000):
        samples, share = mixed_samples(first, second, 0.2, rng)
        shares.append(share)
    assert samples.dtype == np.float16
    expected = shares[-1] * first.samples.astype(float) + (1 - shares[-1]) * second.samples.astype(float)
    np.testing.assert_allclose(samples, expected, rtol=1e-3)
    # The beta distribution (α, α): mean 1/2, variance 1 / (4 (2α + 1)).
    assert np.mean(shares) == pytest.approx(0.5, abs=0.03)
    assert np.var(shares) == pytest.approx(1 / (4 * 1.4), abs=0.01)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_flipped_volume_looks_like_the_volume_of_the_mirrored_pose(axis: int) -> None:
    forceps = shipped_tools()["magnetic-forceps"]
    # Voxels on which every sample has its own, so that the mirror of each is one.
    grid = Grid((28, 139, 12 * 83), (622.0, 189.0, 131.6 / 12))
    sampling = Sampling(shape=(28, 139, 83), spacing_um=(622.0, 189.0, 131.6))
    pose = ToolPose(
        (7000.0, 9000.0, 2500.0), from_yaw_pitch_roll(50.0, 8.0, 35.0), {"theta1": 40.0, "theta2": 60.0}
    )
    ends_um = sampling.axis_um(axis, grid.spacing_um)[[0, -1]]
    mirrored = mirrored_pose(pose, forceps, axis, float(ends_um.mean()))

    def example(of: ToolPose) -> Example:
        scene = Scene(forceps, of, SceneSeed(1), grid, Scanner())
        positions_um = np.array(list(keypoints_um(of, forceps).values()))
        return Example(network_volume(scene, sampling).astype(np.float16), positions_um, grid.spacing_um)

    expected, other = example(mirrored), example(pose)
    found = flipped(other, sampling, axis)
    np.testing.assert_allclose(found.keypoints_um, expected.keypoints_um, atol=1e-6)

    def likeness(samples: np.ndarray) -> float:
        # Of what is bright: noise is alike nowhere.
        bright = [np.maximum(each.astype(np.float64), 60) for each in (samples, expected.samples)]
        return float(np.corrcoef(bright[0].ravel(), bright[1].ravel())[0, 1])

    assert likeness(found.samples) > 0.9
    assert likeness(other.samples) < 0.5


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("flip_axes", (0, 0)),
        ("flip_axes", (3,)),
        ("shift_voxels", (-1, 0, 0)),
        ("occlusion_share", (0.5, 0.4)),
        ("occlusion_chance", 1.5),
        ("occlusion_filling", "mirror"),
        ("mixup_alpha", -0.1),
    ],
)
def test_settings_that_cannot_be_are_refused(field: str, value: object) -> None:
    with pytest.raises(ValidationError):
        AugmentationSettings.model_validate({field: value})
