"""A file in memory, for reading, that is let go a little at a time."""

import ctypes
import mmap
import sys
from typing import IO, Self

import numpy as np

_PORTION_BYTES = 16 << 20
"""The system lets so much go within a millisecond."""


class MappedFile(mmap.mmap):
    """The beginning of a file, which the operating system reads as it is touched.

    The system lets go of a file in one piece, and as long no thread of the program gets memory: 80 to 200 ms
    for a full volume of which every page was touched, also where it is another thread that lets it go. So it
    is emptied first, with the last view of it, portion by portion (Linux; elsewhere it goes as it does).

    Made by `of_stream`.
    """

    _address = 0

    @classmethod
    def of_stream(cls, stream: IO[bytes], length: int) -> Self:
        """Map so many bytes of an open file; it may be closed afterwards."""
        mapped = cls(stream.fileno(), length, access=mmap.ACCESS_READ)
        mapped._address = np.frombuffer(mapped, np.uint8).ctypes.data
        return mapped

    def empty(self) -> None:
        """Let go of all pages; whoever reads on reads them anew."""
        if sys.platform != "linux" or not self._address:
            return
        # Not the method of this object: it would keep Python's lock meanwhile.
        madvise = ctypes.CDLL(None).madvise
        for start in range(0, len(self), _PORTION_BYTES):
            length = min(_PORTION_BYTES, len(self) - start)
            # Advice only: what stays is let go with the rest.
            madvise(
                ctypes.c_void_p(self._address + start),
                ctypes.c_size_t(length),
                ctypes.c_int(mmap.MADV_DONTNEED),
            )

    def __del__(self) -> None:
        """Do not let go of everything at once."""
        self.empty()
