"""Which platform Qt and VTK draw on: decided, or its absence explained, before either is imported."""

import ctypes
import importlib.util
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from annotations.errors import UserError
from annotator.scene.x_display import XDisplay

OSMESA_NAMES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
_SCREENLESS_PLATFORMS = ("offscreen", "minimal", "vnc")
_WINDOW_PACKAGES = (
    "libegl1 libgl1 libdbus-1-3 libfontconfig1 libxkbcommon-x11-0 libxcb-cursor0 libxcb-icccm4 libxcb-image0 "
    "libxcb-keysyms1 libxcb-randr0 libxcb-render-util0 libxcb-shape0 libxcb-xkb1"
)
_INSTALL_FOR_WINDOW = f"On Debian or Ubuntu: sudo apt-get install {_WINDOW_PACKAGES}"
_DRAW_WITHOUT = "To draw the window into a picture instead: annotator --screenshot OUT.png PATH"


class ToolkitError(UserError):
    """The system lacks what a window needs."""


def prepare(*, headless: bool) -> None:
    """Set the variables that Qt, VTK and Mayavi read when they are imported.

    Parameters
    ----------
    headless : bool
        Draw without a display, for a picture of the window.

    Raises
    ------
    ToolkitError
        There is no display, or a system library is missing; it names what to install.
    """
    os.environ["QT_API"] = "pyside6"
    os.environ["ETS_TOOLKIT"] = "qt"
    if not sys.platform.startswith("linux"):
        if headless:
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        return
    if headless or _platform(os.environ) in _SCREENLESS_PLATFORMS:
        _draw_in_memory()
    else:
        _draw_on_display()


def explain_import_error(error: ImportError) -> ToolkitError:
    """Say what to install when Qt or VTK cannot be imported for want of a system library."""
    return ToolkitError(
        f"Qt or VTK cannot be loaded: {error}",
        remedy=_INSTALL_FOR_WINDOW
        if sys.platform.startswith("linux")
        else "Install the program again, into an environment of its own",
    )


def _draw_in_memory() -> None:
    if _has_osmesa():
        if _platform(os.environ) not in _SCREENLESS_PLATFORMS:
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        # Without this VTK picks EGL in an embedded widget, and draws garbage.
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkOSOpenGLRenderWindow"
    elif _x_display_answers():
        # Newer Mesa has no OSMesa: then the virtual display that a person started has to do.
        _draw_on_display()
    else:
        raise ToolkitError(
            "drawing without a display needs the system library libOSMesa",
            remedy="On Debian or Ubuntu: sudo apt-get install libosmesa6. Where the distribution no longer "
            "has it, install xvfb and put 'xvfb-run -a' before the command",
        )


def _draw_on_display() -> None:
    environment = os.environ
    if not environment.get("DISPLAY"):
        if environment.get("WAYLAND_DISPLAY"):
            raise ToolkitError(
                "the 3D scene needs an X display, and this Wayland session offers none (DISPLAY is not set)",
                remedy=f"Install and start XWayland. {_DRAW_WITHOUT}",
            )
        raise ToolkitError(
            "there is no display to open a window on (neither DISPLAY nor WAYLAND_DISPLAY is set)",
            remedy=f"Start it from a desktop session, or over ssh with 'ssh -X'. {_DRAW_WITHOUT}",
        )
    # VTK draws into an X window: on Wayland, Qt's windows have to be X windows too.
    environment["QT_QPA_PLATFORM"] = "xcb"
    environment.pop("VTK_DEFAULT_OPENGL_WINDOW", None)
    if not _x_display_answers():
        raise ToolkitError(
            f"the display {environment['DISPLAY']!r} does not answer",
            remedy=f"Check DISPLAY, and that you may connect to it. {_DRAW_WITHOUT}",
        )
    missing = _missing_for_xcb()
    if missing:
        raise ToolkitError(f"Qt cannot open a window: {missing}", remedy=_INSTALL_FOR_WINDOW)
    if not _x_display_has_opengl():
        _draw_scene_in_memory()


def _draw_scene_in_memory() -> None:
    """Let VTK draw without the display, which Qt shows the picture on."""
    if not _has_osmesa():
        raise ToolkitError(
            f"the display {os.environ['DISPLAY']!r} has no OpenGL (its extension GLX)",
            remedy="Start its X server with it (Xvnc and Xvfb: '+extension GLX'), or install what draws "
            "without: sudo apt-get install libosmesa6. To draw the window into a picture instead, install "
            "xvfb: xvfb-run -a annotator --screenshot OUT.png PATH",
        )
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkOSOpenGLRenderWindow"


def _platform(environment: Mapping[str, str]) -> str:
    """Return the platform that a person chose for Qt, without its options."""
    return environment.get("QT_QPA_PLATFORM", "").split(";")[0].split(":")[0]


def _has_osmesa() -> bool:
    return any(_library_loads(name) for name in OSMESA_NAMES)


def _library_loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _x_display_answers() -> bool:
    """Say whether the X server named by DISPLAY takes a connection; Qt would abort if it does not."""
    if not os.environ.get("DISPLAY"):
        return False
    try:
        XDisplay().close()
    except ConnectionError:
        return False
    except OSError:
        # Qt speaks xcb by itself; a missing libX11 shows when its plugin is looked at.
        return True
    return True


def _x_display_has_opengl() -> bool:
    """Say whether the X server named by DISPLAY shows what OpenGL draws, or cannot be asked."""
    try:
        display = XDisplay()
    except OSError:
        return True
    try:
        return display.has_opengl()
    finally:
        display.close()


def _missing_for_xcb() -> str:
    """Return what the system's loader says when Qt's plugin for X windows cannot be loaded, else nothing."""
    found = importlib.util.find_spec("PySide6")
    if found is None or found.origin is None:
        return "PySide6 is not installed"
    plugin = Path(found.origin).parent / "Qt" / "plugins" / "platforms" / "libqxcb.so"
    if not plugin.exists():
        # A Qt of the distribution keeps its plugins elsewhere, and depends on what they need.
        return ""
    try:
        ctypes.CDLL(str(plugin))
    except OSError as error:
        return str(error)
    return ""
