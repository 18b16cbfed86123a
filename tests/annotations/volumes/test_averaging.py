import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from annotations.volumes import (
    Cancelled,
    Level,
    Volume,
    averaged_level,
    averaging,
    open_volume,
    preview_factors,
)

SPACING_UM = (15.9, 13.5, 9.4)


def averaged(volume: Volume, budget: int, spacing_um: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Level:
    return averaged_level(
        volume, spacing_um, budget_voxels=budget, progress=lambda _: None, cancelled=lambda: False
    )


def slow_means(array: np.ndarray, factors: tuple[int, int, int]) -> np.ndarray:
    """Average block by block, the obvious way."""
    shape = [math.ceil(length / factor) for length, factor in zip(array.shape, factors, strict=True)]
    means = np.empty(shape)
    for index in np.ndindex(*shape):
        block = array[
            tuple(
                slice(place * factor, (place + 1) * factor)
                for place, factor in zip(index, factors, strict=True)
            )
        ].astype(np.float64)
        means[index] = np.nan if np.isnan(block).all() else np.nanmean(block)
    return means


@given(
    shape=st.tuples(*[st.integers(1, 14)] * 3),
    budget=st.integers(1, 500),
    dtype=st.sampled_from(["u1", "i1", "<u2", ">i2", "<u4", ">i8", "<f2", "<f4", ">f8", "?"]),
    seed=st.integers(0, 2**32 - 1),
    fortran_order=st.booleans(),
    tile_bytes=st.sampled_from([1, 200, 1 << 20]),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_every_format_and_type_is_averaged_by_blocks(
    write, tmp_path_factory, monkeypatch, shape, budget, dtype, seed, fortran_order, tile_bytes
) -> None:
    if write.__name__ == "write_tiff_pages":
        shape = (shape[0] + 1, *shape[1:])
    array = np.random.default_rng(seed).integers(0, 2 if dtype == "?" else 100, shape).astype(dtype)
    if fortran_order:
        array = np.asfortranarray(array)
    monkeypatch.setattr(averaging, "_TILE_BYTES", tile_bytes)
    with open_volume(write(tmp_path_factory.mktemp("volume"), array)) as volume:
        level = averaged(volume, budget)
    expected = slow_means(array, level.factors)
    assert level.kind == "averaged"
    assert level.data.flags.f_contiguous
    if level.data.dtype.kind in "iu":
        expected = np.rint(expected)
    np.testing.assert_allclose(level.data, expected, rtol=1e-6)


@pytest.mark.parametrize("budget", [30, 400, 10_000_000])
def test_a_linear_ramp_is_itself_at_the_level_s_positions(tmp_path: Path, budget: int) -> None:
    shape = (24, 36, 48)
    x, y, z = (np.arange(length) * step for length, step in zip(shape, SPACING_UM, strict=True))
    np.save(tmp_path / "v.npy", 2 * x[:, None, None] + 3 * y[None, :, None] - z[None, None, :])
    level = averaged(open_volume(tmp_path / "v.npy"), budget, SPACING_UM)
    assert level.spacing_um == pytest.approx(np.multiply(SPACING_UM, level.factors))
    # The last block along an axis may be a partial one, whose centre lies elsewhere.
    whole = tuple(slice(length // factor) for length, factor in zip(shape, level.factors, strict=True))
    x, y, z = (
        origin + np.arange(length) * step
        for origin, length, step in zip(level.origin_um, level.data.shape, level.spacing_um, strict=True)
    )
    expected = 2 * x[:, None, None] + 3 * y[None, :, None] - z[None, None, :]
    assert level.data[whole].size > 0
    np.testing.assert_allclose(level.data[whole], expected[whole], atol=1e-3)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_nan_does_not_count_and_infinities_do(tmp_path: Path) -> None:
    array = np.ones((4, 4, 4), np.float32)
    array[0, 0, 0] = np.nan
    array[2:, :2, :2] = np.nan
    array[0, 2, 2] = np.inf
    array[2, 2, 2], array[3, 3, 3] = np.inf, -np.inf
    np.save(tmp_path / "v.npy", array)
    level = averaged(open_volume(tmp_path / "v.npy"), 8)
    assert level.factors == (2, 2, 2)
    np.testing.assert_array_equal(level.data, [[[1, 1], [1, np.inf]], [[np.nan, 1], [1, np.nan]]])


@pytest.mark.parametrize("value", [0, 7, 255])
def test_a_constant_volume_stays_constant_up_to_its_borders(tmp_path: Path, value: int) -> None:
    np.save(tmp_path / "v.npy", np.full((17, 19, 23), value, np.uint8))
    level = averaged(open_volume(tmp_path / "v.npy"), 50)
    assert (level.data == value).all()


@pytest.mark.parametrize("dtype", ["u2", "i2"])
def test_the_sum_of_a_large_block_does_not_overflow(tmp_path: Path, dtype: str) -> None:
    peak = np.iinfo(dtype).min or np.iinfo(dtype).max
    np.save(tmp_path / "v.npy", np.full((60, 50, 40), peak, dtype))
    level = averaged(open_volume(tmp_path / "v.npy"), 1)
    assert level.data.tolist() == [[[peak]]]


def test_progress_runs_from_nothing_to_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "_TILE_BYTES", 1000)
    np.save(tmp_path / "v.npy", np.zeros((20, 20, 20), np.uint8))
    said: list[float] = []
    averaged_level(
        open_volume(tmp_path / "v.npy"),
        SPACING_UM,
        budget_voxels=100,
        progress=said.append,
        cancelled=lambda: False,
    )
    assert said == sorted(said)
    assert (said[0], said[-1]) == (0.0, 1.0)
    assert len(said) > 5


def test_cancelling_stops_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(averaging, "_TILE_BYTES", 1000)
    np.save(tmp_path / "v.npy", np.zeros((20, 20, 20), np.uint8))
    said: list[float] = []
    with pytest.raises(Cancelled):
        averaged_level(
            open_volume(tmp_path / "v.npy"),
            SPACING_UM,
            budget_voxels=100,
            progress=said.append,
            cancelled=lambda: len(said) > 3,
        )
    assert len(said) == 4
    assert said[-1] < 1.0


def test_a_file_in_chunks_is_read_in_tiles_of_about_their_size(writers, tmp_path: Path) -> None:
    array = np.zeros((12, 12, 12), np.uint8)
    volume = open_volume(writers["hdf5 compressed"](tmp_path, array))
    assert volume.chunks == (3, 3, 3)
    assert preview_factors(array.shape, (1, 1, 1), 300) == (2, 2, 2)
    tiles = list(averaging._tiles(volume, (2, 2, 2), 2))
    covered = np.zeros(array.shape, int)
    for tile in tiles:
        covered[tile] += 1
    assert (covered == 1).all()


@pytest.mark.parametrize("fortran_order", [False, True])
def test_of_a_large_file_some_planes_of_each_block_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fortran_order: bool
) -> None:
    shape = (19, 12, 8) if not fortran_order else (8, 12, 19)
    array = np.random.default_rng(1).integers(0, 200, shape, np.uint8)
    np.save(tmp_path / "v.npy", np.asfortranarray(array) if fortran_order else array)
    monkeypatch.setattr(averaging, "_WHOLE_BYTES", array.size // 2)
    volume = open_volume(tmp_path / "v.npy")
    level = averaged(volume, 20)
    slow = 2 if fortran_order else 0
    factor = level.factors[slow]
    assert factor >= 4
    counted = factor // 2
    planes = np.moveaxis(array, slow, 0)
    blocks = [planes[start : start + factor] for start in range(0, len(planes), factor)]
    chosen = []
    for block in blocks:
        count = min(counted, len(block))
        chosen.append(block[[(2 * number + 1) * len(block) // (2 * count) for number in range(count)]])
    others = [each for axis, each in enumerate(level.factors) if axis != slow]
    expected = [np.rint(slow_means(block, (factor, others[0], others[1]))) for block in chosen]
    np.testing.assert_array_equal(np.moveaxis(level.data, slow, 0), np.concatenate(expected))


@pytest.mark.parametrize("kind", ["u1", "f4"])
@pytest.mark.parametrize("fortran_order", [False, True])
def test_of_the_planes_that_are_read_some_rows_of_each_block_are_added_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fortran_order: bool, kind: str
) -> None:
    shape = (12, 21, 8)
    # Each row has a value of its own, and one that counts and one that does not are far from all others.
    array = np.broadcast_to(np.arange(21, dtype=kind)[None, :, None], shape).copy()
    array[:, 5:7] = 200
    if kind == "f4":
        array[:, 0] = np.nan
    np.save(tmp_path / "v.npy", array.T if fortran_order else array)
    size = array.size * array.itemsize
    monkeypatch.setattr(averaging, "_WHOLE_BYTES", size // 2)
    monkeypatch.setattr(averaging, "_PART_BYTES", size // 4)
    monkeypatch.setattr(averaging, "preview_factors", lambda *_: (6, 9, 4)[:: -1 if fortran_order else 1])
    level = averaged(open_volume(tmp_path / "v.npy"), 50)
    # Half of the planes' rows would be 4 of 9; of 5 the first is one, in the partial block, too.
    rows = [0, 2, 4, 6, 8]
    assert averaging._counted_rows(open_volume(tmp_path / "v.npy"), 3 / 6, 9) == rows
    expected = [
        np.nanmean([array[0, start + row, 0] for row in rows if start + row < 21]) for start in (0, 9, 18)
    ]
    means = level.data.T if fortran_order else level.data
    np.testing.assert_allclose(
        means, np.broadcast_to(np.array(expected)[None, :, None], means.shape), atol=0.5
    )


def test_no_more_is_read_of_a_volume_four_times_as_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(averaging, "_WHOLE_BYTES", 32**3)
    read = []
    for number, length in enumerate((32, 128)):
        path = tmp_path / f"v{number}.npy"
        np.save(path, np.zeros((length, 32, 32), np.uint8))
        volume = open_volume(path)
        storage = volume._storage
        voxels = 0

        def count(region: tuple[slice, slice, slice], original=storage.read) -> np.ndarray:
            nonlocal voxels
            found = original(region)
            voxels += found.size
            return found

        monkeypatch.setattr(storage, "read", count)
        averaged(volume, 512)
        read.append(voxels)
    assert read[1] <= read[0] == 32**3


@given(
    blocks=st.integers(1, 5), rest=st.integers(1, 12), factor=st.integers(2, 12), counted=st.integers(1, 11)
)
def test_the_planes_that_count_lie_in_their_blocks(blocks: int, rest: int, factor: int, counted: int) -> None:
    counted = min(counted, factor - 1)
    # Of a tile of whole blocks, and of the partial one at the end of an axis.
    for size in (blocks * factor, min(rest, factor - 1)):
        region = (slice(20, 20 + size), slice(0, 2), slice(0, 3))
        parts = averaging._parts(region, 0, factor, counted)
        assert all(part[1:] == region[1:] for part in parts)
        indices = [index for part in parts for index in range(part[0].start, part[0].stop, part[0].step)]
        assert len(indices) == len(set(indices))
        for begin in range(20, 20 + size, factor):
            end = min(begin + factor, 20 + size)
            inside = [index for index in indices if begin <= index < end]
            assert len(inside) == min(counted, end - begin)
    assert averaging._parts(region, 0, factor, factor) == [region]


@given(
    shape=st.tuples(*[st.integers(1, 20)] * 3),
    factors=st.tuples(*[st.integers(1, 9)] * 3),
    kind=st.sampled_from(["u1", "u2", "i2", "u4", "f4"]),
    extreme=st.booleans(),
)
@example(shape=(2, 9, 2), factors=(2, 9, 2), kind="u2", extreme=True)
def test_means_are_those_of_blocks_of_any_shape(
    shape: tuple[int, int, int], factors: tuple[int, int, int], kind: str, extreme: bool
) -> None:
    values = np.random.default_rng(2).integers(0, 120, shape).astype(kind)
    if extreme:
        values[values > 9] = np.nan if kind == "f4" else np.iinfo(kind).max
    planes = [values[place :: factors[0]] for place in range(min(factors[0], shape[0]))]
    found = averaging._means(planes, factors[1:], range(factors[1]), np.dtype(np.float64))
    np.testing.assert_allclose(found, slow_means(values, factors), rtol=1e-12)
