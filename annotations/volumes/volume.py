"""A lazy, read-only, three-dimensional array on disk, and what can be wrong with one."""

import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from annotations.errors import UserError

Array = NDArray[Any]
SpacingSource = Literal["file", "sidecar", "folder"]
Shape = tuple[int, int, int]
Region = tuple[slice, slice, slice]
WHOLE = slice(None)

_PIECE_BYTES = 32 << 20
_SHARED_BYTES = 1 << 19
"""From this much on a second thread is worth its beginning."""


class VolumeError(UserError):
    """A file that cannot be opened or read as a volume."""


class Storage(ABC):
    """Where a volume's voxels come from; one class a way of storing them. Safe in several threads."""

    @abstractmethod
    def read(self, region: Region) -> Array:
        """Return the voxels of a region whose slices have a start, a stop and a positive step."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the file; once closed, stay closed."""

    def prefetch(self, region: Region) -> None:  # noqa: B027 - most storages read nothing ahead
        """Ask for what a later `read` of the region will touch, without waiting for it."""


@dataclass(frozen=True, eq=False)
class StoredArray:
    """An array as a reader found it in its file.

    Attributes
    ----------
    storage : Storage
    shape : tuple of int
    dtype : numpy.dtype
        As stored, with its byte order.
    dataset : str or None
        Its name where a file can hold several.
    chunks : tuple of int or None
        The size of the blocks that can only be read whole; None where any byte can be.
    fortran_order : bool
        Whether axis 0 is the one whose neighbours lie side by side.
    spacing_um : tuple of float or None
        As the file itself says it.
    depth_axis : int or None
        As the file itself says it.
    """

    storage: Storage
    shape: Shape
    dtype: np.dtype[Any]
    dataset: str | None = None
    chunks: Shape | None = None
    fortran_order: bool = False
    spacing_um: tuple[float, float, float] | None = None
    depth_axis: int | None = None


@dataclass(frozen=True, eq=False)
class Volume:
    """A lazy, read-only, three-dimensional array on disk.

    Opening reads the header only. Several threads may read at once, but for formats that are compressed
    they take turns. Made by `open_volume`. A context manager: leaving it closes the volume.

    Attributes
    ----------
    path : pathlib.Path
        Absolute.
    dataset : str or None
        The member, dataset, series or array inside the file, where there can be several.
    format : str
        One of ``npy``, ``npz``, ``hdf5``, ``tiff``, ``zarr``.
    shape : tuple of int
        Along array axes 0, 1, 2: x, y, z.
    dtype : numpy.dtype
        Of the voxels as handed out: native byte order, and uint8 for a file of booleans.
    file_dtype : str
        As stored: ``">u2"``.
    spacing_um : tuple of float or None
        Of the voxels along axes 0, 1, 2, from a person's answer (the sidecar), or else from the file's own
        metadata, or else from a person's answer for the folder; None where nothing says.
    spacing_source : {"file", "sidecar", "folder"} or None
    depth_axis : int
        Along which the light travels: from the sidecar or the file, else 2.
    chunks : tuple of int or None
        The size of the blocks that can only be read whole; None where any byte can be.
    fortran_order : bool
        Whether neighbours along axis 0, rather than along axis 2, lie side by side in the file.
    """

    path: Path
    dataset: str | None
    format: str
    shape: Shape
    dtype: np.dtype[Any]
    file_dtype: str
    spacing_um: tuple[float, float, float] | None
    spacing_source: SpacingSource | None
    depth_axis: int
    chunks: Shape | None
    fortran_order: bool
    _storage: Storage = field(repr=False)

    def read(self, region: tuple[slice, slice, slice]) -> Array:
        """Return the voxels of a region, reading no more of the file than that needs.

        Parameters
        ----------
        region : tuple of slice
            One slice an axis, with the meaning that NumPy gives it; steps must be positive.

        Returns
        -------
        numpy.ndarray
            Three-dimensional, `dtype`, in C or Fortran order as the file has it. A read-only view of the
            file where that is possible (then the disk is touched when the values are), else a copy.

        Raises
        ------
        VolumeError
            The file can no longer be read, is damaged, or the volume was closed.
        ValueError
            A step is not positive.
        """
        inside = self._inside(region)
        try:
            stored = self._storage.read(inside)
        except VolumeError as error:
            raise VolumeError(error.problem, where=self.path, remedy=error.remedy) from error
        except (OSError, RuntimeError) as error:
            raise unreadable(self.path, error) from error
        return _native(stored)

    def load(self, region: tuple[slice, slice, slice]) -> Array:
        """Return the voxels of a region in memory: looking at them later never waits for the disk.

        Of a mapped file the parts are asked for ahead of their turn: from a disk that has not read them
        before, a slice or a preview comes many times faster than by waiting for one page after the other.
        Two threads take turns with the parts of a preview: the processor waits for memory, voxel by voxel.

        Parameters and errors are those of `read`.

        Returns
        -------
        numpy.ndarray
            Three-dimensional, `dtype`, C-contiguous; a copy.
        """
        inside = self._inside(region)
        slow = 2 if self.fortran_order else 0
        along = range(inside[slow].start, inside[slow].stop, inside[slow].step)
        plane_bytes = self.dtype.itemsize * math.prod(self.shape) // self.shape[slow]
        # Blocks of a chunked file are read once: cutting through them would unpack them again.
        count = max(1, _PIECE_BYTES // plane_bytes if self.chunks is None else len(along))
        pieces = []
        for place in range(0, len(along), count):
            some = along[place : place + count]
            pieces.append(with_axis(inside, slow, slice(some[0], some[-1] + 1, some.step)))
        loaded = np.empty([len(range(part.start, part.stop, part.step)) for part in inside], self.dtype)
        for part in pieces[:2]:
            self.prefetch(part)

        def read_pieces(numbers: range, is_stopped: Callable[[], bool]) -> None:
            for number in numbers:
                if is_stopped():
                    return
                # The next one of this thread.
                for following in pieces[number + 2 : number + 3]:
                    self.prefetch(following)
                target = slice(number * count, (number + 1) * count)
                loaded[with_axis((WHOLE, WHOLE, WHOLE), slow, target)] = self.read(pieces[number])

        is_sparse = any(part.step > 1 for part in inside)
        if len(pieces) > 1 and is_sparse and loaded.nbytes >= _SHARED_BYTES:
            _in_turn(read_pieces, len(pieces))
        else:
            read_pieces(range(len(pieces)), lambda: False)
        return loaded

    def prefetch(self, region: tuple[slice, slice, slice]) -> None:
        """Ask the operating system for what a later `read` of the region will touch; returns at once."""
        self._storage.prefetch(self._inside(region))

    def slice_plane(self, axis: int, index: int) -> Array:
        """Return the plane of voxels with one index, in memory.

        Parameters
        ----------
        axis : int
            0, 1 or 2.
        index : int
            From 0 to ``shape[axis] - 1``.

        Returns
        -------
        numpy.ndarray
            Two-dimensional: the remaining axes in their order. C-contiguous, and a copy: looking at it
            later never waits for the disk.

        Raises
        ------
        VolumeError
            As `read`.
        IndexError
            The plane does not exist.
        """
        if not 0 <= index < self.shape[axis]:
            raise IndexError(f"no plane {index} along axis {axis} of a volume of shape {self.shape}")
        return self.load(with_axis((WHOLE, WHOLE, WHOLE), axis, slice(index, index + 1))).squeeze(axis)

    def close(self) -> None:
        """Let go of the file. Arrays already handed out stay good; closing again does nothing."""
        self._storage.close()

    def _inside(self, region: Region) -> Region:
        """Return the region with starts and stops within the volume."""
        first, second, third = (
            slice(*part.indices(length)) for part, length in zip(region, self.shape, strict=True)
        )
        if min(first.step, second.step, third.step) < 1:
            raise ValueError(f"steps must be positive: {region}")
        return (first, second, third)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def check_array(path: Path, dataset: str | None, shape: Sequence[int], dtype: np.dtype[Any]) -> Shape:
    """Return the shape of an array that can be a volume.

    Raises
    ------
    VolumeError
        It has no three axes, no voxels, or values that are no real numbers.
    """
    what = "the array" if dataset is None else f"“{dataset}”"
    sizes = " × ".join(map(str, shape)) or "none"
    if not is_real(dtype):
        raise VolumeError(
            f"{what} holds {_kind_of(dtype)} ({dtype}), not real numbers",
            where=path,
            remedy="Save the intensities as integers or floating-point numbers",
        )
    if len(shape) != 3:
        raise VolumeError(
            f"{what} has {len(shape)} axes (shape {sizes}), and a volume has three",
            where=path,
            remedy="Save one three-dimensional array, axes x, y, z",
        )
    if 0 in shape:
        raise VolumeError(
            f"{what} is empty: its shape is {sizes}",
            where=path,
            remedy="Export it again with at least one voxel along each axis",
        )
    return (int(shape[0]), int(shape[1]), int(shape[2]))


def is_real(dtype: np.dtype[Any]) -> bool:
    """Say whether values are real numbers or truth values."""
    return dtype.kind in "biuf" and dtype.subdtype is None


def closed() -> VolumeError:
    """Return the error of reading after closing."""
    return VolumeError("the volume was closed", remedy="Open it again")


def unreadable(path: Path, error: Exception) -> VolumeError:
    """Return what a user is told when the operating system or a format's library gives up on a file."""
    if isinstance(error, PermissionError):
        return VolumeError(
            "you may not read it",
            where=path,
            remedy="Ask its owner for permission, or copy it to a place of your own",
        )
    if isinstance(error, FileNotFoundError):
        return VolumeError(
            "it does not exist", where=path, remedy="Check the name, and whether the disk is connected"
        )
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    return VolumeError(
        f"it could not be read ({reason})",
        where=path,
        remedy="It may be damaged or out of reach: try to copy or export it again",
    )


def _in_turn(work: Callable[[range, Callable[[], bool]], None], count: int) -> None:
    """Have the even of so many pieces done by this thread, and the odd ones by another at the same time.

    Each looks between its pieces whether the other has failed. What fails is raised here, at once: the other
    thread is not waited for then, and as a daemon it does not keep the program from ending if it hangs.
    """
    problems: list[BaseException] = []

    def is_stopped() -> bool:
        return bool(problems)

    def do_odd() -> None:
        try:
            work(range(1, count, 2), is_stopped)
        except BaseException as problem:  # noqa: BLE001 - raised by the other thread
            problems.append(problem)

    other = threading.Thread(target=do_odd, daemon=True)
    other.start()
    try:
        work(range(0, count, 2), is_stopped)
    except BaseException as problem:
        problems.append(problem)
        raise
    other.join()
    if problems:
        raise problems[0]


def with_axis(region: Region, axis: int, part: slice) -> Region:
    """Return a region with another part of one axis."""
    first, second, third = (part if place == axis else each for place, each in enumerate(region))
    return (first, second, third)


def _native(stored: Array) -> Array:
    if stored.dtype.kind == "b":
        # A damaged file can hold bytes other than 0 and 1, so they are compared rather than relabelled.
        truth: Array = stored.view(np.uint8) != 0
        return truth.view(np.uint8)
    if not stored.dtype.isnative:
        return stored.astype(stored.dtype.newbyteorder("="))
    return stored


def _kind_of(dtype: np.dtype[Any]) -> str:
    names = {
        "c": "complex numbers",
        "O": "Python objects",
        "S": "text",
        "U": "text",
        "M": "dates",
        "m": "durations",
    }
    return names.get(dtype.kind, "records or raw bytes")
