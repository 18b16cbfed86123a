import mmap
import sys
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


def test_the_beginning_of_a_file_is_read(path: Path) -> None:
    np.testing.assert_array_equal(np.frombuffer(mapped(path), np.uint8), BYTES)
    np.testing.assert_array_equal(np.frombuffer(mapped(path, 100), np.uint8), BYTES[:100])


@linux_only
@pytest.mark.parametrize("pages", [1, 32, 70, 71, 1000])
def test_an_emptied_file_holds_no_memory_and_is_read_anew(
    path: Path, monkeypatch: pytest.MonkeyPatch, pages: int
) -> None:
    monkeypatch.setattr(mapped_file, "_PORTION_BYTES", pages * mmap.PAGESIZE)
    file = mapped(path)
    view = np.frombuffer(file, np.uint8)
    np.testing.assert_array_equal(view, BYTES)
    assert kib_in_memory(path) >= len(BYTES) // 1024
    file.empty()
    assert kib_in_memory(path) == 0
    np.testing.assert_array_equal(view, BYTES)


@linux_only
def test_a_file_is_emptied_with_its_last_view_and_not_before(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held_kib = []

    def empty(file: MappedFile) -> None:
        held_kib.append(kib_in_memory(path))
        emptied(file)
        held_kib.append(kib_in_memory(path))

    emptied = MappedFile.empty
    monkeypatch.setattr(MappedFile, "empty", empty)
    file = mapped(path)
    part = np.frombuffer(file, np.uint8)[::2]
    assert part.max() == 255
    del file
    assert not held_kib
    del part
    assert held_kib == [pytest.approx(len(BYTES) / 1024, abs=4), 0]
    assert str(path) not in Path("/proc/self/maps").read_text()
