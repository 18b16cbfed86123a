"""Voxels that lie in a file just as they lie in memory, mapped rather than read."""

import contextlib
import itertools
import math
import mmap
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Self

import numpy as np

from annotations.volumes.mapped_file import MappedFile
from annotations.volumes.volume import Array, Region, Shape, Storage, VolumeError, closed

_GAP_BYTES = 16 << 10
"""Reading on over this much takes a disk no longer than another beginning, and a full volume's preview passes
over less from row to row; that of a larger one passes over more, and reads no more for it."""


# In so many places of a region it is looked whether its pages are in memory already.
_PROBES = 64


class _OpenFile:
    """A file, opened once more, that is asked which of its pages are in memory (Linux)."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._number = -1
        if hasattr(os, "RWF_NOWAIT"):
            # Where it cannot be opened so, nothing is told.
            with contextlib.suppress(OSError):
                self._number = os.open(f"/proc/self/fd/{stream.fileno()}", os.O_RDONLY)
                # Or each question would bring what follows in the file into memory, too.
                os.posix_fadvise(self._number, 0, 0, os.POSIX_FADV_RANDOM)

    def has_in_memory(self, offset: int) -> bool:
        """Say whether a byte can be read without waiting for a disk; False where nobody can tell."""
        if self._number < 0:
            return False
        try:
            return os.preadv(self._number, [bytearray(1)], offset, os.RWF_NOWAIT) == 1
        except OSError:
            return False

    def __del__(self) -> None:
        if self._number >= 0:
            os.close(self._number)


class MappedStorage(Storage):
    """An uncompressed array in a file; the operating system reads what is touched.

    Parameters
    ----------
    mapped : MappedFile
        The file as far as the array goes.
    file : _OpenFile
        The same file.
    dtype, shape, offset, fortran_order
        What the array is and where it starts.
    """

    def __init__(
        self,
        mapped: MappedFile,
        file: _OpenFile,
        dtype: np.dtype[Any],
        shape: Shape,
        offset: int,
        fortran_order: bool,
    ) -> None:
        array: Array = np.ndarray(shape, dtype, mapped, offset, order="F" if fortran_order else "C")
        self._open: tuple[MappedFile, Array] | None = (mapped, array)
        self._file: _OpenFile | None = file
        self._offset = offset

    @classmethod
    def of_stream(
        cls,
        stream: IO[bytes],
        *,
        where: Path,
        dtype: np.dtype[Any],
        shape: Shape,
        offset: int = 0,
        fortran_order: bool = False,
    ) -> Self:
        """Map an array that starts at a byte of an open file; the file may be closed afterwards.

        Raises
        ------
        VolumeError
            The file ends before the array does.
        """
        needed = offset + math.prod(shape) * dtype.itemsize
        found = stream.seek(0, os.SEEK_END)
        if found < needed:
            raise VolumeError(
                f"the file is cut short: its header promises {needed:,} bytes and there are {found:,}",
                where=where,
                remedy="Copy or export it again",
            )
        mapped = MappedFile.of_stream(stream, needed)
        return cls(mapped, _OpenFile(stream), dtype, shape, offset, fortran_order)

    def read(self, region: Region) -> Array:
        """Return a view of the file."""
        opened = self._open
        if opened is None:
            raise closed()
        return opened[1][region]

    def prefetch(self, region: Region) -> None:
        """Ask for the pages of the region, all at once rather than one fault at a time.

        Not where they seem to be in memory: of a large file's preview each row has to be asked for by itself,
        which takes several times as long as reading them all from there.
        """
        opened, file = self._open, self._file
        if opened is None or file is None or not hasattr(mmap, "MADV_WILLNEED"):
            return
        mapped, array = opened
        spans = self._spans(array, region)
        first = list(itertools.islice(spans, _PROBES + 1))
        if len(first) > _PROBES and all(map(file.has_in_memory, self._probes(array, region))):
            return
        # One after the other: of a large volume there are a hundred thousand.
        for start, stop in itertools.chain(first, spans):
            page = start - start % mmap.PAGESIZE
            # Advice only: where it is not taken, the pages are read when they are touched.
            with contextlib.suppress(OSError):
                mapped.madvise(mmap.MADV_WILLNEED, page, stop - page)

    def close(self) -> None:
        """Forget the array; the file is let go with the last view of it."""
        self._open = self._file = None

    def _spans(self, array: Array, region: Region) -> Iterator[tuple[int, int]]:
        """Return the bytes of a region, row by row, joined where they are near."""
        if any(part.start >= part.stop for part in region):
            return
        slow, middle, fast = _axes(array)
        planes, rows, voxels = (_places(region[axis]) for axis in (slow, middle, fast))
        length = array.itemsize + (voxels[-1] - voxels[0]) * array.strides[fast]
        if rows.step * array.strides[middle] - length <= _GAP_BYTES:
            # All rows of a plane are one piece.
            length += (rows[-1] - rows[0]) * array.strides[middle]
            rows = rows[:1]
        start = stop = -1
        for plane in planes:
            before = self._offset + plane * array.strides[slow] + voxels[0] * array.strides[fast]
            for row in rows:
                begin = before + row * array.strides[middle]
                if stop >= 0 and begin - stop > _GAP_BYTES:
                    yield start, stop
                    start = begin
                elif stop < 0:
                    start = begin
                stop = begin + length
        yield start, stop

    def _probes(self, array: Array, region: Region) -> Iterator[int]:
        """Return where some rows of a region begin, evenly from the first to the last one."""
        slow, middle, fast = _axes(array)
        planes, rows = _places(region[slow]), _places(region[middle])
        last = len(planes) * len(rows) - 1
        for probe in range(_PROBES + 1):
            plane, row = divmod(last * probe // _PROBES, len(rows))
            place = ((slow, planes[plane]), (middle, rows[row]), (fast, region[fast].start))
            yield self._offset + sum(array.strides[axis] * index for axis, index in place)


def _axes(array: Array) -> list[int]:
    """Return the axes, first the one along which voxels lie furthest apart."""
    return sorted(range(3), key=lambda axis: -array.strides[axis])


def _places(part: slice) -> range:
    return range(part.start, part.stop, part.step)
