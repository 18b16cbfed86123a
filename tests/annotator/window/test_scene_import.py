"""When the import of what the scene needs begins: after the first pictures, but whatever comes of them."""

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtGui import QGuiApplication
from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.window import scene_import
from annotator.window.main_window import MainWindow

MakeWindow = Callable[..., MainWindow]


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Set when the import begins, which ends at once."""
    begun = threading.Event()
    monkeypatch.setattr(scene_import, "_load_for_fit_and_scene", lambda _platform: begun.set())
    return begun


@pytest.fixture
def window(make_window: MakeWindow, empty_session: Session, monkeypatch: pytest.MonkeyPatch) -> MainWindow:
    window = make_window(empty_session)
    # Nothing is loaded for it.
    monkeypatch.setattr(window.scene, "start_in_turns", window.scene.started.emit)
    return window


def test_it_waits_for_the_first_pictures_of_a_volume(
    qtbot: QtBot, window: MainWindow, volume_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []
    monkeypatch.setattr(scene_import.QtClasses, "make", lambda _, then: then())
    monkeypatch.setattr(
        scene_import,
        "_load_for_fit_and_scene",
        lambda _platform: seen.append(all(view.times_drawn for view in window.slices)),
    )
    window.open_path(volume_path)
    with qtbot.waitSignal(window.scene_prepared):
        window.prepare_scene(after_volume=True)
    assert seen == [True]


def test_what_draws_the_scene_is_loaded_in_the_thread_before_it_is_built(
    qtbot: QtBot, make_window: MakeWindow, empty_session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[tuple[str, bool]] = []
    monkeypatch.setattr(
        scene_import,
        "load_drivers",
        lambda platform: loaded.append((platform, threading.current_thread() is threading.main_thread())),
    )
    window = make_window(empty_session)
    seen: list[list[tuple[str, bool]]] = []
    monkeypatch.setattr(window.scene, "start_in_turns", lambda: seen.append([*loaded]))
    window.prepare_scene()
    qtbot.waitUntil(lambda: bool(seen))
    assert seen == [[(QGuiApplication.platformName(), False)]]


def test_it_begins_without_a_volume_that_keeps_a_person_waiting(
    qtbot: QtBot,
    begun: threading.Event,
    make_window: MakeWindow,
    empty_session: Session,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(scene_import, "_PATIENCE_MS", 20)
    window = make_window(empty_session)
    monkeypatch.setattr(window.scene, "start_in_turns", window.scene.started.emit)
    with qtbot.waitSignal(window.scene_prepared):
        window.prepare_scene(after_volume=True)
    assert begun.is_set()


def test_it_begins_once(
    qtbot: QtBot,
    make_window: MakeWindow,
    empty_session: Session,
    volume_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times: list[None] = []
    monkeypatch.setattr(scene_import, "_PATIENCE_MS", 300)
    monkeypatch.setattr(scene_import, "_load_for_fit_and_scene", lambda _platform: times.append(None))
    window = make_window(empty_session)
    monkeypatch.setattr(window.scene, "start_in_turns", lambda: None)
    window.prepare_scene(after_volume=True)
    for _ in range(2):
        with qtbot.waitSignal(
            empty_session.volume_changed, check_params_cb=lambda: empty_session.volume is not None
        ):
            window.open_path(volume_path)
        qtbot.waitUntil(lambda: bool(times))
    qtbot.wait(400)
    assert len(times) == 1


@pytest.mark.parametrize("opens", [False, True])
def test_a_window_that_is_closed_begins_nothing(
    qtbot: QtBot,
    begun: threading.Event,
    make_window: MakeWindow,
    empty_session: Session,
    volume_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    opens: bool,
) -> None:
    monkeypatch.setattr(scene_import, "_PATIENCE_MS", 20 if not opens else 10_000)
    window = make_window(empty_session)
    window.prepare_scene(after_volume=True)
    if opens:
        # It has been seen, and the turn of the import is the next one.
        empty_session.volume_changed.connect(window.close)
        window.open_path(volume_path)
        qtbot.waitUntil(window.isHidden)
    window.close()
    qtbot.wait(100)
    assert not begun.is_set()
