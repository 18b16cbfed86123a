"""The whole window on the small volume, and a person's hands on it."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QWidget
from pytestqt.qtbot import QtBot

from annotations.geometry.frames import Vector
from annotator.session import Session
from annotator.settings import Settings
from annotator.slices.slice_view import SliceView
from annotator.window.main_window import MainWindow

NO_MODIFIER = Qt.KeyboardModifier.NoModifier
LEFT = Qt.MouseButton.LeftButton


class Person:
    """Works on a window with real keys and clicks."""

    def __init__(self, qtbot: QtBot, window: MainWindow) -> None:
        self._qtbot = qtbot
        self.window = window

    def press(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = NO_MODIFIER) -> None:
        """Press and release a key where the focus is."""
        QTest.keyClick(self._focused(), key, modifiers)

    def press_down(self, key: Qt.Key) -> None:
        QTest.keyPress(self._focused(), key)

    def release(self, key: Qt.Key) -> None:
        QTest.keyRelease(self._focused(), key)

    def type_text(self, text: str) -> None:
        QTest.keyClicks(self._focused(), text)

    def action(self, name: str) -> QAction:
        return self.window.actions_by_name[name]

    def pixel(self, axis: int, position_um: Vector) -> QPoint:
        viewport = self.slice(axis).viewport
        assert viewport is not None
        x, y = viewport.pixel(position_um)
        return QPoint(round(x), round(y))

    def slice(self, axis: int) -> SliceView:
        return self.window.slices[axis]

    def click_slice(self, axis: int, position_um: Vector) -> None:
        """Click where a position lies on the slice that is shown."""
        QTest.mouseClick(self.slice(axis), LEFT, NO_MODIFIER, self.pixel(axis, position_um))

    def drag_slice(self, axis: int, start_um: Vector, end_um: Vector, *, release: bool = True) -> None:
        view, start, end = self.slice(axis), self.pixel(axis, start_um), self.pixel(axis, end_um)
        QTest.mousePress(view, LEFT, NO_MODIFIER, start)
        for share in (0.3, 0.7, 1.0):
            QTest.mouseMove(view, start + (end - start) * share)
        if release:
            QTest.mouseRelease(view, LEFT, NO_MODIFIER, end)

    def dialog(self, kind: type[QDialog]) -> QDialog:
        """Wait for a dialog and return it."""
        self._qtbot.waitUntil(lambda: self._shown(kind) is not None)
        shown = self._shown(kind)
        assert shown is not None
        return shown

    def has_dialog(self) -> bool:
        return self._shown(QDialog) is not None

    def click(self, parent: QWidget, name: str) -> None:
        """Click the child with an object name."""
        button = parent.findChild(QWidget, name)
        assert button is not None, f"{parent.objectName()} has no {name}"
        assert button.isEnabled(), f"{name} is disabled"
        QTest.mouseClick(button, LEFT)

    def _focused(self) -> QWidget:
        return QApplication.focusWidget() or self.window

    def _shown(self, kind: type[QDialog]) -> QDialog | None:
        return next((dialog for dialog in self.window.findChildren(kind) if dialog.isVisible()), None)


@pytest.fixture
def make_window(qtbot: QtBot, settings: Settings, tmp_path: Path) -> Callable[..., MainWindow]:
    """Make a window of a session, shown and active; the scene comes with `prepare_scene`."""

    def make(session: Session, used: Settings = settings) -> MainWindow:
        window = MainWindow(session, used, tmp_path / "annotator.log")
        # What a test leaves unsaved would be asked about.
        qtbot.addWidget(window, before_close_func=lambda window: window.session.abandon())
        window.resize(1300, 900)
        window.show()
        window.activateWindow()
        qtbot.waitUntil(window.isActiveWindow)
        return window

    return make


@pytest.fixture
def window(make_window: Callable[..., MainWindow], session: Session) -> MainWindow:
    """A window on the small volume, without its scene."""
    return make_window(session)


@pytest.fixture
def person_at(qtbot: QtBot) -> Callable[[MainWindow], Person]:
    """Make a person at a window."""
    return lambda window: Person(qtbot, window)


@pytest.fixture
def person(qtbot: QtBot, window: MainWindow) -> Person:
    """A person at the window, who has just clicked the slice across z."""
    window.slices[2].setFocus()
    return Person(qtbot, window)
