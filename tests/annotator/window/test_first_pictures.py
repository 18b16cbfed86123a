"""What is drawn first of a volume, and that nothing of the one before is."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, QTimer
from PySide6.QtWidgets import QDockWidget, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.redrawing import owes_drawing
from annotator.session import Session
from annotator.settings import Settings
from annotator.slices.slice_view import SliceView
from annotator.window.main_window import MainWindow
from tests.annotator.conftest import write_volume

MakeWindow = Callable[..., MainWindow]


@dataclass(frozen=True)
class Picture:
    """What holds at the first painting of a slice of a volume.

    Attributes
    ----------
    panels_are_owed : bool
        Whether panels have yet to draw what they heard of the volume.
    window : (float, float)
        The grey values that are shown.
    """

    panels_are_owed: bool
    window: tuple[float, float]


class FirstPictures(QObject):
    """Notes the first pictures of another volume in a window.

    Attributes
    ----------
    pictures : dict of int to Picture
        By the axis of the slice.
    painted_in_the_turn : list of int
        Of how many slices there was a picture at the end of the turn of the event loop in which all heard.
    """

    def __init__(self, window: MainWindow) -> None:
        super().__init__()
        self._window = window
        self.pictures: dict[int, Picture] = {}
        self.painted_in_the_turn: list[int] = []
        # Its `singleShot` would be called before what is to be painted.
        self._turn_end = QTimer(self, singleShot=True)
        self._turn_end.timeout.connect(self._note_painted)
        for view in window.slices:
            view.installEventFilter(self)
        window.session.volume_changed.connect(self._on_session_volume_changed)

    def _on_session_volume_changed(self) -> None:
        if self._window.session.volume is not None:
            self.pictures.clear()
            self._turn_end.start()

    def _note_painted(self) -> None:
        self.painted_in_the_turn.append(len(self.pictures))

    def eventFilter(self, view: QObject, event: QEvent) -> bool:
        window = self._window
        if event.type() == QEvent.Type.Paint and window.session.volume is not None:
            assert isinstance(view, SliceView)
            owed = any(owes_drawing(dock) for dock in window.findChildren(QDockWidget))
            self.pictures.setdefault(view.axis, Picture(owed, window.session.view.window))
        return False

    def are_there(self) -> bool:
        return len(self.pictures) == 3


@pytest.fixture
def first(qtbot: QtBot, window: MainWindow) -> FirstPictures:
    """Those of the volumes that follow one whose pictures are all there."""
    qtbot.waitUntil(lambda: all(view.is_sharp for view in window.slices) and not owes_drawing(window))
    return FirstPictures(window)


def test_all_hear_of_a_volume_in_one_turn_and_its_slices_are_painted_in_the_next(
    qtbot: QtBot, first: FirstPictures, session: Session, tmp_path: Path
) -> None:
    session.open_path(write_volume(tmp_path / "other.npy"))
    qtbot.waitUntil(lambda: session.volume_label == "other.npy" and first.are_there())
    assert first.painted_in_the_turn == [0]


def test_the_slices_are_painted_before_the_panels_draw_what_they_heard(
    qtbot: QtBot, first: FirstPictures, session: Session, tmp_path: Path
) -> None:
    session.open_path(write_volume(tmp_path / "other.npy"))
    qtbot.waitUntil(lambda: session.volume_label == "other.npy" and first.are_there())
    assert all(picture.panels_are_owed for picture in first.pictures.values())


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
    qtbot: QtBot, settings: Settings, first: FirstPictures, session: Session, tmp_path: Path
) -> None:
    settings.remember_display_window("uint8", (10.0, 120.0))
    session.open_path(write_volume(tmp_path / "other.npy"))
    qtbot.waitUntil(lambda: session.volume_label == "other.npy" and first.are_there())
    assert [picture.window for picture in first.pictures.values()] == [(10.0, 120.0)] * 3
