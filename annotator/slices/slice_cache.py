"""The slices seen or foreseen last, up to a number of bytes."""

import threading
from collections import OrderedDict

from annotations.volumes import SliceImage


class SliceCache:
    """Sharp slices of one volume by axis and index; the one unused for longest goes first. Thread-safe.

    Parameters
    ----------
    limit_bytes : int
        What the slices may take together. A single slice is kept even if it is larger.
    """

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._slices: OrderedDict[tuple[int, int], SliceImage] = OrderedDict()
        self._bytes = 0
        self._lock = threading.Lock()

    def get(self, axis: int, index: int) -> SliceImage | None:
        """Return a slice if it is there, and count it as used."""
        with self._lock:
            found = self._slices.get((axis, index))
            if found is not None:
                self._slices.move_to_end((axis, index))
            return found

    def __contains__(self, key: tuple[int, int]) -> bool:
        with self._lock:
            return key in self._slices

    def put(self, image: SliceImage) -> None:
        """Keep a slice, and let go of the oldest ones beyond the limit."""
        key = (image.axis, image.index)
        with self._lock:
            replaced = self._slices.pop(key, None)
            self._bytes += image.data.nbytes - (replaced.data.nbytes if replaced is not None else 0)
            self._slices[key] = image
            while self._bytes > self._limit_bytes and len(self._slices) > 1:
                _, oldest = self._slices.popitem(last=False)
                self._bytes -= oldest.data.nbytes
