"""The X display: whether it answers, whether it has OpenGL, and what OpenGL loads for it."""

import ctypes
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from annotator.scene import drivers
from annotator.scene.drivers import load_drivers
from annotator.scene.x_display import XDisplay

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="about Linux' displays")

DISPLAY = 0x1234_5678_9ABC

CODE = """
import ctypes
from annotator.scene.drivers import load_drivers
from annotator.scene.x_display import XDisplay
def loaded():
    with open("/proc/self/maps") as maps:
        return {line.split()[-1] for line in maps if ".so" in line}
ctypes.CDLL("libGL.so.1")
before = loaded()
load_drivers("offscreen")
assert loaded() == before
load_drivers("xcb")
display = XDisplay()
print(display.has_opengl(), bool(loaded() - before))
display.close()
"""


class Library:
    """A library of the system that notes what is called."""

    def __init__(self, calls: list[str], **answers: object) -> None:
        self._calls = calls
        self._answers = answers

    def __getattr__(self, name: str) -> Callable[..., object]:
        def call(*given: object) -> object:
            # A plain number would be cut off to an int of C's.
            assert not given or given[0] is None or isinstance(given[0], ctypes.c_void_p)
            self._calls.append(name)
            return self._answers.get(name, 1)

        setattr(self, name, call)
        return call


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is called of a display with OpenGL."""
    calls: list[str] = []
    libraries = {
        "libX11.so.6": Library(calls, XOpenDisplay=DISPLAY),
        "libGL.so.1": Library(calls, glXGetFBConfigs=42),
    }
    monkeypatch.setattr(ctypes, "CDLL", libraries.__getitem__)
    return calls


def test_opengl_is_asked_in_a_connection_of_its_own(calls: list[str]) -> None:
    load_drivers("xcb")
    assert calls == [
        "XInitThreads",
        "XOpenDisplay",
        "XQueryExtension",
        "XDefaultScreen",
        "glXGetFBConfigs",
        "XFree",
    ]


@pytest.mark.parametrize("platform", ["offscreen", "cocoa", "windows", "wayland"])
def test_elsewhere_nothing_is_loaded(calls: list[str], platform: str) -> None:
    load_drivers(platform)
    assert calls == []


def test_a_display_without_opengl_is_not_asked(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        ctypes.CDLL("libX11.so.6"), "_answers", {"XOpenDisplay": DISPLAY, "XQueryExtension": 0}
    )
    assert not XDisplay().has_opengl()
    load_drivers("xcb")
    assert "glXGetFBConfigs" not in calls


def test_a_system_without_opengl_is_not_asked(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    load = ctypes.CDLL

    def refuse_opengl(name: str) -> ctypes.CDLL:
        if name == "libGL.so.1":
            raise OSError(name)
        return load(name)

    monkeypatch.setattr(ctypes, "CDLL", refuse_opengl)
    load_drivers("xcb")
    assert calls == ["XInitThreads", "XOpenDisplay"]


def test_a_display_that_is_not_there_is_an_error_but_none_of_the_drivers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("DISPLAY", ":7777")
    with pytest.raises(ConnectionError):
        XDisplay()
    load_drivers("xcb")


def test_a_system_without_x_has_no_drivers_to_load(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse() -> None:
        raise OSError("libX11.so.6: cannot open shared object file")

    monkeypatch.setattr(drivers, "XDisplay", refuse)
    load_drivers("xcb")


@contextmanager
def x_server(*options: str) -> Iterator[str]:
    """A display of its own."""
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "640x480x24", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        assert server.stdout is not None
        try:
            number = server.stdout.readline().strip()
            if not number:
                pytest.skip("the X server does not start")
            yield f":{number}"
        finally:
            server.terminate()


@pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no X server to be had")
@pytest.mark.parametrize("has_opengl", [True, False])
def test_a_real_display_says_whether_it_has_opengl(monkeypatch: pytest.MonkeyPatch, has_opengl: bool) -> None:
    with x_server("+extension" if has_opengl else "-extension", "GLX") as display:
        monkeypatch.setenv("DISPLAY", display)
        done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(has_opengl)] * 2
