"""What holds for every test: no screen, no folder of the user's own, no window left behind."""

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

USER_FOLDERS = {
    "HOME": "",
    "XDG_CACHE_HOME": ".cache",
    "XDG_CONFIG_HOME": ".config",
    "XDG_DATA_HOME": ".local/share",
    "XDG_STATE_HOME": ".local/state",
}
NO_OSMESA = (
    "These tests draw without a screen, and for that VTK needs the system library libOSMesa.\n"
    "  Debian, Ubuntu:   sudo apt-get install libosmesa6\n"
    "  Where the distribution no longer has it, draw on a virtual screen instead:\n"
    "                    sudo apt-get install xvfb xauth && xvfb-run -a python -m pytest\n"
    "`make test` finds out which of the two applies, and does it."
)


def _loadable(*sonames: str) -> bool:
    for soname in sonames:
        try:
            ctypes.CDLL(soname)
        except OSError:
            continue
        return True
    return False


def _choose_screen() -> None:
    """Draw offscreen where OSMesa is there, else on the X display. Comes before any import of Qt or VTK."""
    os.environ["ETS_TOOLKIT"] = "qt"
    os.environ["QT_API"] = "pyside6"
    if not sys.platform.startswith("linux"):
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        return
    if os.environ.get("QT_QPA_PLATFORM") != "xcb" and _loadable("libOSMesa.so.8", "libOSMesa.so.6"):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkOSOpenGLRenderWindow"
    elif os.environ.get("DISPLAY"):
        os.environ["QT_QPA_PLATFORM"] = "xcb"
        os.environ.pop("VTK_DEFAULT_OPENGL_WINDOW", None)
    else:
        pytest.exit(NO_OSMESA, returncode=4)


def _point_user_folders_at(home: Path) -> dict[str, str]:
    return {name: str(home / inside) for name, inside in USER_FOLDERS.items()}


_choose_screen()
# Some libraries ask for the user's folders once, on import: from here on they see an empty home.
_SESSION_HOME = tempfile.TemporaryDirectory(prefix="oct-annotator-tests-", ignore_cleanup_errors=True)
os.environ.update(_point_user_folders_at(Path(_SESSION_HOME.name)))

hypothesis.settings.register_profile("default", deadline=None)
# There the examples are always the same ones, and time is short. Here they differ each time.
hypothesis.settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True, max_examples=40)
hypothesis.settings.load_profile("ci" if os.environ.get("CI") else "default")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Work with one process more than there are processors: a third of the time each waits for a timer."""
    if said := os.environ.get("PYTEST_XDIST_AUTO_NUM_WORKERS"):
        return int(said)
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return processors + 1


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no file that has nothing to pass where only tests that need torch are asked for."""
    if config.option.markexpr != "torch" or collection_path.suffix != ".py":
        return None
    return True if "torch" not in collection_path.read_text(encoding="utf-8") else None


@pytest.fixture(autouse=True)
def user_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty home folder, fresh for each test: no test reads or writes the user's own files."""
    home = tmp_path / "home"
    home.mkdir()
    for name, folder in _point_user_folders_at(home).items():
        monkeypatch.setenv(name, folder)
    return home


@pytest.fixture(autouse=True)
def no_leaked_windows(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail a test that leaves a visible top-level widget behind: it would receive the next test's events."""
    if "qtbot" not in request.fixturenames:
        yield
        return
    from PySide6.QtWidgets import QApplication

    # Asked for first, so that qtbot closes its own widgets before this fixture looks.
    request.getfixturevalue("qapp")
    before = set(QApplication.topLevelWidgets())
    yield
    QApplication.processEvents()
    leaked = [
        widget for widget in QApplication.topLevelWidgets() if widget not in before and widget.isVisible()
    ]
    names = [f"{type(widget).__name__} {widget.objectName()!r}" for widget in leaked]
    for widget in leaked:
        widget.close()
    assert not names, f"left open: {', '.join(names)} (register it with qtbot.addWidget)"
