"""The libraries with which OpenGL is drawn on this machine, loaded while the window goes on."""

import json
import logging
import sysconfig
import time
from pathlib import Path

from annotations.durable_files import SaveError, replace_durably
from annotator.scene.libraries import load_library

_log = logging.getLogger(__name__)

_FRESH_S = 30 * 24 * 3600.0
"""What the machine draws with may change; what is older is not believed, and noted anew."""


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
        Qt's name for what is drawn on: each draws with others.
    """

    def __init__(self, folder: Path, platform: str) -> None:
        self._path = folder / f"opengl-libraries-{platform}.json"
        self._before: frozenset[str] | None = None

    def load(self) -> None:
        """Load them, in any thread, before the scene is built."""
        self._before = _loaded()
        for path in self._kept():
            load_library(path)

    def keep(self) -> None:
        """Note, in any thread, what has been loaded since `load`, once the scene has been drawn."""
        if self._before is None:
            return
        packages = tuple(sysconfig.get_paths()[name] for name in ("platlib", "purelib", "stdlib"))
        paths = sorted(path for path in _loaded() - self._before if not path.startswith(packages))
        if not paths or paths == [str(path) for path in self._kept()]:
            return
        try:
            replace_durably(self._path, json.dumps(paths, indent=1).encode())
        except SaveError as error:
            _log.warning("What OpenGL loads is not kept: %s", error)

    def _kept(self) -> list[Path]:
        try:
            if time.time() - self._path.stat().st_mtime > _FRESH_S:
                return []
            paths = json.loads(self._path.read_bytes())
        except (OSError, ValueError):
            return []
        if not isinstance(paths, list) or not all(isinstance(path, str) for path in paths):
            return []
        return [Path(path) for path in paths]


def _loaded() -> frozenset[str]:
    """Return the paths of the shared libraries of this process."""
    try:
        lines = Path("/proc/self/maps").read_text().splitlines()
    except OSError:
        return frozenset()
    paths = {line.partition("/")[2] for line in lines if ".so" in line}
    return frozenset(f"/{path}" for path in paths if not path.endswith(" (deleted)"))
