"""A file in memory, for reading, that is let go a little at a time, by a thread of its own."""

import ctypes
import mmap
import queue
import sys
import threading
from typing import IO, Self

import numpy as np

_PORTION_BYTES = 16 << 20
"""The system lets go of so much within a millisecond."""

_MOST_WAITING = 4
"""Each keeps its file open, of which a process may only have so many, and a program may read many volumes."""

# Not the method of `mmap`: it would keep Python's lock meanwhile.
_madvise = ctypes.CDLL(None).madvise if sys.platform == "linux" else None
if _madvise is not None:
    _madvise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)


class MappedFile(mmap.mmap):
    """The beginning of a file, which the operating system reads as it is touched. Made by `of_stream`.

    The system lets go of a mapped file in one piece, and meanwhile no thread of the program can get memory:
    for a tenth or two of a second, if every page of a full volume was touched. So with the last view of it
    a thread that nobody waits for lets go of the pages first, portion by portion (Linux; elsewhere the file
    goes at once).
    """

    _address = 0

    @classmethod
    def of_stream(cls, stream: IO[bytes], length: int) -> Self:
        """Map so many bytes of an open file; it may be closed afterwards."""
        mapped = cls(stream.fileno(), length, access=mmap.ACCESS_READ)
        if _madvise is not None:
            mapped._address = np.frombuffer(mapped, np.uint8).ctypes.data
            _releaser.begin()
        return mapped

    def release_pages(self) -> None:
        """Let go of all pages; whoever reads on reads them anew."""
        if _madvise is None or not self._address or self.closed:
            return
        for start in range(0, len(self), _PORTION_BYTES):
            # Advice only: what stays is let go with the rest.
            length = min(_PORTION_BYTES, len(self) - start)
            _madvise(self._address + start, length, mmap.MADV_DONTNEED)

    def __del__(self) -> None:
        """Go on living in the thread; that it dies there Python does not tell once more."""
        if self._address and not _releaser.take(self):
            self.release_pages()


class _Releaser:
    """The thread that lets go of files."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        # Of a kind that may be added to anywhere, also while something is added to it.
        self._files: queue.SimpleQueue[MappedFile] = queue.SimpleQueue()

    def begin(self) -> None:
        """Begin, unless it has. Not in `take`, which may be called at any place in the program."""
        with self._lock:
            # In a process that was forked it has ended.
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._run, name="unmapping", daemon=True)
                self._thread.start()

    def take(self, file: MappedFile) -> bool:
        """Let go of a file, later; False where too many wait for that."""
        if self._files.qsize() >= _MOST_WAITING:
            return False
        self._files.put(file)
        return True

    def _run(self) -> None:
        while True:
            file = self._files.get()
            file.release_pages()
            # Here it ends.
            del file


_releaser = _Releaser()
