"""HDF5: contiguous datasets are mapped, chunked ones read block by block."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from annotations.volumes.dataset_choice import no_such_dataset, only_volume
from annotations.volumes.file_metadata import NAMES, depth_axis_from_attributes, spacing_from_attributes
from annotations.volumes.mapping import MappedStorage
from annotations.volumes.volume import (
    Array,
    Region,
    Shape,
    Storage,
    StoredArray,
    VolumeError,
    check_array,
    closed,
)

TRAINING_SCHEMA = "oct-targets/"
"""How the root attribute ``schema`` begins of the program's own training files, of whatever version."""

_CHUNK_CACHE_BYTES = 32 << 20
_TILE_BYTES = 16 << 20


class Hdf5Storage(Storage):
    """A chunked or compressed dataset; the HDF5 library lets one thread in at a time."""

    def __init__(self, file: h5py.File, dataset: h5py.Dataset) -> None:
        self._file = file
        self._dataset: h5py.Dataset | None = dataset
        self._lock = threading.Lock()

    def read(self, region: Region) -> Array:
        """Return a copy of the region.

        The library picks strided elements one by one, which is far slower than unpacking the blocks that
        hold them and striding in memory; that is done a few blocks at a time, to need little memory.
        """
        with self._lock:
            dataset = self._dataset
            if dataset is None:
                raise closed()
            if all(part.step == 1 for part in region):
                return np.asarray(dataset[region])
            counts = [len(range(part.start, part.stop, part.step)) for part in region]
            result = np.empty(counts, dataset.dtype)
            thick, wide, _ = dataset.chunks or (1, 1, 1)
            row_bytes = thick * wide * dataset.shape[2] * dataset.dtype.itemsize
            wide *= max(1, _TILE_BYTES // row_bytes)
            whole = slice(region[2].start, region[2].stop)
            for to_first, first in _pieces(region[0], thick):
                for to_second, second in _pieces(region[1], wide):
                    block = dataset[first, second, whole]
                    result[to_first, to_second] = block[
                        :: region[0].step, :: region[1].step, :: region[2].step
                    ]
            return result

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._dataset is not None:
                self._dataset = None
                self._file.close()


def _pieces(part: slice, edge: int) -> Iterator[tuple[slice, slice]]:
    """Cut a strided slice at the multiples of an edge.

    Yields
    ------
    tuple of slice
        Where the wanted indices of a piece go in the result, and from the first to the last of them.
    """
    indices = range(part.start, part.stop, part.step)
    done = 0
    while done < len(indices):
        border = (indices[done] // edge + 1) * edge
        count = len(range(indices[done], min(border, part.stop), part.step))
        yield slice(done, done + count), slice(indices[done], indices[done + count - 1] + 1)
        done += count


def is_training_file(path: Path) -> bool:
    """Say whether a file is one that was exported for training; False where it is no readable HDF5 file."""
    try:
        with h5py.File(path, "r", locking=False) as file:
            schema = file.attrs.get("schema")
    except OSError:
        return False
    return isinstance(schema, str) and schema.startswith(TRAINING_SCHEMA)


def open_hdf5(path: Path, dataset: str | None) -> StoredArray:
    """Open a three-dimensional dataset of an HDF5 file.

    Attributes of the dataset, else of the groups that it is in, describe it: see
    `annotations.volumes.file_metadata`.

    Raises
    ------
    VolumeError
        The file is damaged, holds no volume, or needs a compression filter that is not installed.
    DatasetChoiceNeeded
        It holds several, and `dataset` is None.
    """
    # Locking a file that is only read is of no use, and fails on many shared folders.
    file = h5py.File(path, "r", locking=False, rdcc_nbytes=_CHUNK_CACHE_BYTES)
    try:
        chosen = _choose(path, file, dataset)
        name = chosen.name.lstrip("/")
        shape = check_array(path, name, chosen.shape or (), chosen.dtype)
        _check_filters(path, chosen)
        attributes = _attributes(chosen)
        mapped = _map(path, chosen, shape)
        chunks = chosen.chunks
        stored_dtype = chosen.dtype
        storage: Storage = mapped if mapped is not None else Hdf5Storage(file, chosen)
    except BaseException:
        file.close()
        raise
    if mapped is not None:
        file.close()
    return StoredArray(
        storage=storage,
        shape=shape,
        dtype=stored_dtype,
        dataset=name,
        chunks=None if chunks is None else (chunks[0], chunks[1], chunks[2]),
        spacing_um=spacing_from_attributes(attributes, path),
        depth_axis=depth_axis_from_attributes(attributes),
    )


def _choose(path: Path, file: h5py.File, name: str | None) -> h5py.Dataset:
    if name is not None:
        # Asked of the file itself, which also follows the links that a visit to all its datasets passes by.
        found = file.get(name)
        if not isinstance(found, h5py.Dataset):
            raise no_such_dataset(path, name, _datasets(file))
        return found
    datasets = _datasets(file)
    held = {each: (found.shape or (), found.dtype) for each, found in datasets.items()}
    return datasets[only_volume(path, held)]


def _datasets(file: h5py.File) -> dict[str, h5py.Dataset]:
    found: dict[str, h5py.Dataset] = {}

    def keep(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item

    file.visititems(keep)
    return found


def _attributes(dataset: h5py.Dataset) -> dict[str, Any]:
    """Return the known attributes of the dataset, or of the nearest group above that has any."""
    item: Any = dataset
    while True:
        attributes = {name: item.attrs[name] for name in NAMES if name in item.attrs}
        if attributes or item.name == "/":
            return attributes
        item = item.parent


def _check_filters(path: Path, dataset: h5py.Dataset) -> None:
    properties = dataset.id.get_create_plist()
    for index in range(properties.get_nfilters()):
        code, _, _, name = properties.get_filter(index)
        if not h5py.h5z.filter_avail(code):
            raise VolumeError(
                f"it is compressed with {name.decode(errors='replace') or 'a filter'} (HDF5 filter {code}), "
                "which is not installed",
                where=path,
                remedy="Install the Python package hdf5plugin, or save the volume without that filter",
            )


def _map(path: Path, dataset: h5py.Dataset, shape: Shape) -> MappedStorage | None:
    """Map a dataset whose bytes lie in the file as NumPy would have them; None for any other."""
    offset = dataset.id.get_offset()
    if offset is None or dataset.chunks is not None or dataset.external or dataset.is_virtual:
        return None
    if dataset.id.get_type() != h5py.h5t.py_create(dataset.dtype, logical=True):
        return None
    with path.open("rb") as stream:
        return MappedStorage.of_stream(stream, where=path, dtype=dataset.dtype, shape=shape, offset=offset)
