"""Built levels of detail, kept on disk so that a volume is averaged once."""

import contextlib
import hashlib
import importlib
import json
import logging
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from annotations.volumes.levels import Level
from annotations.volumes.spacing import SpacingUm, validate_spacing_um
from annotations.volumes.volume import Volume, VolumeError

_log = logging.getLogger(__name__)

_SCHEMA = "oct-level/2"
_SUFFIX = ".level.h5"
_UNFINISHED = ".level.part"
_UNFINISHED_SECONDS = 3600.0
_DAMAGED = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, VolumeError)


def prepare_cache() -> None:
    """Import what the first level would import otherwise, 50 ms: from a thread, ahead of need."""
    importlib.import_module("h5py")


class LevelCache:
    """Averaged levels in HDF5 files, of a limited size together.

    A level belongs to a file's identity (path, size, time of change, inode, dataset) and to the spacing and
    budget that it was made with, so a changed file never meets an old level. Nothing here ever fails a
    caller: what cannot be kept is made again, what cannot be read is dropped. Several processes may share a
    folder: files appear whole, under their final names.

    Parameters
    ----------
    folder : pathlib.Path
        Made when first needed.
    limit_bytes : int
        When the levels need more together, those least recently used go.
    """

    def __init__(self, folder: Path, limit_bytes: int) -> None:
        self.folder = folder
        self.limit_bytes = limit_bytes

    def load(self, volume: Volume, spacing_um: SpacingUm, budget: int) -> Level | None:
        """Return the averaged level that was made for a volume with this spacing and budget, or None."""
        try:
            path = self._path(volume, spacing_um, budget)
        except OSError:
            return None
        if not path.exists():
            return None
        try:
            level = _read(path)
            # The time of change tells which level was used last; many file systems keep no time of access.
            os.utime(path)
        except _DAMAGED as error:
            _log.warning("The kept level %s is dropped: %s", path, error)
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        return level

    def store(self, volume: Volume, spacing_um: SpacingUm, budget: int, level: Level) -> None:
        """Keep an averaged level, and let the ones least recently used go where there are too many."""
        if level.data.nbytes > self.limit_bytes:
            return
        try:
            path = self._path(volume, spacing_um, budget)
            self.folder.mkdir(parents=True, exist_ok=True)
            descriptor, name = tempfile.mkstemp(
                prefix=f"{path.name[:16]}-", suffix=_UNFINISHED, dir=self.folder
            )
            os.close(descriptor)
            try:
                _write(Path(name), level)
                Path(name).replace(path)
            except BaseException:
                with contextlib.suppress(OSError):
                    Path(name).unlink()
                raise
            self._evict(keep=path)
        except (OSError, RuntimeError) as error:
            _log.warning("A level of %s could not be kept: %s", volume.path, error)

    def _path(self, volume: Volume, spacing_um: SpacingUm, budget: int) -> Path:
        identity = [
            _SCHEMA,
            str(volume.path.resolve()),
            volume.dataset,
            *_state_on_disk(volume.path),
            list(spacing_um),
            budget,
        ]
        key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()
        return self.folder / f"{key}{_SUFFIX}"

    def _evict(self, keep: Path) -> None:
        """Remove the levels least recently used, and what killed processes left unfinished."""
        levels: list[tuple[int, int, Path]] = []
        for path in self.folder.iterdir():
            # Another process may remove a file between two looks at it.
            with contextlib.suppress(FileNotFoundError):
                state = path.stat()
                if path.name.endswith(_UNFINISHED) and time.time() - state.st_mtime > _UNFINISHED_SECONDS:
                    path.unlink()
                elif path.name.endswith(_SUFFIX) and path != keep:
                    levels.append((state.st_mtime_ns, state.st_size, path))
        left = self.limit_bytes - keep.stat().st_size
        for _, size, path in sorted(levels, reverse=True):
            left -= size
            if left < 0:
                with contextlib.suppress(OSError):
                    path.unlink()


def _state_on_disk(path: Path) -> tuple[int, int, int]:
    """Return size, time of change in ns and inode of a file, or of a folder with everything in it."""
    state = path.stat()
    size, changed = state.st_size, state.st_mtime_ns
    for folder, _, names in os.walk(path):
        for name in names:
            inner = (Path(folder) / name).stat()
            size += inner.st_size
            changed = max(changed, inner.st_mtime_ns)
    return (size, changed, state.st_ino)


def _write(path: Path, level: Level) -> None:
    import h5py  # late: a session without a cache does not need it

    with h5py.File(path, "w", locking=False) as file:
        # In chunks for the sake of the checksum, which HDF5 has for chunks only.
        # Turned round, as it lies in memory.
        turned = level.data.transpose()
        planes = max(1, min(turned.shape[0], (4 << 20) // max(1, turned[0].nbytes)))
        file.create_dataset("data", data=turned, chunks=(planes, *turned.shape[1:]), fletcher32=True)
        file.attrs["schema"] = _SCHEMA
        file.attrs["kind"] = level.kind
        file.attrs["spacing_um"] = level.spacing_um
        file.attrs["origin_um"] = level.origin_um
        file.attrs["factors"] = level.factors


def _read(path: Path) -> Level:
    import h5py

    with h5py.File(path, "r", locking=False) as file:
        if file.attrs["schema"] != _SCHEMA or file.attrs["kind"] != "averaged":
            raise ValueError("it is no averaged level")
        data = file["data"]
        if data.ndim != 3:
            raise ValueError(f"a level of shape {data.shape}")
        return Level(
            data=np.ascontiguousarray(data[...]).transpose(),
            spacing_um=validate_spacing_um(file.attrs["spacing_um"]),
            origin_um=_three(file.attrs["origin_um"], float),
            kind="averaged",
            factors=_three(file.attrs["factors"], int),
        )


def _three(values: Any, kind: Any) -> Any:
    first, second, third = (kind(value) for value in values)
    return (first, second, third)
