import itertools
import mmap
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.volumes import VolumeError, mapping, open_volume, preview_factors, volume
from annotations.volumes.mapped_file import MappedFile
from annotations.volumes.mapping import MappedStorage

sides = st.tuples(*[st.integers(1, 12)] * 3)


@st.composite
def cut_shapes(draw: st.DrawFn) -> tuple[tuple[int, int, int], tuple[slice, slice, slice]]:
    shape = draw(sides)
    parts = [
        slice(draw(st.integers(0, length)), draw(st.integers(0, length)), draw(st.integers(1, 4)))
        for length in shape
    ]
    return shape, (parts[0], parts[1], parts[2])


def mapped(path: Path, array: np.ndarray, offset: int) -> MappedStorage:
    path.write_bytes(bytes(offset) + array.tobytes("A"))
    with path.open("rb") as stream:
        return MappedStorage.of_stream(
            stream,
            where=path,
            dtype=array.dtype,
            shape=array.shape,
            offset=offset,
            fortran_order=not array.flags.c_contiguous,
        )


@given(
    cut=cut_shapes(),
    dtype=st.sampled_from(["u1", ">u2", "f8"]),
    order=st.sampled_from("CF"),
    gap=st.integers(0, 50),
)
def test_what_is_asked_for_covers_what_is_read(
    tmp_path_factory: pytest.TempPathFactory, cut: Any, dtype: str, order: str, gap: int
) -> None:
    shape, region = cut
    offset = 13
    array = np.zeros(shape, dtype, order=order)
    storage = mapped(tmp_path_factory.mktemp("mapped") / "v.raw", array, offset)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mapping, "_GAP_BYTES", gap)
        spans = list(storage._spans(storage._open[1], region))
    asked = np.zeros(offset + array.nbytes, bool)
    for start, stop in spans:
        assert 0 <= start < stop <= len(asked)
        asked[start:stop] = True
    marked = np.zeros(shape, np.uint8, order=order)
    marked[region] = 1
    touched = np.repeat(marked.ravel(order="K"), array.itemsize).astype(bool)
    assert asked[offset:][touched].all()
    assert bool(spans) is bool(touched.any())
    assert all(later[0] - before[1] > gap for before, later in itertools.pairwise(spans))


def test_a_preview_asks_for_no_more_of_a_volume_four_times_as_large(tmp_path: Path) -> None:
    storage = mapped(tmp_path / "v.raw", np.zeros((1, 1, 1), np.uint8), 0)
    asked = []
    for shape in ((1096, 1936, 1152), (1740, 3073, 1829), (4384, 1936, 1152)):
        # What stands for the array is never looked at, but for where its voxels are.
        array: Any = SimpleNamespace(itemsize=1, strides=(shape[1] * shape[2], shape[2], 1))
        factors = preview_factors(shape, (15.9, 13.5, 9.4))
        first, second, third = (
            slice(0, length, factor) for length, factor in zip(shape, factors, strict=True)
        )
        pages = {
            page
            for start, stop in storage._spans(array, (first, second, third))
            for page in range(start // mmap.PAGESIZE, -(-stop // mmap.PAGESIZE))
        }
        asked.append(len(pages))
    assert max(asked[1:]) <= asked[0]


def test_a_volume_lies_in_a_file_that_is_let_go_in_portions(tmp_path: Path) -> None:
    storage = mapped(tmp_path / "v.raw", np.zeros((2, 3, 4), np.uint8), 5)
    view = storage.read((slice(0, 2, 1), slice(0, 3, 1), slice(0, 4, 1)))
    storage.close()
    assert view.base is not None
    assert isinstance(view.base.base, MappedFile)


@given(cut=cut_shapes(), order=st.sampled_from("CF"), piece_bytes=st.sampled_from([1, 100, 1 << 20]))
def test_loading_in_pieces_is_reading_a_copy(
    tmp_path_factory: pytest.TempPathFactory, cut: Any, order: str, piece_bytes: int
) -> None:
    shape, region = cut
    array = np.arange(np.prod(shape), dtype=">u2").reshape(shape, order=order)
    path = tmp_path_factory.mktemp("loaded") / "v.npy"
    np.save(path, array)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(volume, "_PIECE_BYTES", piece_bytes)
        patch.setattr(volume, "_SHARED_BYTES", 0)
        loaded = open_volume(path).load(region)
    np.testing.assert_array_equal(loaded, array[region])
    assert loaded.dtype == np.uint16
    assert loaded.dtype.isnative
    assert loaded.flags.c_contiguous
    assert loaded.flags.owndata


def test_pieces_are_asked_for_before_their_turn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    np.save(tmp_path / "v.npy", np.zeros((10, 10, 10), np.uint8))
    opened = open_volume(tmp_path / "v.npy")
    done: list[tuple[str, int]] = []
    read, prefetch = MappedStorage.read, MappedStorage.prefetch
    monkeypatch.setattr(volume, "_PIECE_BYTES", 200)
    monkeypatch.setattr(volume, "_SHARED_BYTES", 0)
    monkeypatch.setattr(
        MappedStorage,
        "read",
        lambda self, region: done.append(("read", region[0].start)) or read(self, region),
    )
    monkeypatch.setattr(
        MappedStorage,
        "prefetch",
        lambda self, region: done.append(("ask", region[0].start)) or prefetch(self, region),
    )
    opened.load((slice(None), slice(None), slice(3, 4, 2)))
    assert sorted(done) == [(what, start) for what in ("ask", "read") for start in range(0, 10, 2)]
    # Two threads take turns: each asks for its next piece before it reads one.
    for start in range(0, 10, 2):
        assert done.index(("ask", start)) < done.index(("read", start))
    for start in range(0, 6, 2):
        assert done.index(("ask", start + 4)) < done.index(("read", start))


def failing_at(
    place: int, path: Path, monkeypatch: pytest.MonkeyPatch, before: Callable[[int], None]
) -> None:
    """Let a mapped volume be read by two threads plane by plane, and fail at one plane."""

    def read(_: MappedStorage, region: Any) -> np.ndarray:
        before(region[0].start)
        if region[0].start == place:
            raise VolumeError("the disk is gone", where=path, remedy="Bring it back")
        return np.zeros((1, 10, 5), np.uint8)

    monkeypatch.setattr(volume, "_PIECE_BYTES", 100)
    monkeypatch.setattr(volume, "_SHARED_BYTES", 0)
    monkeypatch.setattr(MappedStorage, "read", read)


def load_and_fail(path: Path, planes: int) -> None:
    np.save(path, np.zeros((planes, 10, 10), np.uint8))
    with open_volume(path) as opened, pytest.raises(VolumeError, match="the disk is gone"):
        opened.load((slice(None), slice(None), slice(None, None, 2)))


def test_what_fails_in_the_other_thread_is_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    threads: dict[int, threading.Thread] = {}
    path = tmp_path / "v.npy"
    failing_at(3, path, monkeypatch, lambda place: threads.update({place: threading.current_thread()}))
    load_and_fail(path, 4)
    assert threads.get(0, threading.main_thread()) is threading.main_thread()
    assert threads[1] is threads[3] is not threading.main_thread()


@pytest.mark.parametrize("first", [0, 1])
def test_when_one_thread_fails_the_other_reads_no_further(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, first: int
) -> None:
    has_failed = threading.Event()
    read_by_the_other: list[int] = []

    def note(place: int) -> None:
        if place == first:
            has_failed.set()
            return
        read_by_the_other.append(place)
        assert has_failed.wait(10)
        time.sleep(0.01)

    failing_at(first, tmp_path / "v.npy", monkeypatch, note)
    load_and_fail(tmp_path / "v.npy", 40)
    # As long as it would take for all of them.
    time.sleep(0.3)
    assert len(read_by_the_other) < 10


class AdvisedMap:
    def __init__(self) -> None:
        self.advised: list[tuple[int, int, int]] = []

    def madvise(self, advice: int, start: int, length: int) -> None:
        self.advised.append((advice, start, length))


@pytest.mark.skipif(not hasattr(mmap, "MADV_WILLNEED"), reason="the system takes no such advice")
def test_whole_pages_are_asked_for(tmp_path: Path) -> None:
    page = mmap.PAGESIZE
    array = np.zeros((3, 4, 50 * page), np.uint8)
    storage = mapped(tmp_path / "v.raw", array, 128)
    recorder = AdvisedMap()
    storage._open = (recorder, array)  # type: ignore[assignment]
    storage.prefetch((slice(1, 3, 1), slice(2, 3, 1), slice(10, 20, 1)))
    # The system refuses advice about anything else, and nobody would notice.
    assert recorder.advised == [
        (mmap.MADV_WILLNEED, 300 * page, 148),
        (mmap.MADV_WILLNEED, 500 * page, 148),
    ]


@pytest.mark.skipif(not hasattr(os, "RWF_NOWAIT"), reason="the system does not say what is in memory")
@pytest.mark.parametrize("missing", [None, 0, 150, 199])
def test_rows_that_are_in_memory_are_not_asked_for_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: int | None
) -> None:
    row = 5 * mmap.PAGESIZE
    array = np.zeros((2, 100, row), np.uint8)
    storage = mapped(tmp_path / "v.raw", array, 0)
    recorder = AdvisedMap()
    storage._open = (recorder, array)  # type: ignore[assignment]
    looked_at: list[int] = []

    def preadv(_file: int, buffers: list[bytearray], offset: int, _flags: int) -> int:
        looked_at.append(offset)
        if missing is not None and offset // row >= missing:
            raise BlockingIOError
        return len(buffers)

    monkeypatch.setattr(os, "preadv", preadv)
    storage.prefetch((slice(0, 2, 1), slice(0, 100, 1), slice(10, 20, 1)))

    assert len(recorder.advised) == (0 if missing is None else 200)
    assert len(looked_at) <= 100
    # A few pieces are asked for whatever there is.
    storage.prefetch((slice(0, 2, 1), slice(0, 10, 1), slice(10, 20, 1)))
    assert len(recorder.advised) == (20 if missing is None else 220)


@pytest.mark.skipif(not hasattr(mmap, "MADV_WILLNEED"), reason="the system takes no such advice")
def test_rows_are_asked_for_as_they_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    array = np.zeros((4, 100, 5 * mmap.PAGESIZE), np.uint8)
    storage = mapped(tmp_path / "v.raw", array, 0)
    recorder = AdvisedMap()
    storage._open = (recorder, array)  # type: ignore[assignment]
    monkeypatch.setattr(mapping._OpenFile, "has_in_memory", lambda _file, _offset: False)
    find, held = MappedStorage._spans, []

    def spans(self: MappedStorage, array: Any, region: Any) -> Any:
        for found, span in enumerate(find(self, array, region)):
            held.append(found - len(recorder.advised))
            yield span

    monkeypatch.setattr(MappedStorage, "_spans", spans)
    storage.prefetch((slice(0, 4, 1), slice(0, 100, 1), slice(10, 20, 1)))
    assert len(recorder.advised) == len(held) == 400
    assert max(held) < 100


@given(shape=st.tuples(*[st.integers(2, 12)] * 3), order=st.sampled_from("CF"), step=st.integers(1, 3))
def test_what_is_looked_at_is_of_the_region_from_its_first_byte_to_its_last_row(
    tmp_path_factory: pytest.TempPathFactory, shape: tuple[int, int, int], order: str, step: int
) -> None:
    array = np.zeros(shape, ">u2", order=order)
    storage = mapped(tmp_path_factory.mktemp("mapped") / "v.raw", array, 7)
    region = tuple(slice(length // 3, length, step) for length in shape)
    marked = np.zeros(shape, np.uint8, order=order)
    marked[region] = 1
    wanted = 7 + 2 * np.flatnonzero(marked.ravel(order="K"))
    probes = list(storage._probes(storage._open[1], region))
    assert set(probes) <= set(wanted)
    assert probes == sorted(probes)
    assert probes[0] == wanted[0]
    fast = array[region].shape[2 if order == "C" else 0]
    assert probes[-1] == wanted[-fast]


def test_asking_may_fail_without_harm(
    write, tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = open_volume(write(tmp_path, ramp))
    # Where the system has no such advice.
    monkeypatch.delattr(mmap, "MADV_WILLNEED", raising=False)
    np.testing.assert_array_equal(opened.slice_plane(1, 2), ramp[:, 2])
    # Where it refuses the advice.
    monkeypatch.setattr(mmap, "MADV_WILLNEED", 999_999, raising=False)
    np.testing.assert_array_equal(opened.slice_plane(2, 2), ramp[:, :, 2])
    opened.close()
    with pytest.raises(VolumeError, match="closed"):
        opened.slice_plane(0, 0)


def test_a_file_that_ends_early_is_refused(tmp_path: Path) -> None:
    (tmp_path / "v.raw").write_bytes(bytes(99))
    with (
        (tmp_path / "v.raw").open("rb") as stream,
        pytest.raises(VolumeError, match="110 bytes and there are 99"),
    ):
        MappedStorage.of_stream(
            stream, where=tmp_path / "v.raw", dtype=np.dtype("u1"), shape=(10, 1, 10), offset=10
        )
