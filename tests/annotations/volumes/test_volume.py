import threading
from pathlib import Path

import numpy as np
import pytest

from annotations.volumes import VolumeError, open_volume

WHOLE = (slice(None), slice(None), slice(None))


def test_a_closed_volume_says_so_and_closes_again(write, tmp_path: Path, ramp: np.ndarray) -> None:
    path = write(tmp_path, ramp)
    volume = open_volume(path)
    kept = volume.read(WHOLE)
    with volume:
        pass
    volume.close()
    with pytest.raises(VolumeError, match="closed") as caught:
        volume.read(WHOLE)
    assert str(path) in str(caught.value)
    np.testing.assert_array_equal(kept, ramp)


def test_several_threads_read_at_once(write, tmp_path: Path) -> None:
    array = np.arange(40 * 30 * 20, dtype=np.uint32).reshape(40, 30, 20)
    volume = open_volume(write(tmp_path, array))
    start = threading.Barrier(4)
    wrong: list[int] = []

    def read_planes(offset: int) -> None:
        start.wait()
        wrong.extend(
            index
            for index in range(offset, 40, 4)
            if not np.array_equal(volume.slice_plane(0, index), array[index])
        )

    threads = [threading.Thread(target=read_planes, args=(offset,)) for offset in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_nothing_handed_out_writes_to_the_file(tmp_path: Path, ramp: np.ndarray) -> None:
    np.save(tmp_path / "v.npy", ramp)
    before = (tmp_path / "v.npy").read_bytes()
    view = open_volume(tmp_path / "v.npy").read(WHOLE)
    with pytest.raises(ValueError, match="read-only"):
        view[0, 0, 0] = 1
    assert (tmp_path / "v.npy").read_bytes() == before


def test_truth_values_of_a_damaged_file_become_zero_or_one(tmp_path: Path) -> None:
    path = tmp_path / "v.npy"
    np.save(path, np.zeros((2, 2, 2), bool))
    with path.open("r+b") as stream:
        stream.seek(-1, 2)
        stream.write(b"\x07")
    volume = open_volume(path)
    assert volume.dtype == np.uint8
    assert volume.read(WHOLE).ravel().tolist() == [0] * 7 + [1]


@pytest.mark.parametrize("step", [0, -1])
def test_steps_are_positive(tmp_path: Path, ramp: np.ndarray, step: int) -> None:
    np.save(tmp_path / "v.npy", ramp)
    with pytest.raises(ValueError, match=r"positive|zero"):
        open_volume(tmp_path / "v.npy").read((slice(None), slice(None, None, step), slice(None)))


@pytest.mark.parametrize(("axis", "index"), [(0, 5), (1, -1), (2, 7)])
def test_a_plane_that_does_not_exist_is_refused(
    tmp_path: Path, ramp: np.ndarray, axis: int, index: int
) -> None:
    np.save(tmp_path / "v.npy", ramp)
    with pytest.raises(IndexError, match=f"plane {index}"):
        open_volume(tmp_path / "v.npy").slice_plane(axis, index)


def test_an_error_of_the_disk_names_the_file(
    tmp_path: Path, ramp: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save(tmp_path / "v.npy", ramp)
    volume = open_volume(tmp_path / "v.npy")

    def fail(region: object) -> np.ndarray:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(volume._storage, "read", fail)
    with pytest.raises(VolumeError, match="Input/output error") as caught:
        volume.read(WHOLE)
    assert str(tmp_path / "v.npy") in str(caught.value)
