import os
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest

from annotations.volumes import Level, LevelCache, Volume, averaged_level, open_volume

SPACING_UM = (15.9, 13.5, 9.4)
BUDGET = 2000


def saved(path: Path, seed: int = 0) -> Volume:
    np.save(path, np.random.default_rng(seed).integers(0, 255, (20, 30, 40), np.uint8))
    return open_volume(path)


def built(volume: Volume) -> Level:
    return averaged_level(
        volume, SPACING_UM, budget_voxels=BUDGET, progress=lambda _: None, cancelled=lambda: False
    )


@pytest.fixture
def cache(tmp_path: Path) -> LevelCache:
    return LevelCache(tmp_path / "cache" / "levels", 1 << 20)


def kept_files(cache: LevelCache) -> list[Path]:
    return sorted(cache.folder.glob("*.level.h5"))


def test_a_level_comes_back_as_it_was(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)
    assert cache.load(volume, SPACING_UM, BUDGET) is None
    cache.store(volume, SPACING_UM, BUDGET, level)
    found = LevelCache(cache.folder, cache.limit_bytes).load(
        open_volume(tmp_path / "v.npy"), SPACING_UM, BUDGET
    )
    assert found is not None
    np.testing.assert_array_equal(found.data, level.data)
    assert found.data.dtype == level.data.dtype
    assert found.data.flags.f_contiguous
    assert (found.spacing_um, found.origin_um, found.factors, found.kind) == (
        level.spacing_um,
        level.origin_um,
        level.factors,
        "averaged",
    )
    assert list(cache.folder.iterdir()) == kept_files(cache)


def test_other_parameters_are_another_level(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    cache.store(volume, SPACING_UM, BUDGET, built(volume))
    assert cache.load(volume, (15.9, 13.5, 9.5), BUDGET) is None
    assert cache.load(volume, SPACING_UM, BUDGET + 1) is None
    assert cache.load(saved(tmp_path / "other.npy"), SPACING_UM, BUDGET) is None


def test_datasets_of_one_file_have_levels_of_their_own(cache: LevelCache, tmp_path: Path) -> None:
    np.savez(tmp_path / "v.npz", a=np.zeros((5, 5, 5)), b=np.ones((5, 5, 5)))
    first, second = (open_volume(tmp_path / "v.npz", dataset=name) for name in "ab")
    cache.store(first, SPACING_UM, BUDGET, built(first))
    assert cache.load(second, SPACING_UM, BUDGET) is None
    assert cache.load(first, SPACING_UM, BUDGET) is not None


def test_a_changed_file_does_not_meet_its_old_level(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    cache.store(volume, SPACING_UM, BUDGET, built(volume))
    state = (tmp_path / "v.npy").stat()
    volume = saved(tmp_path / "v.npy", seed=1)
    os.utime(tmp_path / "v.npy", ns=(state.st_atime_ns, state.st_mtime_ns + 1))
    assert cache.load(volume, SPACING_UM, BUDGET) is None


def test_a_changed_block_of_a_folder_counts(cache: LevelCache, writers, tmp_path: Path) -> None:
    path = writers["zarr 3"](tmp_path, np.ones((6, 6, 6), np.uint8))
    volume = open_volume(path)
    cache.store(volume, SPACING_UM, BUDGET, built(volume))
    assert cache.load(volume, SPACING_UM, BUDGET) is not None
    block = next(each for each in (path / "c").rglob("*") if each.is_file())
    os.utime(block, ns=(0, block.stat().st_mtime_ns + 10**12))
    assert cache.load(volume, SPACING_UM, BUDGET) is None


def flip_a_byte(path: Path) -> None:
    with h5py.File(path, "r") as file:
        chunk = file["data"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(content)


def write_another_kind(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["data"] = np.zeros((2, 2, 2))


def write_other_axes(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["data"]
        file["data"] = np.zeros((2, 2))


@pytest.mark.parametrize(
    "damage",
    [
        flip_a_byte,
        write_another_kind,
        write_other_axes,
        lambda path: path.write_bytes(b""),
        lambda path: path.write_text("no HDF5"),
        lambda path: os.truncate(path, path.stat().st_size // 2),
    ],
    ids=["a flipped bit", "no level", "other axes", "empty", "foreign", "truncated"],
)
def test_a_damaged_level_is_dropped_and_made_again(cache: LevelCache, tmp_path: Path, damage) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)
    cache.store(volume, SPACING_UM, BUDGET, level)
    (path,) = kept_files(cache)
    damage(path)
    assert cache.load(volume, SPACING_UM, BUDGET) is None
    assert not path.exists()
    cache.store(volume, SPACING_UM, BUDGET, level)
    assert cache.load(volume, SPACING_UM, BUDGET) is not None


def test_the_least_recently_used_levels_go(cache: LevelCache, tmp_path: Path) -> None:
    volumes = [saved(tmp_path / f"v{number}.npy", number) for number in range(4)]
    cache.store(volumes[0], SPACING_UM, BUDGET, built(volumes[0]))
    (path,) = kept_files(cache)
    cache = LevelCache(cache.folder, int(3.5 * path.stat().st_size))
    for age, volume in enumerate(volumes[:3]):
        before = set(kept_files(cache))
        cache.store(volume, SPACING_UM, BUDGET, built(volume))
        (new,) = set(kept_files(cache)) - before or {path}
        os.utime(new, (1000 + age, 1000 + age))
    assert cache.load(volumes[0], SPACING_UM, BUDGET) is not None
    cache.store(volumes[3], SPACING_UM, BUDGET, built(volumes[3]))
    present = [cache.load(volume, SPACING_UM, BUDGET) is not None for volume in volumes]
    assert present == [True, False, True, True]


def test_a_level_larger_than_the_limit_is_not_kept(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    small = LevelCache(cache.folder, 10)
    small.store(volume, SPACING_UM, BUDGET, built(volume))
    assert small.load(volume, SPACING_UM, BUDGET) is None
    assert not cache.folder.exists()


def test_other_files_in_the_folder_are_left_alone(cache: LevelCache, tmp_path: Path) -> None:
    cache.folder.mkdir(parents=True)
    (cache.folder / "letter.txt").write_text("x" * 5000)
    stale, fresh = cache.folder / "a.level.part", cache.folder / "b.level.part"
    stale.touch()
    os.utime(stale, (1000, 1000))
    fresh.touch()
    volume = saved(tmp_path / "v.npy")
    LevelCache(cache.folder, 4000).store(volume, SPACING_UM, BUDGET, built(volume))
    assert (cache.folder / "letter.txt").exists()
    assert not stale.exists()
    assert fresh.exists()


def test_a_folder_that_cannot_be_written_costs_nothing(
    cache: LevelCache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)
    monkeypatch.setattr(Path, "mkdir", lambda *_, **__: (_ for _ in ()).throw(PermissionError(13, "denied")))
    cache.store(volume, SPACING_UM, BUDGET, level)
    assert "could not be kept" in caplog.text
    assert cache.load(volume, SPACING_UM, BUDGET) is None


def test_a_full_disk_leaves_no_half_a_level(
    cache: LevelCache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)

    def fail(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(h5py.File, "create_dataset", fail)
    cache.store(volume, SPACING_UM, BUDGET, level)
    assert list(cache.folder.iterdir()) == []


def test_a_missing_volume_has_no_level(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)
    (tmp_path / "v.npy").unlink()
    assert cache.load(volume, SPACING_UM, BUDGET) is None
    cache.store(volume, SPACING_UM, BUDGET, level)
    assert not cache.folder.exists()


def test_a_folder_is_used_from_several_sides_at_once(cache: LevelCache, tmp_path: Path) -> None:
    volume = saved(tmp_path / "v.npy")
    level = built(volume)
    start = threading.Barrier(4)
    wrong: list[object] = []

    def use() -> None:
        own = LevelCache(cache.folder, cache.limit_bytes)
        start.wait()
        for _ in range(10):
            own.store(volume, SPACING_UM, BUDGET, level)
            found = own.load(volume, SPACING_UM, BUDGET)
            if found is None or not np.array_equal(found.data, level.data):
                wrong.append(found)

    threads = [threading.Thread(target=use) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert len(kept_files(cache)) == 1
