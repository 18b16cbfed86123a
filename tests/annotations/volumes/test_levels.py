import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from annotations.volumes import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    Level,
    detail_block,
    intensity_window,
    open_volume,
    preview_factors,
    strided_preview,
    surface_threshold,
)
from annotations.volumes.levels import displayed, displayed_dtype

spacings = st.tuples(*[st.floats(0.01, 1000)] * 3)
shapes = st.tuples(*[st.integers(1, 3000)] * 3)


def linear(shape: tuple[int, int, int], spacing_um: tuple[float, float, float]) -> np.ndarray:
    """Return a volume whose value is 2x + 3y − z of a voxel's position in µm."""
    x, y, z = (np.arange(length) * step for length, step in zip(shape, spacing_um, strict=True))
    return 2 * x[:, None, None] + 3 * y[None, :, None] - z[None, None, :]


def expected_of(level: Level) -> np.ndarray:
    """Return the value of `linear` where a level says that its voxels are."""
    x, y, z = (
        origin + np.arange(length) * step
        for origin, length, step in zip(level.origin_um, level.data.shape, level.spacing_um, strict=True)
    )
    return 2 * x[:, None, None] + 3 * y[None, :, None] - z[None, None, :]


def test_a_full_volume_is_previewed_at_about_every_fourteenth_voxel() -> None:
    factors = preview_factors((1096, 1936, 1152), OMES_SPACING_UM)
    assert 13 <= math.prod(factors) ** (1 / 3) <= 15
    sides = np.multiply(factors, OMES_SPACING_UM)
    assert sides.max() / sides.min() < 1.1


def test_an_axis_that_is_coarse_already_is_left_alone() -> None:
    factors = preview_factors((28, 1936, 1152), OMES_REALTIME_SPACING_UM)
    assert factors[0] == 1
    assert min(factors[1:]) > 1


@pytest.mark.parametrize("shape", [(1, 1, 1), (100, 100, 100), (1, 1_000_000, 1)])
def test_a_small_volume_is_previewed_whole(shape: tuple[int, int, int]) -> None:
    assert preview_factors(shape, (15.9, 13.5, 9.4)) == (1, 1, 1)


@given(shapes, spacings, st.integers(1, 10_000_000))
def test_factors_keep_to_the_budget(
    shape: tuple[int, int, int], spacing_um: tuple[float, float, float], budget: int
) -> None:
    factors = preview_factors(shape, spacing_um, budget)
    merged = [math.ceil(length / factor) for length, factor in zip(shape, factors, strict=True)]
    assert math.prod(merged) <= budget
    assert all(1 <= factor <= length for factor, length in zip(factors, shape, strict=True))
    if math.prod(shape) > budget:
        # Of two axes that were merged, neither is much coarser than the other.
        sides = [
            factor * step
            for factor, step, length in zip(factors, spacing_um, shape, strict=True)
            if 1 < factor < length
        ]
        assert not sides or max(sides) / min(sides) <= 3.0001


@given(st.tuples(*[st.integers(1, 30)] * 3), spacings, st.integers(1, 3000))
def test_a_preview_s_voxels_are_where_it_says(
    tmp_path_factory: pytest.TempPathFactory,
    shape: tuple[int, int, int],
    spacing_um: tuple[float, float, float],
    budget: int,
) -> None:
    path = tmp_path_factory.mktemp("preview") / "v.npy"
    np.save(path, linear(shape, spacing_um))
    level = strided_preview(open_volume(path), spacing_um, budget_voxels=budget)
    assert level.kind == "strided"
    assert level.data.size <= budget
    largest = np.abs(linear(shape, spacing_um)).max()
    np.testing.assert_allclose(level.data, expected_of(level), atol=largest * 1e-6, rtol=0)
    for axis in range(3):
        # As much is left out before the first as after the last, to within a voxel.
        before = round(level.origin_um[axis] / spacing_um[axis])
        after = shape[axis] - 1 - before - (level.data.shape[axis] - 1) * level.factors[axis]
        assert after - before in (0, 1)


@given(
    st.tuples(*[st.integers(1, 20)] * 3),
    spacings,
    st.tuples(*[st.floats(-2, 3)] * 3),
    st.floats(0, 2),
)
def test_a_detail_is_where_it_says_and_within_the_volume(
    tmp_path_factory: pytest.TempPathFactory,
    shape: tuple[int, int, int],
    spacing_um: tuple[float, float, float],
    centre_share: tuple[float, float, float],
    size_share: float,
) -> None:
    path = tmp_path_factory.mktemp("detail") / "v.npy"
    np.save(path, linear(shape, spacing_um))
    extent = np.multiply(shape, spacing_um)
    centre, size = np.multiply(centre_share, extent), size_share * extent
    level = detail_block(open_volume(path), spacing_um, centre, size)
    assert (level.kind, level.factors, level.spacing_um) == ("detail", (1, 1, 1), spacing_um)
    largest = np.abs(linear(shape, spacing_um)).max()
    np.testing.assert_allclose(level.data, expected_of(level), atol=largest * 1e-6, rtol=0)
    for axis in range(3):
        start = round(level.origin_um[axis] / spacing_um[axis])
        assert start >= 0
        assert start + level.data.shape[axis] <= shape[axis]
        inside = np.arange(shape[axis]) * spacing_um[axis]
        wanted = np.abs(inside - centre[axis]) <= size[axis] / 2 - 1e-6 * spacing_um[axis]
        got = np.zeros(shape[axis], bool)
        got[start : start + level.data.shape[axis]] = True
        assert got[wanted].all()


def test_a_detail_takes_one_size_for_all_axes(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "v.npy", ramp)
    level = detail_block(open_volume(tmp_path / "v.npy"), (1.0, 2.0, 4.0), (2, 4, 8), 4.0)
    np.testing.assert_array_equal(level.data, ramp[0:5, 1:4, 2:3])
    assert level.origin_um == (0.0, 2.0, 8.0)


@pytest.mark.parametrize(
    ("stored", "shown"),
    [("u1", "u1"), ("i1", "i1"), ("u2", "u2"), ("i2", "i2"), ("f4", "f4")]
    + [(each, "f4") for each in ("u4", "i4", "u8", "i8", "f2", "f8", "g")],
)
def test_levels_have_types_that_can_be_drawn(stored: str, shown: str) -> None:
    assert displayed_dtype(np.dtype(stored)) == np.dtype(shown)
    values = displayed(np.arange(8, dtype=stored).reshape(2, 2, 2))
    assert values.dtype == np.dtype(shown)
    assert values.flags.f_contiguous
    np.testing.assert_array_equal(values.ravel(), np.arange(8))


def test_what_float32_cannot_hold_becomes_infinite_without_a_warning() -> None:
    assert displayed(np.array([1e300, -1e300])).tolist() == [math.inf, -math.inf]


def level_of(data: np.ndarray) -> Level:
    return Level(data, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), "strided", (1, 1, 1))


@given(
    hnp.arrays(
        st.sampled_from([np.dtype(name) for name in ("u1", "i1", "u2", "i2", "f4")]),
        hnp.array_shapes(min_dims=3, max_dims=3, max_side=6),
    )
)
def test_a_window_is_finite_and_has_a_width(data: np.ndarray) -> None:
    low, high = intensity_window(level_of(data))
    assert math.isfinite(low)
    assert math.isfinite(high)
    assert low < high
    finite = data[np.isfinite(data)]
    if finite.size and finite.min() < finite.max():
        assert finite.min() <= low < high <= finite.max()


def test_a_window_leaves_out_dark_noise_and_glare() -> None:
    data = np.full((50, 50, 50), 100, np.uint8)
    data.ravel()[:40_000] = np.linspace(10, 90, 40_000)
    data.ravel()[-20:] = 255
    data.ravel()[:20] = 0
    low, high = intensity_window(level_of(data))
    assert 10 <= low < 15
    assert high == 100


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_level_of_nothing_finite_has_a_window(value: float) -> None:
    assert intensity_window(level_of(np.full((2, 2, 2), value, np.float32))) == (0.0, 1.0)


@given(
    hnp.arrays(
        st.sampled_from([np.dtype(name) for name in ("u1", "i1", "u2", "i2", "f4")]),
        hnp.array_shapes(min_dims=3, max_dims=3, max_side=6),
    )
)
def test_a_surface_threshold_lies_within_the_window(data: np.ndarray) -> None:
    low, high = intensity_window(level_of(data))
    threshold = surface_threshold(level_of(data))
    assert low <= threshold <= low + 0.5001 * (high - low)


@pytest.mark.parametrize("scale", [1.0, 7.0])
@pytest.mark.parametrize("offset", [0.0, -500.0])
@pytest.mark.parametrize("padding", [0.0, 0.6], ids=["whole", "padded"])
def test_a_surface_threshold_lies_between_speckle_and_surfaces(
    scale: float, offset: float, padding: float
) -> None:
    rng = np.random.default_rng(1)
    data = np.maximum(rng.normal(25, 12, (60, 60, 60)), 0)
    noise = data.copy()
    data[:, :, 20] = rng.normal(150, 20, (60, 60))
    data[: round(60 * padding)] = 0
    threshold = surface_threshold(level_of((offset + scale * data).astype(np.float32)))
    share_of_speckle = np.mean(offset + scale * noise > threshold)
    share_of_surface = np.mean(offset + scale * data[-20:, :, 20] > threshold)
    assert share_of_speckle < 0.005
    assert share_of_surface > 0.99


def test_an_empty_background_leaves_faint_surfaces_in_sight() -> None:
    data = np.zeros((20, 20, 20), np.uint8)
    data[:, :, 10] = 60
    data[:, :, 14] = 120
    assert 30 <= surface_threshold(level_of(data)) <= 60
