"""The libraries with which OpenGL is drawn on this machine, loaded while the window goes on."""

import contextlib
import json
import logging
import os
import re
import sys
import time
from pathlib import Path

from annotations.durable_files import SaveError, replace_durably
from annotator.scene.libraries import load_library

_log = logging.getLogger(__name__)

_FRESH_S = 30 * 24 * 3600.0
"""What the machine draws with may change; what is older is not believed, and noted anew."""

_LIBRARY = re.compile(rb"r-xp [0-9a-f]+ \S+ \d+ +(/.+\.so(?:\.\d+)*)$", re.MULTILINE)


class Drivers:
    """Loads what OpenGL's first picture loaded at the last start.

    OpenGL itself decides that, by the screen and by what is installed, and loads up to 150 MB at once. Does
    nothing but on Linux, where the system tells what a process has loaded.

    Parameters
    ----------
    folder : Path
        Holds one small file for each platform. Whoever writes there can have the program load any library: it
        belongs to the user.
    platform : str
        Qt's name for what is drawn on: with and without a screen others are needed.
    """

    def __init__(self, folder: Path, platform: str) -> None:
        self._path = folder / f"opengl-libraries-{platform}.json"
        self._before: frozenset[str] | None = None
        self._noted_s = 0.0

    def load(self) -> None:
        """Load them, in any thread, before the scene is built.

        Until `keep` the note is gone: what does not survive one of them tries none of them at the next start.
        """
        self._before = _loaded()
        self._noted_s, paths = self._read()
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)
        for path in paths:
            load_library(path)

    def keep(self) -> None:
        """Note, in any thread, what has been loaded since `load`, once the scene has been drawn."""
        if self._before is None:
            return
        packages = tuple(f"{folder}{os.sep}" for folder in sys.path if folder)
        paths = sorted(path for path in _loaded() - self._before if not path.startswith(packages))
        if not paths:
            return
        note = {"noted_s": self._noted_s or time.time(), "libraries": paths}
        try:
            replace_durably(self._path, json.dumps(note, indent=1).encode())
        except SaveError as error:
            _log.warning("What OpenGL loads is not kept: %s", error)

    def _read(self) -> tuple[float, list[Path]]:
        """Return when they were first noted, in seconds since 1970, and which; 0 and none without a note."""
        try:
            note = json.loads(self._path.read_bytes())
            noted_s, paths = float(note["noted_s"]), [Path(path) for path in note["libraries"]]
        except (OSError, ValueError, TypeError, KeyError):
            return 0.0, []
        is_fresh = 0.0 <= time.time() - noted_s <= _FRESH_S
        return (noted_s, paths) if is_fresh else (0.0, [])


def _loaded() -> frozenset[str]:
    """Return the paths of the shared libraries of this process."""
    try:
        maps = Path("/proc/self/maps").read_bytes()
    except OSError:
        return frozenset()
    return frozenset(map(os.fsdecode, _LIBRARY.findall(maps)))
