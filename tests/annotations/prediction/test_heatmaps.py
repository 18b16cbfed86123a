"""Keypoints as heatmaps, and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from annotations.prediction.heatmaps import HeatmapConvention, axis_profiles, decode, encode
from annotations.volumes.sampling import OMES_SAMPLING, PUBLISHED_SAMPLING, Sampling
from annotations.volumes.spacing import OMES_REALTIME_SPACING_UM, OMES_SPACING_UM, SpacingUm

DEFAULT = HeatmapConvention()
ARGMAX = HeatmapConvention(target="gaussian", decoding="argmax", sigma_voxel=(3.0, 3.0, 3.0))
SOFT = HeatmapConvention(
    target="gaussian", decoding="soft-argmax", temperature=100.0, sigma_voxel=(3.0, 3.0, 3.0)
)
ONE_HOT = HeatmapConvention(target="one-hot", decoding="argmax")
SHRUNK = HeatmapConvention(shrink=0.8)
SHAPE = (12, 15, 13)

shares = st.tuples(*[st.floats(0, 1)] * 3)
spacings = st.sampled_from([OMES_SPACING_UM, OMES_REALTIME_SPACING_UM])


def placed(share: tuple[float, float, float], margin: float = 0.0) -> np.ndarray:
    """Return a place within the heatmap, at shares of its axes, so many voxels from its border."""
    return margin + np.array(share) * (np.array(SHAPE) - 1 - 2 * margin)


@given(share=shares)
def test_a_distribution_gives_its_keypoint_back(share: tuple[float, float, float]) -> None:
    index = placed(share)

    decoded = decode(encode([index], SHAPE, DEFAULT), DEFAULT)

    np.testing.assert_allclose(decoded.index_heatmap, [index], atol=0.01)
    assert decoded.presence[0] > 0.99


@settings(max_examples=25)
@given(share=shares)
def test_narrow_and_wide_distributions_do_so_alike(share: tuple[float, float, float]) -> None:
    for sigma in (0.4, 1.0, 4.0):
        convention = HeatmapConvention(sigma_voxel=(sigma, sigma, sigma))
        decoded = decode(encode([placed(share)], SHAPE, convention), convention)
        np.testing.assert_allclose(decoded.index_heatmap, [placed(share)], atol=0.01)


@pytest.mark.parametrize("convention", [ARGMAX, ONE_HOT])
@given(share=shares)
def test_an_argmax_is_half_a_voxel_off_at_most(
    convention: HeatmapConvention, share: tuple[float, float, float]
) -> None:
    decoded = decode(encode([placed(share)], SHAPE, convention), convention)

    assert np.abs(decoded.index_heatmap - placed(share)).max() <= 0.5 + 1e-5


@given(share=shares)
def test_a_soft_argmax_is_a_quarter_of_a_voxel_off_at_most(share: tuple[float, float, float]) -> None:
    decoded = decode(encode([placed(share)], SHAPE, SOFT), SOFT)

    assert np.abs(decoded.index_heatmap - placed(share)).max() <= 0.25


def test_a_sharp_soft_argmax_of_narrow_heatmaps_comes_near_to_an_argmax() -> None:
    narrow = HeatmapConvention(
        target="gaussian", decoding="soft-argmax", temperature=100.0, sigma_voxel=(1.0, 1.0, 1.0)
    )
    index = np.array([[6.4, 7.0, 6.0]])

    off = np.abs(decode(encode(index, SHAPE, narrow), narrow).index_heatmap - index).max()

    assert 0.25 < off < 0.5


@pytest.mark.parametrize("temperature", [1.0, 10.0, 100.0])
def test_a_soft_argmax_equals_the_sum_that_defines_it(temperature: float) -> None:
    heatmaps = np.random.default_rng(0).random((2, *SHAPE))
    convention = HeatmapConvention(target="gaussian", decoding="soft-argmax", temperature=temperature)
    weights = np.exp(temperature * heatmaps)
    weights /= weights.sum(axis=(1, 2, 3), keepdims=True)
    expected = np.stack([np.einsum("nijk,ijk->n", weights, axis) for axis in np.indices(SHAPE)], axis=1)

    np.testing.assert_allclose(decode(heatmaps, convention).index_heatmap, expected, atol=1e-4)


def test_presence_is_the_share_that_is_not_the_logit_of_being_nowhere() -> None:
    logits = np.random.default_rng(0).normal(size=(3, *SHAPE))
    logits[2] -= 20
    there = np.exp(logits).sum(axis=(1, 2, 3))

    decoded = decode(logits, DEFAULT)

    np.testing.assert_allclose(decoded.presence, there / (there + 1), rtol=1e-5)
    np.testing.assert_allclose(decoded.peak, np.exp(logits.max(axis=(1, 2, 3))) / (there + 1), rtol=1e-5)
    np.testing.assert_array_equal(np.isnan(decoded.index_heatmap).all(axis=1), [False, False, True])


@pytest.mark.parametrize("value", [-1e30, 1e30, -100.0, 100.0, 0.0])
@pytest.mark.parametrize("convention", [DEFAULT, ARGMAX, SOFT])
def test_flat_heatmaps_of_any_height_are_decoded_without_a_warning(
    convention: HeatmapConvention, value: float
) -> None:
    with np.errstate(all="raise", under="ignore"):
        decoded = decode(np.full((1, *SHAPE), value), convention)

    assert 0 <= decoded.presence[0] <= 1
    assert np.isfinite(decoded.spread_voxel).all()
    if value < 0:
        assert np.isnan(decoded.index_heatmap).all()


def test_the_spread_is_the_width_that_was_taught() -> None:
    decoded = decode(encode([[6.2, 7.3, 6.0]], (24, 30, 26), HeatmapConvention()), HeatmapConvention())

    np.testing.assert_allclose(decoded.spread_voxel, [[0.6, 1.8, 2.6]], rtol=0.05)


@pytest.mark.parametrize("convention", [DEFAULT, ARGMAX, SOFT, ONE_HOT])
@pytest.mark.parametrize(
    "index", [(-0.1, 5, 5), (5, 14.1, 5), (5, 5, 1e9), (np.nan, np.nan, np.nan), (5, 5, -np.inf)]
)
def test_what_is_out_of_range_is_reported_and_never_clamped(
    convention: HeatmapConvention, index: tuple[float, float, float]
) -> None:
    targets = axis_profiles([index], SHAPE, convention)
    decoded = decode(encode([index], SHAPE, convention), convention)

    assert not targets.is_in_range[0]
    assert not any(profile.any() for profile in targets.profiles)
    assert np.isnan(decoded.index_heatmap).all()
    assert decoded.presence[0] < 0.01


@given(share=shares)
def test_profiles_have_the_mass_or_the_peak_that_their_target_says(share: tuple[float, float, float]) -> None:
    index = [placed(share)]
    for convention in (DEFAULT, ONE_HOT):
        for profile in axis_profiles(index, SHAPE, convention).profiles:
            assert profile.sum() == pytest.approx(1)
            assert profile.min() >= 0
    for axis, profile in enumerate(axis_profiles(index, SHAPE, ARGMAX).profiles):
        steps = np.arange(SHAPE[axis]) - index[0][axis]
        np.testing.assert_allclose(profile[0], np.exp(-(steps**2) / 18))


@given(
    index=st.tuples(*[st.floats(-100, 200)] * 3),
    reduction=st.tuples(*[st.sampled_from([1, 2, 4])] * 3),
    shrink=st.floats(0.3, 1),
)
def test_indices_of_input_and_heatmap_are_converted_both_ways(
    index: tuple[float, float, float], reduction: tuple[int, int, int], shrink: float
) -> None:
    convention = HeatmapConvention(reduction=reduction, shrink=shrink)
    shape = (32, 160, 96)

    there = convention.to_heatmap([index], shape)

    np.testing.assert_allclose(convention.to_input(there, shape), [index], atol=1e-9)


def test_a_heatmap_voxel_is_centred_over_the_voxels_that_it_covers() -> None:
    np.testing.assert_allclose(DEFAULT.to_input([0, 1, 2], (32, 160, 96)), [0.5, 2.5, 4.5])
    assert DEFAULT.heatmap_shape((32, 160, 96)) == (16, 80, 48)
    with pytest.raises(ValueError, match="divided"):
        DEFAULT.heatmap_shape((32, 161, 96))


def there_and_back(
    position_um: np.ndarray, spacing_um: SpacingUm, sampling: Sampling, convention: HeatmapConvention
) -> np.ndarray:
    """Take a position in a volume through a network that knows it."""
    shape = convention.heatmap_shape(sampling.padded_shape)
    index = convention.to_heatmap(sampling.to_index(position_um, spacing_um), sampling.padded_shape)
    decoded = decode(encode([index], shape, convention), convention)
    return sampling.to_um(convention.to_input(decoded.index_heatmap, sampling.padded_shape), spacing_um)[0]


def reach_um(spacing_um: SpacingUm, sampling: Sampling, convention: HeatmapConvention) -> np.ndarray:
    """Return the least and the largest position in µm that the convention can tell, shape (2, 3)."""
    last = np.array(convention.heatmap_shape(sampling.padded_shape)) - 1
    return sampling.to_um(convention.to_input([(0, 0, 0), last], sampling.padded_shape), spacing_um)


@given(share=shares, spacing_um=spacings, convention=st.sampled_from([DEFAULT, SHRUNK]))
def test_positions_as_far_out_as_the_convention_reaches_come_back(
    share: tuple[float, float, float], spacing_um: SpacingUm, convention: HeatmapConvention
) -> None:
    low_um, high_um = reach_um(spacing_um, OMES_SAMPLING, convention)
    position_um = low_um + (np.array(share) * (1 - 2e-9) + 1e-9) * (high_um - low_um)

    given_um = there_and_back(position_um, spacing_um, OMES_SAMPLING, convention)

    voxel_um = np.multiply(convention.reduction, OMES_SAMPLING.spacing_um) / convention.shrink
    assert (np.abs(given_um - position_um) <= 0.01 * voxel_um).all()


@pytest.mark.parametrize("spacing_um", [OMES_SPACING_UM, OMES_REALTIME_SPACING_UM])
def test_the_default_margin_lies_around_the_whole_workspace(spacing_um: SpacingUm) -> None:
    low_um, high_um = reach_um(spacing_um, OMES_SAMPLING, DEFAULT)

    assert (low_um < [-900, -1700, -600]).all()
    assert (high_um > [27 * 622 + 900, 1935 * 13.5 + 1700, 1151 * 9.4 + 600]).all()


@given(
    share=shares,
    spacing_um=spacings,
    axis=st.integers(0, 2),
    beyond_um=st.floats(1, 1e5),
    is_before=st.booleans(),
    convention=st.sampled_from([DEFAULT, SHRUNK]),
)
def test_positions_beyond_the_margin_have_no_place(
    share: tuple[float, float, float],
    spacing_um: SpacingUm,
    axis: int,
    beyond_um: float,
    is_before: bool,
    convention: HeatmapConvention,
) -> None:
    low_um, high_um = reach_um(spacing_um, OMES_SAMPLING, convention)
    position_um = low_um + np.array(share) * (high_um - low_um)
    position_um[axis] = low_um[axis] - beyond_um if is_before else high_um[axis] + beyond_um

    assert np.isnan(there_and_back(position_um, spacing_um, OMES_SAMPLING, convention)).all()


def test_the_published_convention_reaches_a_tenth_of_the_input_beyond_each_end() -> None:
    published = HeatmapConvention(target="gaussian", decoding="argmax", shrink=0.8)
    low, high = published.to_input([(0, 0, 0), (15, 71, 43)], PUBLISHED_SAMPLING.padded_shape)

    count = np.array(PUBLISHED_SAMPLING.padded_shape)
    np.testing.assert_allclose(low, -(count - 1) * 0.125, atol=0.7)
    np.testing.assert_allclose(high, (count - 1) * 1.125, atol=0.7)


@pytest.mark.parametrize(
    "fields",
    [
        {"target": "gaussian"},
        {"decoding": "argmax"},
        {"shrink": 0.0},
        {"shrink": 1.1},
        {"sigma_voxel": (0.0, 1.0, 1.0)},
        {"temperature": float("inf")},
        {"reduction": (0, 1, 1)},
        {"reduction": (2.0, 2, 2)},
        {"surprise": 1},
    ],
)
def test_a_convention_that_means_nothing_is_refused(fields: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        HeatmapConvention.model_validate(fields)
