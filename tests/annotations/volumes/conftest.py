"""Volumes made on the fly, in every format and layout that can be opened."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import tifffile
import zarr

Write = Callable[[Path, np.ndarray], Path]


def write_npy(folder: Path, array: np.ndarray) -> Path:
    path = folder / "volume.npy"
    np.save(path, array)
    return path


def write_npz(folder: Path, array: np.ndarray) -> Path:
    path = folder / "stored.npz"
    np.savez(path, volume=array)
    return path


def write_npz_compressed(folder: Path, array: np.ndarray) -> Path:
    path = folder / "compressed.npz"
    np.savez_compressed(path, volume=array)
    return path


def _write_hdf5(path: Path, array: np.ndarray, **options: Any) -> Path:
    with h5py.File(path, "w") as file:
        file.create_dataset("scans/volume", data=array, **options)
    return path


def write_hdf5(folder: Path, array: np.ndarray) -> Path:
    return _write_hdf5(folder / "contiguous.h5", array)


def write_hdf5_chunked(folder: Path, array: np.ndarray) -> Path:
    return _write_hdf5(folder / "chunked.h5", array, chunks=tuple(min(2, side) for side in array.shape))


def write_hdf5_compressed(folder: Path, array: np.ndarray) -> Path:
    chunks = tuple(min(3, side) for side in array.shape)
    return _write_hdf5(folder / "compressed.hdf5", array, chunks=chunks, compression="gzip")


def _byteorder(array: np.ndarray) -> str:
    return ">" if array.dtype.str.startswith(">") else "<"


def write_tiff(folder: Path, array: np.ndarray) -> Path:
    path = folder / "stack.tif"
    tifffile.imwrite(path, array, photometric="minisblack", byteorder=_byteorder(array))
    return path


def write_tiff_compressed(folder: Path, array: np.ndarray) -> Path:
    path = folder / "compressed.tiff"
    tifffile.imwrite(
        path,
        array,
        photometric="minisblack",
        byteorder=_byteorder(array),
        compression="zlib",
        predictor=False,
    )
    return path


def write_tiff_pages(folder: Path, array: np.ndarray) -> Path:
    path = folder / "pages.tif"
    with tifffile.TiffWriter(path, byteorder=_byteorder(array)) as writer:
        for plane in array:
            writer.write(plane, photometric="minisblack", contiguous=False, metadata=None)
    return path


def _write_zarr(path: Path, array: np.ndarray, version: int) -> Path:
    stored = zarr.create_array(
        str(path),
        shape=array.shape,
        dtype=array.dtype,
        chunks=tuple(min(3, side) for side in array.shape),
        zarr_format=version,
    )
    stored[...] = array
    return path


def write_zarr2(folder: Path, array: np.ndarray) -> Path:
    return _write_zarr(folder / "two.zarr", array, 2)


def write_zarr3(folder: Path, array: np.ndarray) -> Path:
    return _write_zarr(folder / "three.zarr", array, 3)


WRITERS: dict[str, Write] = {
    "npy": write_npy,
    "npz": write_npz,
    "npz compressed": write_npz_compressed,
    "hdf5": write_hdf5,
    "hdf5 chunked": write_hdf5_chunked,
    "hdf5 compressed": write_hdf5_compressed,
    "tiff": write_tiff,
    "tiff compressed": write_tiff_compressed,
    "tiff pages": write_tiff_pages,
    "zarr 2": write_zarr2,
    "zarr 3": write_zarr3,
}


@pytest.fixture(params=WRITERS.values(), ids=WRITERS.keys())
def write(request: pytest.FixtureRequest) -> Write:
    """Return a function that writes an array into a folder, in one of the formats."""
    return request.param


@pytest.fixture
def writers() -> dict[str, Write]:
    """Return all of these functions, by format."""
    return WRITERS


@pytest.fixture
def ramp() -> np.ndarray:
    """Return a small volume whose values tell their index."""
    return np.arange(5 * 6 * 7, dtype=np.uint16).reshape(5, 6, 7)
