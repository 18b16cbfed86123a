"""Whether somebody may still write into a file."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from annotations.prediction.live.writers import has_writer

ONLY_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="other systems say nothing")


@ONLY_LINUX
def test_a_file_that_is_open_for_writing_or_mapped_has_a_writer(tmp_path: Path) -> None:
    path = tmp_path / "v1.npy"
    np.save(path, np.ones((4, 5, 6)))
    if has_writer(path) is None:
        pytest.skip("this file system says nothing")
    with path.open("rb"):
        assert has_writer(path) is False
    with path.open("r+b"):
        assert has_writer(path) is True
    voxels = np.load(path, mmap_mode="r+")
    assert has_writer(path) is True
    del voxels
    assert has_writer(path) is False


def test_asking_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "v1.npy"
    path.write_bytes(b"before")
    os.utime(path, (1.0, 1.0))

    has_writer(path)

    assert path.stat().st_mtime == 1.0
    # Nobody has to wait for a lease that was not given back.
    path.write_bytes(b"after")
    assert path.read_bytes() == b"after"


def test_systems_without_leases_cannot_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("annotations.prediction.live.writers.fcntl", None)

    assert has_writer(tmp_path / "absent.npy") is None
