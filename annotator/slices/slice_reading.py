"""How slices are best read from a file: how many together, and in which portions."""

import math
import mmap
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from annotations.volumes import Volume

# Reading one byte of a file reads a page.
PAGE_BYTES = 4096
# What slices read in one go may take in memory.
TOGETHER_BYTES = 16 * 2**20
# After this much of a mapped file, of which most is passed over, the reader looks whether the slice is still
# wanted; and after this much of one whose blocks are read, and held in memory, whole.
PORTION_BYTES = 16 * 2**20
PORTION_BYTES_HELD = 4 * 2**20
# NumPy keeps Python's lock, and with it the window, where it copies no more elements than this: also while
# the disk brings them.
_COPIED_LOCKED = 500
# How many slices are foreseen where each costs its own reading.
SLICES_AHEAD = 4


@dataclass(frozen=True)
class ReadingPlan:
    """How the slices across one axis of a volume are read.

    Attributes
    ----------
    axis : int
        The axis that the slices are across.
    count : int
        Slices there are.
    together : int
        Slices worth reading in one go: in the file they lie so near each other that the disk, or the
        decompression, gives the others for nothing. From memory too they come at half the price: what the
        processor waits for is the line of memory that holds a voxel of each.
    reach : int
        How many slices further the file is still in the same page, or chunk.
    chunk : int or None
        Slices that can only be read together; None where a single one costs no more than it holds.
    portion_axis : int
        The other axis along which a reading is cut into portions.
    portion : int
        Length of a portion along that axis, in voxels.
    is_scattered : bool
        Whether a slice lies all over a file that is read page by page: then some of its rows cost less than
        all of them.
    """

    axis: int
    count: int
    together: int
    reach: int
    chunk: int | None
    portion_axis: int
    portion: int
    is_scattered: bool

    @classmethod
    def of(cls, volume: Volume, axis: int) -> Self:
        """Plan for the slices across an axis of a volume."""
        shape, item = volume.shape, volume.dtype.itemsize
        in_plane = [other for other in range(3) if other != axis]
        slice_bytes = shape[in_plane[0]] * shape[in_plane[1]] * item
        most = max(1, TOGETHER_BYTES // slice_bytes)
        if volume.chunks is None:
            stride = _strides(shape, item, volume.fortran_order)
            portion_axis = max(in_plane, key=lambda other: stride[other])
            chunk, reach = None, min(max(1, PAGE_BYTES // stride[axis]), shape[axis])
            portion = max(1, PORTION_BYTES // stride[portion_axis])
            is_scattered = stride[axis] < max(stride)
        else:
            chunk = reach = min(volume.chunks[axis], shape[axis])
            portion_axis, other = in_plane
            row_bytes = chunk * volume.chunks[portion_axis] * shape[other] * item
            portion = volume.chunks[portion_axis] * max(1, PORTION_BYTES_HELD // row_bytes)
            is_scattered = False
        return cls(
            axis,
            shape[axis],
            together=min(reach, most),
            reach=reach,
            chunk=chunk,
            portion_axis=portion_axis,
            portion=portion,
            is_scattered=is_scattered,
        )

    def first(self, index: int) -> range:
        """Return the slices to read when one is wanted now: no more than cost the same."""
        return range(index, index + 1) if self.chunk is None else self._block(index)

    def ahead(self, index: int, step: int) -> tuple[range, ...]:
        """Return the slices to read next, in this order, after one was read and the last step led there.

        Of a mapped file no more than those at which scrolling on stops, as many of them in one go as pays.

        Parameters
        ----------
        index : int
            The slice just read.
        step : int
            How far, and which way, the last scrolling went; 0 after a jump.
        """
        apart = max(1, abs(step)) if self.chunk is None else 1
        if self._together(apart) > 1 and abs(step) <= self.together * apart:
            own = self._block(index, apart)
            edge = own[-1] + apart if step > 0 else own[0] - apart
            wanted = [own]
            if step and 0 <= edge < self.count:
                wanted.append(self._block(edge, apart))
            return tuple(wanted)
        others = [index + step * count for count in range(1, SLICES_AHEAD + 1)] if step else []
        return tuple(dict.fromkeys(self.first(other) for other in others if 0 <= other < self.count))

    def _together(self, apart: int) -> int:
        """Return how many slices, so far apart, are worth reading in one go."""
        return min(self.together, self.reach // apart)

    def _block(self, index: int, apart: int = 1) -> range:
        """Return the slices, so far apart, that are read together with one."""
        number, phase = divmod(index, apart)
        together = self._together(apart)
        chunk = self.chunk or together
        begin = number // chunk * chunk
        start = begin + (number - begin) // together * together
        stop = min(start + together, begin + chunk)
        return range(phase + start * apart, min(phase + stop * apart, self.count), apart)


def read_slices(
    volume: Volume,
    plan: ReadingPlan,
    indices: range,
    *,
    every: tuple[int, int] = (1, 1),
    transposed: bool,
    given_up: Callable[[], bool],
) -> list[NDArray[Any]] | None:
    """Read slices into memory, one array each, so that each can be forgotten by itself.

    Parameters
    ----------
    indices : range
        Which slices, in ascending order.
    every : (int, int)
        Of the voxels along the first and the second remaining axis, each how many-th is read; the first is.
    transposed : bool
        Lay each slice out so that its transpose is C-contiguous: then drawing need not turn it.
    given_up : callable
        Asked after every portion whether nobody wants the slices any more.

    Returns
    -------
    list of ndarray, shape (those along the first, along the second remaining axis), or None
        None if given up.

    Raises
    ------
    VolumeError
        The file cannot be read.
    """
    first, second = (axis for axis in range(3) if axis != plan.axis)
    shape = (-(-volume.shape[first] // every[0]), -(-volume.shape[second] // every[1]))
    slices = [_laid_out(shape, volume.dtype, transposed=transposed) for _ in indices]
    rows_first = plan.portion_axis == first
    along = every[0] if rows_first else every[1]
    length = shape[0] if rows_first else shape[1]
    across = shape[1] if rows_first else shape[0]
    portion = max(plan.portion, _COPIED_LOCKED // (across * len(indices)) + 1)
    edges = [*range(0, length, portion), length]
    region = [slice(None), slice(None), slice(None)]
    region[plan.axis] = slice(indices.start, indices.stop, indices.step)
    region[first], region[second] = slice(None, None, every[0]), slice(None, None, every[1])
    for start, stop in pairwise(edges):
        if given_up():
            return None
        region[plan.portion_axis] = slice(start * along, stop * along, along)
        part = volume.read((region[0], region[1], region[2]))
        if plan.chunk is None:
            # Touches a mapped file once for all slices; numpy lets other threads run meanwhile.
            part = part.copy(order="K")
        for target, source in zip(slices, np.moveaxis(part, plan.axis, 0), strict=True):
            target[(slice(start, stop), slice(None)) if rows_first else (slice(None), slice(start, stop))] = (
                source
            )
    return slices


def memory(shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return an array on pages of its own, which the operating system gets back with it.

    Slices come and go in several threads, and the usual allocator holds on to up to twice what they take.
    """
    count = math.prod(shape)
    # Private: what is shared with nobody is also counted as this process's own.
    options: dict[str, Any] = (
        {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_ANONYMOUS") else {}
    )
    pages = mmap.mmap(-1, count * dtype.itemsize, **options)
    return np.frombuffer(pages, dtype, count).reshape(shape)


def _laid_out(shape: tuple[int, int], dtype: np.dtype[Any], *, transposed: bool) -> NDArray[Any]:
    return memory((shape[1], shape[0]), dtype).T if transposed else memory(shape, dtype)


def _strides(shape: tuple[int, int, int], item: int, fortran_order: bool) -> tuple[int, int, int]:
    if fortran_order:
        return (item, item * shape[0], item * shape[0] * shape[1])
    return (item * shape[1] * shape[2], item * shape[2], item)
