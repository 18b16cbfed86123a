import shutil
from pathlib import Path

import numpy as np
import pytest

from annotations.volumes import Volume, fingerprint, open_volume
from annotations.volumes.volume import Storage


def saved(folder: Path, array: np.ndarray) -> str:
    np.save(folder / "v.npy", array)
    return fingerprint(open_volume(folder / "v.npy"))


def test_every_format_and_byte_order_of_a_volume_has_its_fingerprint(
    write, tmp_path: Path, ramp: np.ndarray
) -> None:
    expected = saved(tmp_path, ramp)
    assert len(expected) == 64
    (tmp_path / "big").mkdir()
    for path in (write(tmp_path, ramp), write(tmp_path / "big", ramp.astype(">u2"))):
        with open_volume(path) as volume:
            assert fingerprint(volume) == expected


def test_a_moved_copy_has_the_same_fingerprint(tmp_path: Path, ramp: np.ndarray) -> None:
    expected = saved(tmp_path, ramp)
    (tmp_path / "other").mkdir()
    shutil.copy(tmp_path / "v.npy", tmp_path / "other" / "renamed.npy")
    assert fingerprint(open_volume(tmp_path / "other" / "renamed.npy")) == expected


def test_shape_type_and_any_voxel_of_a_small_volume_count(tmp_path: Path) -> None:
    array = np.zeros((8, 9, 10), np.uint8)
    changed = array.copy()
    changed[3, 4, 5] = 1
    others = [changed, array.reshape(9, 8, 10), array.view(np.int8), np.zeros((8, 9, 11), np.uint8)]
    assert len({saved(tmp_path, each) for each in (array, *others)}) == 5


@pytest.mark.parametrize("shape", [(300, 200, 100), (3, 2000, 1000), (60_000, 10, 10), (2, 3, 1_000_000)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_of_a_large_volume_the_first_and_last_voxels_count(
    tmp_path: Path, shape: tuple[int, int, int], order: str
) -> None:
    array = np.zeros(shape, np.uint8, order=order)
    prints = [saved(tmp_path, array)]
    for index in (0, -1):
        array[index, index, index] = 1
        prints.append(saved(tmp_path, array))
        array[index, index, index] = 0
    assert len(set(prints)) == 3


@pytest.mark.parametrize("order", ["C", "F"])
def test_the_blocks_of_a_large_volume_are_runs_of_the_file(tmp_path: Path, order: str) -> None:
    """Change one byte at a time: within a block the fingerprint changes, between blocks it does not."""
    shape = (70, 400, 200)
    array = np.zeros(shape, np.uint8, order=order)
    total, run = array.size, 64 << 10
    flat = array.reshape(-1, order=order)
    assert np.shares_memory(flat, array)
    expected = saved(tmp_path, array)
    for block in (0, 1, 31, 62, 63):
        start = block * (total - run) // 63
        for place, counts in (
            (start - 1, False),
            (start, True),
            (start + run - 1, True),
            (start + run, False),
        ):
            if 0 <= place < total:
                flat[place] = 1
                assert (saved(tmp_path, array) != expected) is counts
                flat[place] = 0


class CountingStorage(Storage):
    def __init__(self, array: np.ndarray) -> None:
        self.array = array
        self.voxels = 0

    def read(self, region: tuple[slice, slice, slice]) -> np.ndarray:
        part = self.array[region]
        self.voxels += part.size
        return part

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    "shape", [(1096, 1936, 1152), (28, 1936, 1152), (500_000, 30, 30), (4, 5, 60_000_000)]
)
@pytest.mark.parametrize("fortran_order", [False, True])
def test_no_more_of_a_large_volume_is_read(shape: tuple[int, int, int], fortran_order: bool) -> None:
    if fortran_order:
        shape = (shape[2], shape[1], shape[0])
    storage = CountingStorage(np.broadcast_to(np.uint8(0), shape))
    volume = Volume(
        path=Path("v.npy"),
        dataset=None,
        format="npy",
        shape=shape,
        dtype=np.dtype(np.uint8),
        file_dtype="|u1",
        spacing_um=None,
        spacing_source=None,
        depth_axis=2,
        chunks=None,
        fortran_order=fortran_order,
        _storage=storage,
    )
    fingerprint(volume)
    assert storage.voxels == 64 * (64 << 10)


@pytest.mark.parametrize("fortran_order", [False, True])
def test_all_is_asked_for_before_any_of_it_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fortran_order: bool
) -> None:
    array = np.zeros((70, 300, 300), np.uint8)
    np.save(tmp_path / "v.npy", np.asfortranarray(array) if fortran_order else array)
    volume = open_volume(tmp_path / "v.npy")
    storage = volume._storage
    calls: list[tuple[str, object]] = []
    read, prefetch = storage.read, storage.prefetch
    monkeypatch.setattr(storage, "read", lambda region: (calls.append(("read", region)), read(region))[1])
    monkeypatch.setattr(
        storage, "prefetch", lambda region: (calls.append(("prefetch", region)), prefetch(region))[1]
    )
    fingerprint(volume)
    asked = [region for kind, region in calls if kind == "prefetch"]
    assert calls == [*(("prefetch", region) for region in asked), *(("read", region) for region in asked)]
    assert len(asked) >= 64
