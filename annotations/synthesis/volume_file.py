"""Volumes and masks streamed to disk: a ``.npy`` file written by planes, and under its name only whole."""

import contextlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from annotations.durable_files import SaveError, sync_folder
from annotations.errors import Cancelled
from annotations.synthesis.scene import Scene


def write_volume(
    scene: Scene,
    path: Path,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> None:
    """Write a scene's volume as a ``.npy`` file of uint8 in C order; see `write_planes`."""
    write_planes(scene.planes(), scene.grid.shape, path, progress, cancelled)


def write_planes(
    planes: Iterable[NDArray[np.uint8]],
    shape: tuple[int, int, int],
    path: Path,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> None:
    """Write planes as a ``.npy`` file of uint8 in C order.

    Written as a stream rather than through a memory map, so that a full disk is an error that can be told
    instead of a signal that ends the process.

    Parameters
    ----------
    planes : iterable of ndarray of uint8, shape (ny, nz) each
        Along axis 0 in their order, in C order each.
    shape : (int, int, int)
    path : Path
        The file; its folder is created if absent.
    progress : callable
        Told the share that is done, in [0, 1].
    cancelled : callable
        Asked after each plane.

    Raises
    ------
    SaveError
        The file cannot be written; nothing of it stays behind.
    Cancelled
        `cancelled` returned true; nothing of it stays behind.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    header = {"descr": "|u1", "fortran_order": False, "shape": shape}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("wb") as stream:
            np.lib.format.write_array_header_1_0(stream, header)
            for index, plane in enumerate(planes, start=1):
                stream.write(plane.data)
                progress(index / shape[0])
                if cancelled():
                    raise Cancelled
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        raise SaveError(
            f"it could not be written ({error.strerror or error})",
            where=path,
            remedy="Free some space, or choose a folder that you may write to",
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
