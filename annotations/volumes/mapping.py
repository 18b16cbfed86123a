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

_GAP_BYTES = 64 << 10


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
        """Return the bytes of a region, plane by plane, joined where they are near."""
        slow, *inner = sorted(range(3), key=lambda axis: -array.strides[axis])
        if any(part.start >= part.stop for part in region):
            return
        first = self._offset + sum(region[axis].start * array.strides[axis] for axis in inner)
        length = array.itemsize + sum(
            (range(region[axis].start, region[axis].stop, region[axis].step)[-1] - region[axis].start)
            * array.strides[axis]
            for axis in inner
        )
        start = stop = -1
        for index in range(region[slow].start, region[slow].stop, region[slow].step):
            begin = first + index * array.strides[slow]
            if stop >= 0 and begin - stop > _GAP_BYTES:
                yield start, stop
                start = begin
            elif stop < 0:
                start = begin
            stop = begin + length
        yield start, stop
