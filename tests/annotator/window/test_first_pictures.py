"""What is drawn first of a volume, and that nothing of the one before is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.settings import Settings
from annotator.window.main_window import MainWindow
from tests.annotator.conftest import write_volume

MakeWindow = Callable[..., MainWindow]


@pytest.fixture
def drawn(empty_session: Session, make_window: MakeWindow) -> list[tuple[tuple[int, ...], int]]:
    """How often each slice, and the scene's volume, were drawn when the last one heard of a volume."""
    window = make_window(empty_session)
    told: list[tuple[tuple[int, ...], int]] = []

    def note() -> None:
        if empty_session.volume is not None:
            told.append((tuple(view.times_drawn for view in window.slices), window.scene.volume_draws))

    # After all that the window has connected.
    empty_session.volume_changed.connect(note)
    return told


def test_the_slices_are_drawn_before_the_panels_are(
    qtbot: QtBot, drawn: list[tuple[tuple[int, ...], int]], empty_session: Session, volume_path: Path
) -> None:
    empty_session.open_path(volume_path)
    qtbot.waitUntil(lambda: bool(drawn))
    assert drawn == [((1, 1, 1), 0)]


def test_the_slices_come_before_the_scene(
    qtbot: QtBot, make_window: MakeWindow, empty_session: Session, volume_path: Path
) -> None:
    window = make_window(empty_session)
    with qtbot.waitSignal(window.scene_prepared, timeout=30_000):
        window.prepare_scene()
    order: list[str] = []
    show = window.scene._draw

    def draw_scene() -> None:
        if empty_session.volume is not None:
            order.append("scene" if all(view.times_drawn for view in window.slices) else "scene alone")
        show()

    assert window.scene._stage is not None
    window.scene._stage.canvas._draw = draw_scene
    empty_session.open_path(volume_path)
    qtbot.waitUntil(lambda: window.scene.volume_draws > 0, timeout=30_000)
    assert set(order) == {"scene"}


def test_the_scene_is_built_while_nothing_is_open(
    qtbot: QtBot, make_window: MakeWindow, empty_session: Session
) -> None:
    window = make_window(empty_session)
    with qtbot.waitSignal(window.scene_prepared, timeout=30_000):
        window.prepare_scene()
    assert window.findChild(QWidget, "scene_canvas") is not None
    assert not window.scene.isVisible()


def test_the_first_picture_is_of_the_other_volume(
    qtbot: QtBot, window: MainWindow, session: Session, tmp_path: Path
) -> None:
    other = write_volume(tmp_path / "other.npy")
    np.save(other, np.full_like(np.load(other), 90))
    qtbot.waitUntil(lambda: all(view.is_sharp for view in window.slices))
    shown: list[np.ndarray] = []

    def note() -> None:
        if session.volume is not None:
            shown.extend(view._image.data for view in window.slices if view._image is not None)

    session.volume_changed.connect(note)
    session.open_path(other)
    qtbot.waitUntil(lambda: bool(shown))
    assert len(shown) == 3
    assert all((data == 90).all() for data in shown)


def test_a_remembered_window_is_not_preceded_by_another(
    qtbot: QtBot,
    settings: Settings,
    drawn: list[tuple[tuple[int, ...], int]],
    empty_session: Session,
    volume_path: Path,
) -> None:
    settings.remember_display_window("uint8", (10.0, 120.0))
    empty_session.open_path(volume_path)
    qtbot.waitUntil(lambda: bool(drawn))
    assert drawn == [((0, 0, 0), 0)]
    qtbot.waitUntil(lambda: empty_session.view.window == (10.0, 120.0))
