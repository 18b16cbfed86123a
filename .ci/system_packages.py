"""Check for what the program needs from the system, and install or name what is missing.

    python .ci/system_packages.py venv        what it takes to make a virtual environment
    python .ci/system_packages.py window      what Qt and VTK need for a window on a display
    python .ci/system_packages.py offscreen   what they need to draw without one (tests, screenshots)

On Debian and Ubuntu the missing packages are installed where that needs no password. Otherwise the exact
command is printed, and the exit code is 1. Elsewhere than on Linux nothing is checked: the wheels bring all.
For "offscreen" standard output then holds what to put before a command, if anything ("xvfb-run -a").
Standard library only, because it runs before anything is installed.
"""

import ctypes
import importlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass


def _library_loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


def _program_is_found(name: str) -> bool:
    return shutil.which(name) is not None


def _module_is_found(name: str) -> bool:
    importlib.invalidate_caches()
    return importlib.util.find_spec(name) is not None


@dataclass(frozen=True)
class Need:
    """One thing that the system has to have.

    Attributes
    ----------
    name : str
        File name of a library, name of a program or of a Python module.
    packages : tuple of str
        What Debian and Ubuntu call its package; releases differ, and the first name known to apt counts.
    is_met_by : callable
        Says whether the thing of this name is there.
    """

    name: str
    packages: tuple[str, ...]
    is_met_by: Callable[[str], bool] = _library_loads

    def is_met(self) -> bool:
        """Tell whether this system has it."""
        return self.is_met_by(self.name)


# Linked by Qt's libraries and by all of its platform plugins (as ldd says), or loaded by VTK at run time.
QT_AND_VTK = (
    Need("libEGL.so.1", ("libegl1",)),
    Need("libGL.so.1", ("libgl1",)),
    Need("libX11.so.6", ("libx11-6",)),
    Need("libdbus-1.so.3", ("libdbus-1-3",)),
    Need("libfontconfig.so.1", ("libfontconfig1",)),
    Need("libfreetype.so.6", ("libfreetype6",)),
    Need("libglib-2.0.so.0", ("libglib2.0-0t64", "libglib2.0-0")),
    Need("libgthread-2.0.so.0", ("libglib2.0-0t64", "libglib2.0-0")),
    Need("libxcb.so.1", ("libxcb1",)),
    Need("libxkbcommon.so.0", ("libxkbcommon0",)),
    Need("libzstd.so.1", ("libzstd1",)),
)
# Besides those, what Qt's xcb platform plugin links and what VTK loads for a window of its own.
DISPLAY = (
    Need("libX11-xcb.so.1", ("libx11-xcb1",)),
    Need("libXcursor.so.1", ("libxcursor1",)),
    Need("libxcb-cursor.so.0", ("libxcb-cursor0",)),
    Need("libxcb-icccm.so.4", ("libxcb-icccm4",)),
    Need("libxcb-image.so.0", ("libxcb-image0",)),
    Need("libxcb-keysyms.so.1", ("libxcb-keysyms1",)),
    Need("libxcb-randr.so.0", ("libxcb-randr0",)),
    Need("libxcb-render-util.so.0", ("libxcb-render-util0",)),
    Need("libxcb-render.so.0", ("libxcb-render0",)),
    Need("libxcb-shape.so.0", ("libxcb-shape0",)),
    Need("libxcb-shm.so.0", ("libxcb-shm0",)),
    Need("libxcb-sync.so.1", ("libxcb-sync1",)),
    Need("libxcb-util.so.1", ("libxcb-util1",)),
    Need("libxcb-xfixes.so.0", ("libxcb-xfixes0",)),
    Need("libxcb-xkb.so.1", ("libxcb-xkb1",)),
    Need("libxkbcommon-x11.so.0", ("libxkbcommon-x11-0",)),
)
OSMESA = Need("libOSMesa.so.8", ("libosmesa6",))
# A screen in memory, for distributions whose Mesa no longer has OSMesa.
VIRTUAL_DISPLAY = (
    *DISPLAY,
    Need("libGLX_mesa.so.0", ("libglx-mesa0",)),
    Need("xvfb-run", ("xvfb",), _program_is_found),
    Need("xauth", ("xauth",), _program_is_found),
)
VENV = (Need("ensurepip", (f"python3.{sys.version_info.minor}-venv", "python3-venv"), _module_is_found),)


def missing_for(purpose: str, apt_knows: Callable[[str], bool]) -> list[Need]:
    """List what `purpose` ("venv", "window" or "offscreen") still lacks on this system."""
    if purpose == "venv":
        needs: Iterable[Need] = VENV
    elif purpose == "window":
        needs = QT_AND_VTK + DISPLAY
    elif OSMESA.is_met() or apt_knows(OSMESA.packages[0]):
        needs = (*QT_AND_VTK, OSMESA)
    else:
        needs = QT_AND_VTK + VIRTUAL_DISPLAY
    return [need for need in needs if not need.is_met()]


def packages_of(needs: Iterable[Need], apt_knows: Callable[[str], bool]) -> list[str]:
    """Name the packages that bring `needs`, each once, as this release calls them."""
    names = (next(filter(apt_knows, need.packages), need.packages[-1]) for need in needs)
    return list(dict.fromkeys(names))


class Apt:
    """The package system of Debian and Ubuntu."""

    def __init__(self) -> None:
        self._environment = {**os.environ, "LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive"}

    def knows(self, package: str) -> bool:
        """Tell whether `package` can be installed from the lists that apt has."""
        if not self.is_here():
            return False
        policy = self._run("apt-cache", "policy", package).stdout
        return "Candidate:" in policy and "Candidate: (none)" not in policy

    def is_here(self) -> bool:
        """Tell whether this system has apt at all."""
        return _program_is_found("apt-get")

    def as_root(self) -> list[str] | None:
        """Return what to put before a command to run it as root without a password, None if nothing does."""
        if os.geteuid() == 0:
            return []
        if _program_is_found("sudo") and self._run("sudo", "-n", "true").returncode == 0:
            return ["sudo", "-n"]
        return None

    def update(self, as_root: Sequence[str]) -> None:
        """Fetch the lists of packages anew; a failure shows in the installation that follows."""
        self._run(*as_root, "apt-get", "update", "-q")

    def install(self, as_root: Sequence[str], packages: Sequence[str]) -> str:
        """Install `packages`; returns what apt-get said if it failed, else nothing."""
        # Through env, because sudo passes no variables on.
        quietly = ("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "install", "-q", "-y")
        answer = self._run(*as_root, *quietly, "--no-install-recommends", *packages)
        return "" if answer.returncode == 0 else (answer.stdout + answer.stderr).strip()

    def _run(self, *command: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(command, capture_output=True, text=True, check=False, env=self._environment)


def _say(*lines: str) -> None:
    print(*lines, sep="\n", file=sys.stderr, flush=True)


def main(purpose: str) -> int:
    """Provide what `purpose` needs; returns the exit code."""
    if not sys.platform.startswith("linux"):
        return 0
    apt = Apt()
    lacking = missing_for(purpose, apt.knows)
    if not lacking:
        return 0
    names = ", ".join(need.name for need in lacking)
    if not apt.is_here():
        _say(
            f"This system lacks {names}.",
            "Install the packages that bring them, then run the same command again.",
            f"(On Debian and Ubuntu these are: {' '.join(packages_of(lacking, apt.knows))}.)",
        )
        return 1
    as_root = apt.as_root()
    if as_root is None:
        wanted = packages_of(lacking, apt.knows)
        _say(
            f"This system lacks {names}. Install them with",
            "    sudo apt-get update && sudo apt-get install " + shlex.join(wanted),
            "and run the same command again.",
        )
        return 1
    _say(f"Installing what the system lacks: {names}")
    apt.update(as_root)
    # The fresh lists may know names that the old ones, or none, did not.
    lacking = missing_for(purpose, apt.knows)
    wanted = packages_of(lacking, apt.knows)
    complaint = apt.install(as_root, wanted)
    still_lacking = [need.name for need in missing_for(purpose, apt.knows)]
    if still_lacking:
        _say(
            complaint,
            f"Still missing: {', '.join(still_lacking)}. What was tried:",
            "    " + shlex.join([*as_root, "apt-get", "install", *wanted]),
        )
        return 1
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in ("venv", "window", "offscreen"):
        _say(f"usage: python {sys.argv[0]} venv|window|offscreen")
        raise SystemExit(2)
    code = main(sys.argv[1])
    if code == 0 and sys.argv[1] == "offscreen" and sys.platform.startswith("linux") and not OSMESA.is_met():
        print("xvfb-run -a")
    raise SystemExit(code)
