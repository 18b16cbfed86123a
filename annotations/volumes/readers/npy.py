"""NumPy's own format, mapped rather than read."""

from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from annotations.volumes.mapping import MappedStorage
from annotations.volumes.volume import StoredArray, VolumeError, check_array

MAGIC = b"\x93NUMPY"


@dataclass(frozen=True)
class NpyHeader:
    """What stands before the values.

    Attributes
    ----------
    shape : tuple of int
    fortran_order : bool
    dtype : numpy.dtype
        As stored, with its byte order.
    length : int
        How many bytes the header has.
    """

    shape: tuple[int, ...]
    fortran_order: bool
    dtype: np.dtype[Any]
    length: int


def read_npy_header(stream: IO[bytes], where: Path) -> NpyHeader:
    """Read the header that a stream starts with. Nothing is ever unpickled.

    Raises
    ------
    VolumeError
        It is damaged, or of a version that only records with named fields need.
    """
    try:
        version = np.lib.format.read_magic(stream)
        if version == (1, 0):
            shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(stream)
        elif version == (2, 0):
            shape, fortran_order, dtype = np.lib.format.read_array_header_2_0(stream)
        else:
            raise ValueError(f"version {version[0]}.{version[1]} of the format, which holds records")
    except ValueError as error:
        raise VolumeError(
            f"its NumPy header cannot be understood ({error})",
            where=where,
            remedy="Save the array again with numpy.save",
        ) from error
    return NpyHeader(shape, fortran_order, dtype, stream.tell())


def open_npy(path: Path) -> StoredArray:
    """Map a ``.npy`` file, in C or in Fortran order.

    Raises
    ------
    VolumeError
        The file is damaged, cut short, or holds no volume.
    """
    with path.open("rb") as stream:
        header = read_npy_header(stream, path)
        shape = check_array(path, None, header.shape, header.dtype)
        storage = MappedStorage.of_stream(
            stream,
            where=path,
            dtype=header.dtype,
            shape=shape,
            offset=header.length,
            fortran_order=header.fortran_order,
        )
    return StoredArray(storage, shape, header.dtype, fortran_order=header.fortran_order)
