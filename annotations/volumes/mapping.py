"""Voxels that lie in a file just as they lie in memory, mapped rather than read."""

import contextlib
import math
import mmap
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Self

import numpy as np

from annotations.volumes.volume import Array, Region, Shape, Storage, VolumeError, closed

_GAP_BYTES = 16 << 10
"""Reading on over this much takes a disk no longer than another beginning, and a full volume's preview passes
over less from row to row; that of a larger one passes over more, and reads no more for it."""


class MappedStorage(Storage):
    """An uncompressed array in a file; the operating system reads what is touched.

    Parameters
    ----------
    mapped : mmap.mmap
        The whole file, for reading.
    dtype, shape, offset, fortran_order
        What the array is and where it starts.
    """

    def __init__(
        self, mapped: mmap.mmap, dtype: np.dtype[Any], shape: Shape, offset: int, fortran_order: bool
    ) -> None:
        array: Array = np.ndarray(shape, dtype, mapped, offset, order="F" if fortran_order else "C")
        self._open: tuple[mmap.mmap, Array] | None = (mapped, array)
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
        mapped = mmap.mmap(stream.fileno(), needed, access=mmap.ACCESS_READ)
        return cls(mapped, dtype, shape, offset, fortran_order)

    def read(self, region: Region) -> Array:
        """Return a view of the file."""
        opened = self._open
        if opened is None:
            raise closed()
        return opened[1][region]

    def prefetch(self, region: Region) -> None:
        """Ask for the pages of the region, all at once rather than one fault at a time."""
        opened = self._open
        if opened is None or not hasattr(mmap, "MADV_WILLNEED"):
            return
        mapped, array = opened
        for start, stop in self._spans(array, region):
            page = start - start % mmap.PAGESIZE
            # Advice only: where it is not taken, the pages are read when they are touched.
            with contextlib.suppress(OSError):
                mapped.madvise(mmap.MADV_WILLNEED, page, stop - page)

    def close(self) -> None:
        """Forget the array; the file is let go with the last view of it."""
        self._open = None

    def _spans(self, array: Array, region: Region) -> Iterator[tuple[int, int]]:
        """Return the bytes of a region, row by row, joined where they are near."""
        if any(part.start >= part.stop for part in region):
            return
        slow, middle, fast = sorted(range(3), key=lambda axis: -array.strides[axis])
        planes, rows, voxels = (
            range(part.start, part.stop, part.step) for part in (region[slow], region[middle], region[fast])
        )
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
