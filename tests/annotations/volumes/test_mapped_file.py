import mmap
import os
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from annotations.volumes import mapped_file
from annotations.volumes.mapped_file import MappedFile

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a file is let go as it is")

BYTES = np.random.default_rng(5).integers(0, 256, 70 * mmap.PAGESIZE + 17, dtype=np.uint8)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "v.raw"
    path.write_bytes(BYTES.tobytes())
    return path


def mapped(path: Path, length: int = len(BYTES)) -> MappedFile:
    with path.open("rb") as stream:
        return MappedFile.of_stream(stream, length)


def kib_in_memory(path: Path) -> int:
    """Return how much of a file this process has in its memory, 0 where it is not mapped."""
    lines = iter(Path("/proc/self/smaps").read_text().splitlines())
    for line in lines:
        if line.endswith(str(path)):
            return next(int(each.split()[1]) for each in lines if each.startswith("Rss:"))
    return 0


def is_mapped(path: Path) -> bool:
    return str(path) in Path("/proc/self/maps").read_text()


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def wait_until_gone(path: Path) -> None:
    ends_s = time.monotonic() + 10
    while is_mapped(path):
        assert time.monotonic() < ends_s
        time.sleep(0.001)


def test_the_beginning_of_a_file_is_read(path: Path) -> None:
    np.testing.assert_array_equal(np.frombuffer(mapped(path), np.uint8), BYTES)
    np.testing.assert_array_equal(np.frombuffer(mapped(path, 100), np.uint8), BYTES[:100])


@linux_only
@pytest.mark.parametrize("pages", [1, 32, 70, 71, 1000])
def test_released_pages_hold_no_memory_and_are_read_anew(
    path: Path, monkeypatch: pytest.MonkeyPatch, pages: int
) -> None:
    portion = pages * mmap.PAGESIZE
    file = mapped(path)
    lengths = []

    def noted(address: int, length: int, advice: int) -> int:
        # The thread may be at another file just then.
        if file._address <= address < file._address + len(BYTES):
            lengths.append(length)
        return madvise(address, length, advice)

    madvise = mapped_file._madvise
    monkeypatch.setattr(mapped_file, "_madvise", noted)
    monkeypatch.setattr(mapped_file, "_PORTION_BYTES", portion)
    view = np.frombuffer(file, np.uint8)
    np.testing.assert_array_equal(view, BYTES)
    assert kib_in_memory(path) >= len(BYTES) // 1024
    file.release_pages()
    assert kib_in_memory(path) == 0
    assert max(lengths) <= portion
    assert sum(lengths) == len(BYTES)
    np.testing.assert_array_equal(view, BYTES)


@linux_only
def test_a_file_goes_with_its_last_view_in_a_thread_that_nobody_waits_for(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    released: list[tuple[int, threading.Thread]] = []
    file = mapped(path)
    address = file._address

    def noted(file: MappedFile) -> None:
        if file._address == address:
            released.append((kib_in_memory(path), threading.current_thread()))
        release_pages(file)

    release_pages = MappedFile.release_pages
    monkeypatch.setattr(MappedFile, "release_pages", noted)
    part = np.frombuffer(file, np.uint8)[::2]
    assert part.max() == 255
    del file
    assert is_mapped(path)
    assert not released
    del part
    wait_until_gone(path)
    [(held_kib, thread)] = released
    assert held_kib >= len(BYTES) // 1024
    assert thread is not threading.current_thread()


@linux_only
def test_few_files_wait_to_be_let_go(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    may_go, here, threads = threading.Event(), threading.current_thread(), []

    def slow(file: MappedFile) -> None:
        threads.append(threading.current_thread())
        if threads[-1] is not here:
            assert may_go.wait(10)
        release_pages(file)

    release_pages = MappedFile.release_pages
    monkeypatch.setattr(MappedFile, "release_pages", slow)
    open_before = open_files()
    for _ in range(50):
        mapped(path)
    # One is being let go.
    assert open_files() <= open_before + mapped_file._MOST_WAITING + 1
    assert threads.count(here) >= 45
    may_go.set()
    wait_until_gone(path)


@linux_only
def test_a_file_that_was_closed_goes_without_a_word(path: Path) -> None:
    with mapped(path) as file:
        assert file[0] == BYTES[0]
    assert not is_mapped(path)
    file.release_pages()
    del file
    # The thread has been there when a later one is gone.
    mapped(path)
    wait_until_gone(path)


@linux_only
@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_a_forked_process_lets_its_files_go_too(path: Path) -> None:
    mapped(path)
    wait_until_gone(path)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            mapped(path)
            wait_until_gone(path)
            code = 0
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
