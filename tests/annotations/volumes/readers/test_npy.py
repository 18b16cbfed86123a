import io
from pathlib import Path

import numpy as np
import pytest

from annotations.volumes import VolumeError
from annotations.volumes.readers.npy import read_npy_header


@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_both_versions_of_the_header_are_understood(version: tuple[int, int]) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.zeros((2, 3, 4), ">i2", order="F"), version=version)
    stream.seek(0)
    header = read_npy_header(stream, Path("v.npy"))
    assert (header.shape, header.fortran_order, header.dtype) == ((2, 3, 4), True, np.dtype(">i2"))
    assert header.length == len(stream.getvalue()) - 48


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        b"\x93NUMPY\x03\x00",
        b"\x93NUMPY\x01\x00\x10\x00{'descr': '<u1'}",
        b"\x93NUMPY\x01\x00\x05\x00(1, )",
        b"\x93NUMPY\x01\x00\xff\xff{",
    ],
)
def test_a_damaged_header_is_refused(content: bytes) -> None:
    with pytest.raises(VolumeError, match="header") as caught:
        read_npy_header(io.BytesIO(content), Path("v.npy"))
    assert "v.npy" in str(caught.value)
