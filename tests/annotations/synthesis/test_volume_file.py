import errno
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from annotations.durable_files import SaveError
from annotations.errors import Cancelled
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.synthesis.volume_file import write_volume


def scene_of(*shape: int) -> Scene:
    x, y, z = shape
    return random_scene(shipped_tools()["magnetic-forceps"], SceneSeed(1), Grid.over_workspace((x, y, z)))


def test_the_file_holds_the_scenes_planes(empty_folder: Path) -> None:
    scene = scene_of(9, 14, 11)

    write_volume(scene, empty_folder / "new" / "v.npy")

    np.testing.assert_array_equal(np.load(empty_folder / "new" / "v.npy"), np.stack(list(scene.planes())))
    assert [path.name for path in (empty_folder / "new").iterdir()] == ["v.npy"]


def test_progress_rises_to_one(empty_folder: Path) -> None:
    shares: list[float] = []

    write_volume(scene_of(9, 14, 11), empty_folder / "v.npy", shares.append)

    assert shares == pytest.approx(np.arange(1, 10) / 9)


def test_cancelling_leaves_nothing_behind(empty_folder: Path) -> None:
    shares: list[float] = []

    with pytest.raises(Cancelled):
        write_volume(scene_of(9, 14, 11), empty_folder / "v.npy", shares.append, lambda: len(shares) == 4)

    assert len(shares) == 4
    assert list(empty_folder.iterdir()) == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES])
def test_what_the_system_refuses_is_told_and_leaves_nothing_behind(
    empty_folder: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    path = empty_folder / "v.npy"
    path.write_bytes(b"what was there before")

    def refuse(_descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refuse)

    with pytest.raises(SaveError, match=os.strerror(number)) as caught:
        write_volume(scene_of(9, 14, 11), path)

    assert str(path) in str(caught.value)
    assert path.read_bytes() == b"what was there before"
    assert list(empty_folder.iterdir()) == [path]


def test_a_large_volume_needs_little_memory(empty_folder: Path) -> None:
    scene = scene_of(160, 484, 576)
    size = 160 * 484 * 576
    tracemalloc.start()
    try:
        write_volume(scene, empty_folder / "v.npy")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert (empty_folder / "v.npy").stat().st_size > size
    assert peak < size / 2
