"""VTK's shared libraries, loaded while the window goes on."""

import contextlib
import ctypes
import importlib.util
import os
import sys
from pathlib import Path


def load_libraries() -> None:
    """Load VTK's libraries, in any thread; the import of VTK that follows finds them loaded.

    Python holds its lock while an import loads a library, for up to a fifth of a second each, and no slot of
    the window runs meanwhile. A call through ctypes lets go of it.
    """
    found = importlib.util.find_spec("vtkmodules")
    for folder in found.submodule_search_locations or () if found is not None else ():
        for path in sorted(Path(folder).glob("vtk*")):
            if path.suffix in (".so", ".pyd"):
                _load_library(path)


def _load_library(path: Path) -> None:
    """Load a library without Python's lock. One that cannot be loaded is told by who needs it, if anybody."""
    if sys.platform == "win32":
        with contextlib.suppress(OSError):
            ctypes.CDLL(str(path))
    else:
        # Elsewhere the making of a CDLL holds the lock, too.
        dlopen = ctypes.CDLL(None).dlopen
        dlopen.argtypes, dlopen.restype = [ctypes.c_char_p, ctypes.c_int], ctypes.c_void_p
        dlopen(os.fsencode(path), os.RTLD_NOW | os.RTLD_LOCAL)
