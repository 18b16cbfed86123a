"""A folder that receives volumes: what is taken for whole, and when."""

import os
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import tifffile
import zarr

from annotations.prediction.live import incoming as incoming_module
from annotations.prediction.live.arrival import Arrival, News, Unfinished
from annotations.prediction.live.incoming import (
    ABANDONED_S,
    PATIENCE_S,
    QUIET_BLANK_S,
    QUIET_FILE_S,
    QUIET_FOLDER_S,
    QUIET_HELD_S,
    QUIET_NPY_S,
    IncomingFolder,
)
from annotations.volumes import VolumeError, write_folder_answer, write_sidecar

SHAPE = (4, 30, 20)
VOXELS = np.random.default_rng(1).integers(0, 255, SHAPE, dtype=np.uint8)


class Clock:
    """A clock that goes on when it is told to; file systems keep their own time, which is about the same."""

    def __init__(self) -> None:
        self.now_s = 2_000_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "incoming"
    path.mkdir()
    return path


@pytest.fixture
def incoming(folder: Path, clock: Clock) -> IncomingFolder:
    source = IncomingFolder(folder, clock)
    assert source.look() == News()
    return source


def npy_bytes(tmp_path: Path, voxels: np.ndarray = VOXELS) -> bytes:
    path = tmp_path / "whole.npy"
    np.save(path, voxels)
    return path.read_bytes()


def in_place(path: Path, content: bytes) -> None:
    """Write a file, such that its time of change is that of its last write, as its writer leaves it."""
    path.write_bytes(content)


def names(news: News) -> list[str]:
    return [arrival.volume_path.name for arrival in news.arrivals]


def after(clock: Clock, seconds: float, source: IncomingFolder) -> News:
    # The last digits are lost in rounding.
    clock.now_s += seconds + 1e-6
    return source.look()


def moved_in(tmp_path: Path, path: Path, content: bytes) -> None:
    elsewhere = tmp_path / f"elsewhere{path.suffix}"
    elsewhere.write_bytes(content)
    written_ns = elsewhere.stat().st_mtime_ns - 50_000_000
    # As if it had been written a moment ago: the renaming is later.
    os.utime(elsewhere, ns=(written_ns, written_ns))
    elsewhere.rename(path)


def test_a_volume_that_is_moved_in_is_taken_at_once(
    incoming: IncomingFolder, folder: Path, tmp_path: Path
) -> None:
    moved_in(tmp_path, folder / "v1.npy", npy_bytes(tmp_path))

    [arrival] = incoming.look().arrivals

    assert arrival.volume_path == folder / "v1.npy"
    assert (arrival.shape, arrival.spacing_um, arrival.depth_axis) == (SHAPE, None, 2)
    assert arrival.is_timed
    assert incoming.look() == News()


def test_a_volume_written_in_place_within_a_moment_is_taken_when_it_has_stayed_so(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    in_place(folder / "v1.npy", npy_bytes(tmp_path))

    assert incoming.look() == News()
    assert after(clock, QUIET_NPY_S / 2, incoming) == News()
    assert names(after(clock, QUIET_NPY_S, incoming)) == ["v1.npy"]


def test_a_volume_that_grows_is_taken_as_soon_as_it_has_the_length_that_it_promises(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    content, path = npy_bytes(tmp_path), folder / "v1.npy"
    with path.open("wb") as stream:
        for end in (0, 40, 300, 900, len(content) - 1):
            stream.write(content[stream.tell() : end])
            stream.flush()
            # However long it takes.
            assert after(clock, 10 * PATIENCE_S if end in (40, 900) else 0.01, incoming).arrivals == ()
        stream.write(content[-1:])
    assert names(incoming.look()) == ["v1.npy"]


@pytest.fixture(params=["says who writes", "does not say"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Systems that can say whether somebody has a file open for writing, and those that cannot."""
    if request.param == "does not say":
        monkeypatch.setattr(incoming_module, "has_writer", lambda _path: None)
    return str(request.param)


def written(path: Path, end: int) -> None:
    """Give a file a time of its own: clocks of file systems may be too coarse to tell writes apart."""
    moment_ns = path.stat().st_ctime_ns + end * 1_000_000_000
    os.utime(path, ns=(moment_ns, moment_ns))


@pytest.mark.usefixtures("system")
def test_space_that_is_reserved_is_not_taken_for_a_volume(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    content, path = npy_bytes(tmp_path), folder / "v1.npy"
    with path.open("wb") as stream:
        stream.write(content[:200])
        stream.truncate(len(content))
        stream.flush()
        for end in (400, 800, 1200, len(content)):
            # Far slower than a file that is whole would be waited for.
            assert after(clock, 3 * QUIET_NPY_S, incoming) == News()
            stream.write(content[stream.tell() : end])
            stream.flush()
            written(path, end)
    assert incoming.look() == News()
    assert after(clock, 3 * QUIET_NPY_S, incoming) == News()
    # Several of the pauses that its writer made.
    assert names(after(clock, 10 * QUIET_NPY_S, incoming)) == ["v1.npy"]


@pytest.mark.usefixtures("system")
def test_a_file_that_is_written_through_a_mapping_is_shown_once(folder: Path) -> None:
    source, shown = IncomingFolder(folder), []
    source.look()
    voxels = np.lib.format.open_memmap(folder / "v1.npy", mode="w+", dtype=np.uint8, shape=(8, 80, 64))
    for plane in range(len(voxels)):
        until_s = time.monotonic() + 0.05
        while time.monotonic() < until_s:
            shown += source.look().arrivals
            time.sleep(0.003)
        assert shown == []
        voxels[plane] = 1 + plane
    del voxels
    until_s = time.monotonic() + 0.6
    while time.monotonic() < until_s:
        shown += source.look().arrivals
        time.sleep(0.003)

    assert [arrival.volume_path.name for arrival in shown] == ["v1.npy"]


def test_a_file_that_somebody_has_open_is_waited_for_and_told(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    holds = {"blank.npy": True, "full.npy": True}
    monkeypatch.setattr(incoming_module, "has_writer", lambda path: holds[path.name])
    in_place(folder / "full.npy", npy_bytes(tmp_path))
    in_place(folder / "blank.npy", npy_bytes(tmp_path, np.zeros(SHAPE, dtype=np.uint8)))

    assert incoming.look() == News()
    assert after(clock, 2 * QUIET_NPY_S, incoming) == News()
    assert names(after(clock, QUIET_HELD_S, incoming)) == ["full.npy"]
    assert after(clock, ABANDONED_S / 2, incoming).unfinished == (Unfinished(folder / "blank.npy", None),)
    holds["blank.npy"] = False
    # As some file systems have it for a file of zeros: it is not known to be filled.
    assert names(after(clock, QUIET_BLANK_S, incoming)) == ["blank.npy"]
    assert incoming.look() == News()


def test_what_a_shown_file_holds_next_is_another_volume_once_it_rests(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(incoming_module, "has_writer", lambda _path: None)
    path = folder / "ring.npy"
    in_place(path, npy_bytes(tmp_path))
    incoming.look()
    assert names(after(clock, QUIET_NPY_S, incoming)) == ["ring.npy"]
    with path.open("r+b") as stream:
        for end in (500, 1000, 1500):
            stream.seek(end)
            stream.write(b"changed")
            stream.flush()
            written(path, end)
            assert after(clock, 2 * QUIET_NPY_S, incoming) == News()

    assert after(clock, 2 * QUIET_NPY_S, incoming) == News()
    assert names(after(clock, QUIET_FILE_S, incoming)) == ["ring.npy"]
    assert incoming.look() == News()


def test_what_its_times_do_not_tell_is_noticed_by_its_content(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    path = folder / "v1.npy"
    in_place(path, npy_bytes(tmp_path))
    written(path, 1)
    moment_ns = path.stat().st_mtime_ns
    assert incoming.look() == News()
    with path.open("r+b") as stream:
        stream.seek(1000)
        stream.write(b"through a mapping")
    os.utime(path, ns=(moment_ns, moment_ns))

    assert after(clock, QUIET_NPY_S, incoming) == News()
    # Several times as long as it took to notice it.
    assert names(after(clock, 5 * QUIET_NPY_S, incoming)) == ["v1.npy"]


def test_a_pause_in_writing_is_told_for_as_long_as_it_lasts(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    content, path = npy_bytes(tmp_path), folder / "v1.npy"
    header = len(content) - VOXELS.nbytes
    in_place(path, content[: header + VOXELS.nbytes // 4])

    assert incoming.look() == News()
    for _ in range(3):
        assert after(clock, ABANDONED_S, incoming) == News(unfinished=(Unfinished(path, 0.25),))

    in_place(path, content)
    assert names(incoming.look()) == ["v1.npy"]
    assert incoming.look() == News()


def test_another_format_that_was_seen_being_written_is_waited_for(
    incoming: IncomingFolder, folder: Path, clock: Clock, tmp_path: Path
) -> None:
    tifffile.imwrite(tmp_path / "whole.tif", VOXELS, photometric="minisblack")
    content, path = (tmp_path / "whole.tif").read_bytes(), folder / "v1.tif"
    for end in (4, 900):
        in_place(path, content[:end])
        assert after(clock, 0.1, incoming) == News()

    told = after(clock, 3 * PATIENCE_S, incoming)
    assert (told.errors, told.unfinished) == ((), (Unfinished(path, None),))
    assert len(after(clock, ABANDONED_S, incoming).errors) == 1


def test_a_wrong_file_is_told_once_and_the_others_are_shown(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    in_place(folder / "a.npy", b"No volume at all")
    moved_in(tmp_path, folder / "b.npy", npy_bytes(tmp_path))
    in_place(folder / "notes.txt", b"Nobody reads this")
    in_place(folder / ".hidden.npy", npy_bytes(tmp_path))
    (folder / "predictions").mkdir()

    assert names(incoming.look()) == ["b.npy"]
    [error] = after(clock, PATIENCE_S, incoming).errors
    assert error.where == folder / "a.npy"
    assert after(clock, PATIENCE_S, incoming) == News()


def test_any_other_format_is_taken_once_it_rests_and_opens(
    incoming: IncomingFolder, folder: Path, clock: Clock
) -> None:
    np.savez(folder / "v1.npz", volume=VOXELS)
    with h5py.File(folder / "v2.h5", "w") as file:
        file["volume"] = VOXELS
    tifffile.imwrite(folder / "v3.tif", VOXELS, photometric="minisblack")
    zarr.save_array(folder / "v4.zarr", VOXELS)

    assert incoming.look() == News()
    assert sorted(names(after(clock, QUIET_FILE_S, incoming))) == ["v1.npz", "v2.h5", "v3.tif"]
    assert names(after(clock, QUIET_FOLDER_S, incoming)) == ["v4.zarr"]


def test_a_zarr_volume_whose_chunks_still_come_is_waited_for(
    incoming: IncomingFolder, folder: Path, clock: Clock
) -> None:
    array = zarr.create_array(folder / "v1.zarr", shape=SHAPE, chunks=(1, 30, 20), dtype="uint8")
    for plane in range(SHAPE[0]):
        array[plane] = VOXELS[plane] + 1
        assert after(clock, QUIET_FOLDER_S * 0.8, incoming).arrivals == ()
    # Several of the pauses between its chunks.
    assert after(clock, QUIET_FOLDER_S, incoming).arrivals == ()
    assert names(after(clock, 3 * QUIET_FOLDER_S, incoming)) == ["v1.zarr"]


def test_of_what_is_there_before_the_newest_alone_is_shown_and_not_timed(
    folder: Path, tmp_path: Path, clock: Clock
) -> None:
    for number, age_s in ((1, 30), (2, 10), (3, 20)):
        path = folder / f"v{number}.npy"
        in_place(path, npy_bytes(tmp_path))
        moment_ns = path.stat().st_mtime_ns + int((100 - age_s) * 1e9)
        os.utime(path, ns=(moment_ns, moment_ns))
    source = IncomingFolder(folder, clock)

    found = [*source.look().arrivals, *after(clock, QUIET_NPY_S, source).arrivals]

    assert [(arrival.volume_path.name, arrival.is_timed) for arrival in found] == [("v2.npy", False)]


def test_a_name_that_is_used_again_is_another_volume(
    incoming: IncomingFolder, folder: Path, tmp_path: Path
) -> None:
    for fill in (1, 2, 3):
        moved_in(tmp_path, folder / "ring.npy", npy_bytes(tmp_path, np.full(SHAPE, fill, dtype=np.uint8)))
        assert names(incoming.look()) == ["ring.npy"]
        assert incoming.look() == News()


def test_a_volume_that_is_gone_before_it_is_whole_is_no_error(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    in_place(folder / "v1.npy", npy_bytes(tmp_path)[:-10])
    assert incoming.look() == News()
    (folder / "v1.npy").unlink()

    assert after(clock, PATIENCE_S, incoming) == News()


def test_spacing_comes_from_beside_the_volume(incoming: IncomingFolder, folder: Path, tmp_path: Path) -> None:
    write_folder_answer(folder, SHAPE, (600.0, 20.0, 10.0), 1)
    write_sidecar(folder / "v2.npy", (500.0, 10.0, 5.0), 2)
    for name in ("v1.npy", "v2.npy"):
        moved_in(tmp_path, folder / name, npy_bytes(tmp_path))

    told = {arrival.volume_path.name: _grid(arrival) for arrival in incoming.look().arrivals}

    assert told == {"v1.npy": ((600.0, 20.0, 10.0), 1), "v2.npy": ((500.0, 10.0, 5.0), 2)}


def test_it_appeared_between_the_looks_around_it(
    incoming: IncomingFolder, folder: Path, tmp_path: Path, clock: Clock
) -> None:
    before_s = clock.now_s
    clock.now_s += 1.0
    # By the file system it is of another time altogether, which is not believed.
    moved_in(tmp_path, folder / "v1.npy", npy_bytes(tmp_path))

    [arrival] = incoming.look().arrivals

    assert before_s <= arrival.appeared_s <= clock.now_s


def test_a_folder_that_is_gone_is_an_error(incoming: IncomingFolder, folder: Path) -> None:
    folder.rmdir()

    with pytest.raises(VolumeError, match="the folder that receives the volumes is gone"):
        incoming.look()


def test_a_folder_that_is_not_there_is_an_error_at_once(tmp_path: Path) -> None:
    with pytest.raises(VolumeError, match="does not exist"):
        IncomingFolder(tmp_path / "absent")


def _grid(arrival: Arrival) -> tuple[object, int]:
    return arrival.spacing_um, arrival.depth_axis
