"""The heap of a process of its own, for the one of the tests is as they need it."""

import ctypes
import os
import subprocess
import sys

import pytest

# Each of the threads holds what it took until all have taken something, so that none gets another's heap.
_THREADS_TAKE = """
import ctypes, sys, threading
from pathlib import Path
from annotator.startup.heap import share_heap, trim_heap

library = ctypes.CDLL(None)
library.malloc.restype, library.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
library.free.argtypes = [ctypes.c_void_p]
library.open_memstream.restype = ctypes.c_void_p
library.fclose.argtypes = [ctypes.c_void_p]
library.malloc_info.argtypes = [ctypes.c_int, ctypes.c_void_p]


def heaps():
    text, length = ctypes.c_char_p(), ctypes.c_size_t()
    stream = library.open_memstream(ctypes.byref(text), ctypes.byref(length))
    library.malloc_info(0, stream)
    library.fclose(stream)
    return text.value.count(b"<heap nr")


def resident_kib():
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("RssAnon")).split()[1])


if sys.argv[1] == "shared":
    share_heap()
elif sys.argv[1] == "application":
    from annotator.startup.start import make_application

    application = make_application()
# After so much was taken and freed at once, as much may be free at a heap's end.
library.free(library.malloc(30_000_000))
all_have = threading.Barrier(4)
taken = []


def take():
    pieces = [library.malloc(60_000) for _ in range(200)]
    for piece in pieces:
        ctypes.memset(piece, 1, 60_000)
    taken.append(pieces)
    all_have.wait()


threads = [threading.Thread(target=take) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
before_kib = resident_kib()
for pieces in taken:
    for piece in pieces:
        library.free(piece)
trim_heap()
print(heaps(), before_kib - resident_kib())
"""
_SETTINGS = ("MALLOC_ARENA_MAX", "GLIBC_TUNABLES")
_TAKEN_KIB = 4 * 200 * 60_000 // 1024

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_info"),
    reason="the heap is the GNU C library's",
)


@pytest.mark.parametrize("of_whom", ["shared", "application", "own"])
def test_all_that_is_free_goes_back_if_threads_share_a_heap(of_whom: str) -> None:
    # What a person has set for all programs decides otherwise.
    environment = {name: value for name, value in os.environ.items() if name not in _SETTINGS}
    done = subprocess.run(
        [sys.executable, "-c", _THREADS_TAKE, of_whom],
        env=environment | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=True,
    )
    heaps, given_back_kib = map(int, done.stdout.split())
    assert (heaps == 1) == (of_whom != "own")
    assert (given_back_kib > 0.9 * _TAKEN_KIB) == (of_whom != "own")
