"""The volumes that are measured: the full one, parts of it, and files with nothing in them."""

import ctypes
import mmap
import os
import random
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

from annotations.volumes import OMES_SPACING_UM, write_sidecar

DEPTH_AXIS = 2
PARTS = {"1/64": 4, "1/8": 2, "whole": 1}
"""By how much each axis is divided, for parts of the full volume."""

_PROBES = 256


def full_volume(folder: Path) -> Path:
    """Return the full-size volume in a folder; synthesised the first time, which takes a minute or two."""
    from annotations.geometry.tool_library import find_tool
    from annotations.synthesis import FULL_SHAPE, write_study

    path = folder / "full.npy"
    if not path.exists():
        sys.stderr.write(f"Making the full volume {path} (once, 2.4 GB)\n")
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as name:
            write_study(Path(name), find_tool("magnetic-forceps"), count=1, seed=1, shape=FULL_SHAPE)
            next(Path(name, "volumes").glob("*.npy")).replace(path)
    return path


def part(full: Path, folder: Path, name: str) -> Path:
    """Return the first part of a volume's file, as many times smaller as its name says; made once."""
    divisor = PARTS[name]
    if divisor == 1:
        return full
    path = folder / f"{full.stem}-{divisor**3}th.npy"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        volume = np.load(full, mmap_mode="r")
        with tempfile.TemporaryDirectory(dir=folder) as made:
            np.save(Path(made) / "part.npy", volume[tuple(slice(size // divisor) for size in volume.shape)])
            (Path(made) / "part.npy").replace(path)
    return path


def empty_volume(path: Path, shape: tuple[int, int, int]) -> Path:
    """Write a volume whose voxels are all 0, and which takes no room on the disk."""
    with path.open("wb") as file:
        header = {"descr": "|u1", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + int(np.prod(shape)))
    return path


def placed(source: Path, folder: Path, name: str = "v001.npy") -> Path:
    """Return a link to a volume in another folder: annotations do not belong beside somebody's volume."""
    folder.mkdir(parents=True, exist_ok=True)
    link = folder / name
    link.symlink_to(source.resolve())
    write_sidecar(link, OMES_SPACING_UM, DEPTH_AXIS)
    return link


def forget_pages(path: Path) -> float:
    """Let the system drop a file's pages from memory, and return the share of them that stayed (Linux).

    Those stay that another process has mapped; this one's own mappings lose theirs, and read them again when
    they are asked for.
    """
    library = ctypes.CDLL(None, use_errno=True)
    for line in Path("/proc/self/maps").read_text().splitlines():
        if line.endswith(str(path)):
            first, _, last = line.split()[0].partition("-")
            begin, length = int(first, 16), int(last, 16) - int(first, 16)
            library.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(length), mmap.MADV_DONTNEED)
    with path.open("rb") as file:
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    return pages_in_memory(path)


def pages_in_memory(path: Path) -> float:
    """Return the share of a file's pages that are in memory, of some that lie evenly in it (Linux).

    NaN where the file system does not tell.
    """
    found = 0
    size = path.stat().st_size
    page = bytearray(1)
    with path.open("rb", buffering=0) as file:
        # Or each question would bring what follows in the file into memory, too.
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_RANDOM)
        for number in range(_PROBES):
            try:
                # Elsewhere each time: what is asked for is in memory from then on.
                place = int((number + random.random()) * size / _PROBES)
                found += os.preadv(file.fileno(), [page], place, os.RWF_NOWAIT)
            except BlockingIOError:
                continue
            except OSError:
                return float("nan")
    return found / _PROBES


def read_once(path: Path, *, in_single_pages: bool = False) -> None:
    """Bring a file's pages into memory.

    Where memory is whole the system keeps many of them in one piece, and maps them at once; where it is in
    pieces, or where it is told that the file is read here and there, each by itself (Linux).
    """
    with path.open("rb", buffering=0) as file, Path(os.devnull).open("wb") as nowhere:
        if in_single_pages:
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_RANDOM)
        shutil.copyfileobj(file, nowhere, 2**24)
