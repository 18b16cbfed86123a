import os
import sys

import pytest

from annotator.startup import toolkit
from annotator.startup.toolkit import ToolkitError

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="about Linux' displays")


@pytest.fixture
def environment(monkeypatch):
    """No display, and nothing chosen; what is set is put back afterwards."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "VTK_DEFAULT_OPENGL_WINDOW"):
        # Set first, so that what the code sets is forgotten too.
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setattr(toolkit, "_x_display_answers", lambda: bool(os.environ.get("DISPLAY")))
    monkeypatch.setattr(toolkit, "_x_display_has_opengl", lambda: True)
    monkeypatch.setattr(toolkit, "_library_loads", lambda _name: True)
    monkeypatch.setattr(toolkit, "_missing_for_xcb", lambda: "")
    return monkeypatch


def test_headless_draws_in_memory(environment):
    toolkit.prepare(headless=True)
    assert os.environ["QT_QPA_PLATFORM"] == "offscreen"
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"
    assert os.environ["QT_API"] == "pyside6"
    assert os.environ["ETS_TOOLKIT"] == "qt"


def test_headless_ignores_the_display(environment):
    environment.setenv("DISPLAY", ":0")
    environment.setenv("QT_QPA_PLATFORM", "xcb")
    toolkit.prepare(headless=True)
    assert os.environ["QT_QPA_PLATFORM"] == "offscreen"


def test_platform_without_screen_that_a_person_chose_stays(environment):
    environment.setenv("QT_QPA_PLATFORM", "offscreen:fontconfig")
    toolkit.prepare(headless=False)
    assert os.environ["QT_QPA_PLATFORM"] == "offscreen:fontconfig"
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_without_osmesa_a_virtual_display_does(environment):
    environment.setattr(toolkit, "_library_loads", lambda _name: False)
    environment.setenv("DISPLAY", ":99")
    toolkit.prepare(headless=True)
    assert os.environ["QT_QPA_PLATFORM"] == "xcb"
    assert "VTK_DEFAULT_OPENGL_WINDOW" not in os.environ


def test_without_osmesa_and_display_it_says_what_to_install(environment):
    environment.setattr(toolkit, "_library_loads", lambda _name: False)
    with pytest.raises(ToolkitError) as raised:
        toolkit.prepare(headless=True)
    assert "libosmesa6" in str(raised.value)
    assert "xvfb" in str(raised.value)


def test_without_display_it_names_the_screenshot(environment):
    with pytest.raises(ToolkitError) as raised:
        toolkit.prepare(headless=False)
    assert "DISPLAY" in str(raised.value)
    assert "annotator --screenshot OUT.png PATH" in str(raised.value)


def test_wayland_without_x_is_named(environment):
    environment.setenv("WAYLAND_DISPLAY", "wayland-0")
    with pytest.raises(ToolkitError) as raised:
        toolkit.prepare(headless=False)
    assert "XWayland" in str(raised.value)


def test_on_wayland_with_x_the_windows_are_x_windows(environment):
    environment.setenv("WAYLAND_DISPLAY", "wayland-0")
    environment.setenv("DISPLAY", ":0")
    environment.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    toolkit.prepare(headless=False)
    assert os.environ["QT_QPA_PLATFORM"] == "xcb"
    assert "VTK_DEFAULT_OPENGL_WINDOW" not in os.environ


def test_display_that_does_not_answer_is_named(environment):
    environment.setenv("DISPLAY", ":77")
    environment.setattr(toolkit, "_x_display_answers", lambda: False)
    with pytest.raises(ToolkitError, match=":77"):
        toolkit.prepare(headless=False)


def test_where_the_display_has_no_opengl_the_scene_is_drawn_in_memory(environment):
    environment.setenv("DISPLAY", ":0")
    environment.setattr(toolkit, "_x_display_has_opengl", lambda: False)
    toolkit.prepare(headless=False)
    assert os.environ["QT_QPA_PLATFORM"] == "xcb"
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_a_display_without_opengl_is_named_where_nothing_else_draws(environment):
    environment.setenv("DISPLAY", ":0")
    environment.setattr(toolkit, "_x_display_has_opengl", lambda: False)
    environment.setattr(toolkit, "_library_loads", lambda _name: False)
    with pytest.raises(ToolkitError) as raised:
        toolkit.prepare(headless=False)
    for named in (":0", "GLX", "+extension GLX", "libosmesa6", "xvfb-run"):
        assert named in str(raised.value)


def test_a_display_that_cannot_be_asked_counts_as_one_with_opengl(monkeypatch):
    def refuse():
        raise OSError("libX11.so.6: cannot open shared object file")

    monkeypatch.setattr(toolkit, "XDisplay", refuse)
    assert toolkit._x_display_has_opengl()


@pytest.mark.parametrize("answer", [True, False])
def test_a_display_is_asked_for_opengl_and_let_go(monkeypatch, answer):
    class Display:
        closed = False

        def has_opengl(self):
            return answer

        def close(self):
            Display.closed = True

    monkeypatch.setattr(toolkit, "XDisplay", Display)
    assert toolkit._x_display_has_opengl() == answer
    assert Display.closed


def test_missing_library_of_xcb_is_named_with_its_package(environment):
    environment.setenv("DISPLAY", ":0")
    environment.setattr(
        toolkit, "_missing_for_xcb", lambda: "libxcb-cursor.so.0: cannot open shared object file"
    )
    with pytest.raises(ToolkitError) as raised:
        toolkit.prepare(headless=False)
    assert "libxcb-cursor.so.0" in str(raised.value)
    assert "apt-get install" in str(raised.value)
    assert "libxcb-cursor0" in str(raised.value)


def test_library_missing_at_import_is_named():
    error = toolkit.explain_import_error(ImportError("libEGL.so.1: cannot open shared object file"))
    assert "libEGL.so.1" in str(error)
    assert "libegl1" in str(error)


def test_a_display_that_is_not_there_does_not_answer(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":7777")
    assert not toolkit._x_display_answers()
    monkeypatch.delenv("DISPLAY")
    assert not toolkit._x_display_answers()


def test_this_systems_plugin_is_looked_at(monkeypatch):
    def refuse(name: str) -> None:
        raise OSError(f"{name}: libxcb-cursor.so.0: cannot open shared object file")

    monkeypatch.setattr(toolkit.ctypes, "CDLL", refuse)
    assert "libxcb-cursor.so.0" in toolkit._missing_for_xcb()
