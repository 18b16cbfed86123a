"""The GNU C library's heap, from which Python, Qt and VTK take memory; others need not be told anything."""

import ctypes
import sys

_M_ARENA_MAX = -8


def share_heap() -> None:
    """Let all threads take from one heap. To be called before they begin: one that has its own keeps it.

    Else each gets one of its own, and what a slice took is free in the heap of the thread that read it: no
    other uses it, and `trim_heap` gives none of it back where it lies at that heap's end.
    """
    if (mallopt := _function("mallopt")) is not None:
        mallopt(_M_ARENA_MAX, 1)


def trim_heap() -> None:
    """Give all memory that is free back to the system; by itself only what lies at the heap's end goes."""
    if (malloc_trim := _function("malloc_trim")) is not None:
        malloc_trim(0)


def _function(name: str) -> "ctypes._NamedFuncPointer | None":
    return getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
