"""A simulated annotator at a real window: mouse and keys only, with an unsteady hand and imperfect eyes."""

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton

from annotations.geometry.frames import Vector, vector
from annotator.session.editing.handles import Handle
from annotator.slices.body_drag import DRAG_DISTANCE_PX
from annotator.slices.handle_marks import handle_marks
from annotator.slices.slice_view import SliceView
from annotator.window.main_window import MainWindow

# The keystroke-level model (S. K. Card, T. P. Moran, A. Newell, Comm. ACM 23, 1980): pointing 1.1 s, pressing
# or releasing a button 0.1 s, a key 0.28 s, thinking before each gesture 1.35 s. A notch of the wheel: 0.1 s.
SECONDS = {"click": 1.35 + 1.1 + 0.2, "drag": 1.35 + 2 * 1.1 + 0.2, "key": 1.35 + 0.28, "notch": 0.1}
HAND_PX = 0.7
"""Standard deviation of where a click lands, per axis of the screen."""
EYE_UM = 50.0
"""Standard deviation of where the annotator believes a point to be, per axis of the volume."""
CLOSE_UM = 60.0
"""What is this near to where it is wanted is left alone."""
_GAIN = 0.8
"""A drag that leaves more than this share of the way is the last one at a handle."""
_NONE, _LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


class Person:
    """Points, drags, scrolls and presses keys; counts what was done.

    Attributes
    ----------
    done : Counter
        How often each kind of gesture of `SECONDS` was made.
    """

    def __init__(self, window: MainWindow, seed: int) -> None:
        self._window = window
        self._session = window.session
        self._rng = np.random.default_rng(seed)
        self.done: Counter[str] = Counter()

    @property
    def seconds(self) -> float:
        """Time that the gestures would take a person."""
        return sum(SECONDS[kind] * count for kind, count in self.done.items())

    @property
    def gestures(self) -> int:
        """Clicks, drags and keys; scrolling is no click."""
        return sum(count for kind, count in self.done.items() if kind != "notch")

    def see(self, positions_um: Mapping[str, Vector]) -> dict[str, Vector]:
        """Return where the annotator believes these positions to be."""
        return {
            name: vector(np.asarray(position_um) + self._rng.normal(0, EYE_UM, 3))
            for name, position_um in positions_um.items()
        }

    def press(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = _NONE) -> None:
        """Press a key over the slices."""
        self.done["key"] += 1
        QTest.keyClick(QApplication.focusWidget() or self._window, key, modifiers)
        self._settle()

    def push(self, name: str) -> None:
        """Click a button of the window that is in sight, by the name of its widget."""
        shown: list[QPushButton] = []

        def is_shown() -> bool:
            shown[:] = [each for each in self._window.findChildren(QPushButton, name) if each.isVisible()]
            return bool(shown)

        self.wait(is_shown, patience_s=5)
        self.done["click"] += 1
        QTest.mouseClick(shown[0], _LEFT)
        self._settle()

    def click(self, axis: int, position_um: Vector) -> None:
        """Click a slice where a position is seen, projected onto it."""
        self.done["click"] += 1
        QTest.mouseClick(self._slice(axis), _LEFT, _NONE, self._pixel(axis, position_um, unsteady=True))
        self._settle()

    def drag(self, axis: int, start_um: Vector, end_um: Vector) -> bool:
        """Drag what is at one position of a slice to another; False where it looks right already."""
        view = self._slice(axis)
        start, end = self._pixel(axis, start_um), self._pixel(axis, end_um, unsteady=True)
        if (end - start).manhattanLength() <= DRAG_DISTANCE_PX:
            return False
        self.done["drag"] += 1
        QTest.mousePress(view, _LEFT, _NONE, start)
        for share in (0.25, 0.5, 0.75, 1.0):
            self._move(view, start + (end - start) * share)
        QTest.mouseRelease(view, _LEFT, _NONE, end)
        self._settle()
        return True

    def scroll_to(self, axis: int, through_um: float) -> None:
        """Turn the wheel on a slice until it shows the plane through a coordinate."""
        view = self._slice(axis)
        assert view.viewport is not None
        wanted = view.viewport.plane.index([through_um] * 3)
        tens, ones = divmod(abs(wanted - view.index), 10)
        away = -1 if wanted > view.index else 1
        for count, modifier in ((tens, Qt.KeyboardModifier.ShiftModifier), (ones, _NONE)):
            for _ in range(count):
                self.done["notch"] += 1
                self._turn_wheel(view, 120 * away, modifier)
        self._settle()

    def wait(self, ready: Callable[[], bool], patience_s: float = 60) -> None:
        """Watch the window until something has happened."""
        limit_s = time.perf_counter() + patience_s
        while not ready():
            if time.perf_counter() > limit_s:
                raise TimeoutError("what the annotator waits for does not happen")
            QApplication.processEvents()

    def adjust(self, wanted: Sequence[Handle], order: Sequence[str], *, rounds: int = 2) -> None:
        """Drag handles, in an order, to where they are wanted, until they are close or nothing is gained.

        Each is dragged in the slice in which it is farthest from there.
        """
        for _ in range(rounds):
            for name in order:
                way_um = self._way_um(name, wanted)
                for _ in range(2):
                    # In the slice across the axis along which there is least to go.
                    axis = int(np.argmin(np.abs(way_um)))
                    if math.hypot(*np.delete(way_um, axis)) < CLOSE_UM:
                        break
                    here_um = self._shown_um(name, self._session.handles())
                    self.scroll_to(axis, here_um[axis])
                    self.drag(axis, here_um, vector(np.add(here_um, way_um)))
                    left_um = self._way_um(name, wanted)
                    gained = np.linalg.norm(left_um) < _GAIN * np.linalg.norm(way_um)
                    way_um = left_um
                    if not gained:
                        break

    def _way_um(self, name: str, wanted: Sequence[Handle]) -> NDArray[np.float64]:
        return np.subtract(self._shown_um(name, wanted), self._shown_um(name, self._session.handles()))

    def _shown_um(self, name: str, handles: Sequence[Handle]) -> Vector:
        """Return where a slice shows a handle; the three have one scale, and stand knobs off alike."""
        view = self._slice(0)
        assert view.viewport is not None
        (handle,) = (handle for handle in handles if handle.name == name)
        (mark,) = handle_marks([handle], (), self._session.view, view.viewport, view.index)
        return mark.position_um

    def _slice(self, axis: int) -> SliceView:
        return self._window.slices[axis]

    def _pixel(self, axis: int, position_um: Vector, *, unsteady: bool = False) -> QPoint:
        viewport = self._slice(axis).viewport
        assert viewport is not None
        place = np.asarray(viewport.pixel(position_um))
        if unsteady:
            place = place + self._rng.normal(0, HAND_PX, 2)
        return QPoint(round(place[0]), round(place[1]))

    def _move(self, view: SliceView, at: QPoint) -> None:
        local = QPointF(at)
        event = QMouseEvent(
            QEvent.Type.MouseMove, local, QPointF(view.mapToGlobal(local)), _LEFT, _LEFT, _NONE
        )
        QApplication.sendEvent(view, event)

    def _turn_wheel(self, view: SliceView, angle: int, modifier: Qt.KeyboardModifier) -> None:
        local = QPointF(view.rect().center())
        event = QWheelEvent(
            local,
            QPointF(view.mapToGlobal(local)),
            QPoint(),
            QPoint(0, angle),
            Qt.MouseButton.NoButton,
            modifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(view, event)

    def _settle(self) -> None:
        QApplication.processEvents()
