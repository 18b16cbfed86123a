from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from annotations.volumes import Volume, open_volume
from annotator.slices import slice_reading
from annotator.slices.slice_reading import ReadingPlan, read_slices

SHAPE = (12, 21, 17)


@pytest.fixture
def data() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 60000, SHAPE).astype(np.uint16)


def _npy(path: Path, data: np.ndarray) -> Path:
    np.save(path / "c.npy", data)
    return path / "c.npy"


def _fortran(path: Path, data: np.ndarray) -> Path:
    np.save(path / "f.npy", np.asfortranarray(data))
    return path / "f.npy"


def _chunked(path: Path, data: np.ndarray) -> Path:
    with h5py.File(path / "chunks.h5", "w") as file:
        file.create_dataset("volume", data=data, chunks=(5, 8, 4), compression="gzip")
    return path / "chunks.h5"


@pytest.fixture(params=[_npy, _fortran, _chunked])
def volume(request: pytest.FixtureRequest, tmp_path: Path, data: np.ndarray) -> Volume:
    write: Callable[[Path, np.ndarray], Path] = request.param
    return open_volume(write(tmp_path, data))


def test_no_portion_is_so_small_that_numpy_keeps_the_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_reading, "PORTION_BYTES", 1)
    volume = open_volume(_npy(tmp_path, np.zeros((90, 70, 40), np.uint8)))
    read: list[int] = []
    storage = volume._storage

    class Counting:
        def read(self, region: tuple[slice, slice, slice]) -> np.ndarray:
            found = storage.read(region)
            read.append(found.size)
            return found

    object.__setattr__(volume, "_storage", Counting())
    for axis, every in ((2, (1, 1)), (2, (3, 4)), (1, (9, 2)), (0, (1, 1))):
        read.clear()
        read_slices(
            volume,
            ReadingPlan.of(volume, axis),
            range(3, 5),
            every=every,
            transposed=False,
            given_up=lambda: False,
        )
        assert min(read[:-1], default=1000) > 500
        assert len(read) > 1 or sum(read) < 1001


def test_slices_across_all_but_the_slowest_axis_of_a_mapped_file_are_scattered_over_it(
    tmp_path: Path, data: np.ndarray
) -> None:
    scattered = [
        [ReadingPlan.of(open_volume(write(tmp_path, data)), axis).is_scattered for axis in range(3)]
        for write in (_npy, _fortran, _chunked)
    ]
    assert scattered == [[False, True, True], [True, True, False], [False, False, False]]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("every", [(1, 1), (1, 3), (4, 2), (30, 30)])
@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("portion_bytes", [1, 200, 16 * 2**20])
def test_slices_are_those_of_the_array(
    volume: Volume,
    data: np.ndarray,
    axis: int,
    every: tuple[int, int],
    transposed: bool,
    portion_bytes: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(slice_reading, "PORTION_BYTES", portion_bytes)
    monkeypatch.setattr(slice_reading, "PORTION_BYTES_HELD", portion_bytes)
    plan = ReadingPlan.of(volume, axis)

    slices = read_slices(
        volume, plan, range(3, 8), every=every, transposed=transposed, given_up=lambda: False
    )

    assert slices is not None
    for index, one in zip(range(3, 8), slices, strict=True):
        np.testing.assert_array_equal(one, data.take(index, axis)[:: every[0], :: every[1]])
        assert (one.T if transposed else one).flags.c_contiguous


@pytest.mark.parametrize("axis", range(3))
def test_reading_in_portions_ends_when_given_up(
    volume: Volume, axis: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slice_reading, "PORTION_BYTES", 1)
    monkeypatch.setattr(slice_reading, "PORTION_BYTES_HELD", 1)
    monkeypatch.setattr(slice_reading, "_COPIED_LOCKED", 0)
    asked = []

    def give_up_at_the_second() -> bool:
        asked.append(None)
        return len(asked) == 2

    plan = ReadingPlan.of(volume, axis)

    assert read_slices(volume, plan, range(1), transposed=False, given_up=give_up_at_the_second) is None
    assert len(asked) == 2


@pytest.mark.parametrize("axis", range(3))
def test_foreseen_blocks_hold_every_slice_once(volume: Volume, axis: int) -> None:
    plan = ReadingPlan.of(volume, axis)

    seen = set()
    index = 0
    while index < plan.count:
        blocks = plan.ahead(index, 1)
        seen.update(other for block in (plan.first(index), *blocks) for other in block)
        index += 1

    assert seen == set(range(plan.count))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("step", [1, -2, 5, -10])
def test_scrolling_on_stops_where_it_was_foreseen(volume: Volume, axis: int, step: int) -> None:
    plan = ReadingPlan.of(volume, axis)

    for index in range(plan.count):
        foreseen = [other for block in plan.ahead(index, step) for other in block]
        assert all(0 <= other < plan.count for other in foreseen)
        assert not 0 <= index + step < plan.count or index + step in foreseen


def test_slices_with_gaps_between_them_are_read_in_one_go(volume: Volume, data: np.ndarray) -> None:
    slices = read_slices(
        volume, ReadingPlan.of(volume, 2), range(2, 17, 6), transposed=True, given_up=lambda: False
    )

    assert slices is not None
    for index, one in zip((2, 8, 14), slices, strict=True):
        assert np.array_equal(one, data[:, :, index])


def _full(chunks: tuple[int, int, int] | None = None, *, fortran_order: bool = False) -> Volume:
    return Volume(
        path=Path("full"),
        dataset=None,
        format="npy",
        shape=(1096, 1936, 1152),
        dtype=np.dtype(np.uint8),
        file_dtype="|u1",
        spacing_um=None,
        spacing_source=None,
        depth_axis=2,
        chunks=chunks,
        fortran_order=fortran_order,
        _storage=None,  # type: ignore[arg-type]
    )


def test_across_the_fast_axis_neighbours_come_for_nothing() -> None:
    """A byte of a mapped file costs its page: across z that holds thousands of slices, across x one."""
    together = [ReadingPlan.of(_full(), axis).together for axis in range(3)]

    assert together == [1, 3, 7]
    assert [ReadingPlan.of(_full(fortran_order=True), axis).together for axis in range(3)] == [7, 3, 1]


def test_one_slice_is_wanted_first_then_its_neighbours_and_those_that_scrolling_reaches() -> None:
    plan = ReadingPlan.of(_full(), 2)

    assert plan.first(500) == range(500, 501)
    assert plan.ahead(500, 1) == (range(497, 504), range(504, 511))
    assert plan.ahead(500, -1) == (range(497, 504), range(490, 497))
    assert plan.ahead(500, 0) == (range(497, 504),)
    assert plan.ahead(1151, 1) == (range(1148, 1152),)


def test_fast_scrolling_reads_only_where_it_stops() -> None:
    plan = ReadingPlan.of(_full(), 2)

    assert plan.ahead(500, 7) == (range(493, 541, 7), range(542, 590, 7))
    assert plan.ahead(500, -5) == (range(490, 525, 5), range(455, 490, 5))
    assert plan.ahead(1150, 7) == (range(1129, 1152, 7),)
    assert ReadingPlan.of(_full(), 1).ahead(500, 7)[0] == range(507, 508)
    assert ReadingPlan.of(_full((4, 64, 64)), 0).ahead(6, 3) == (range(4, 8), range(8, 12))


def test_across_the_slow_axis_single_slices_are_foreseen() -> None:
    plan = ReadingPlan.of(_full(), 0)

    assert plan.ahead(10, 1) == (range(11, 12), range(12, 13), range(13, 14), range(14, 15))
    assert plan.ahead(20, -10) == (range(10, 11), range(1))
    assert plan.ahead(10, 0) == ()


def test_slices_of_one_chunk_are_read_together() -> None:
    plan = ReadingPlan.of(_full((4, 64, 64)), 0)

    assert plan.first(6) == range(4, 8)
    assert plan.ahead(6, 1) == (range(4, 8), range(8, 12))


def test_a_portion_is_small_enough_to_be_given_up_soon() -> None:
    for axis in range(3):
        for chunks in (None, (64, 64, 64), (1, 1936, 1152)):
            plan = ReadingPlan.of(_full(chunks), axis)
            others = [
                length
                for other, length in enumerate((1096, 1936, 1152))
                if other not in (axis, plan.portion_axis)
            ]
            per_step = (chunks[axis] if chunks else plan.together) * others[0]
            least = chunks[plan.portion_axis] if chunks else 1
            assert plan.portion * per_step <= max(16 * 2**20, least * per_step)
