"""How soon an input is handled that arrives while the scene is drawn at its best."""

import statistics
import time

from PySide6.QtCore import QEvent, QObject, QPointF
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from tests.bench.driven_window import DrivenWindow
from tests.bench.figures import Figures
from tests.bench.handling import mouse_event

_TURN_PX = 12.0

_Type = QEvent.Type


def measure_input(driven: DrivenWindow, times: int) -> Figures:
    """Turn the volume, stop, and move the mouse on in the midst of the full frame.

    The first figure is from that frame's end until the move is handled, the second until the frame that shows
    it has been drawn; the last is how many more full frames came in between, which a person would wait for.
    """
    driven.show_pane("scene")
    scene, frames = driven.window.scene, driven.frames
    stage = scene._stage
    assert stage is not None
    assert frames is not None
    canvas = stage.canvas.widget
    at = QPointF(canvas.width() / 8, canvas.height() / 8)
    waits_ms, shown_ms, full_frames = [], [], 0
    for _ in range(times):
        QApplication.sendEvent(canvas, mouse_event(canvas, _Type.MouseButtonPress, at))
        QApplication.sendEvent(canvas, mouse_event(canvas, _Type.MouseMove, at + QPointF(_TURN_PX, 0)))
        driven.application.processEvents()
        arrival = _Arrival(driven, mouse_event(canvas, _Type.MouseMove, at + QPointF(2 * _TURN_PX, 0)))
        driven.wait(lambda arrival=arrival: arrival.handled_s is not None)  # type: ignore[misc]
        handled_s = arrival.handled_s
        assert handled_s is not None
        # The frame of the input may have been drawn by now, too.
        before = [ended_s for _, ended_s in frames.spans_s if ended_s <= handled_s]
        ended_s, count = before[-1], len(before)
        waits_ms.append(1000 * (handled_s - ended_s))
        # The frame in which it arrived is one of them.
        full_frames += arrival.full_frames - 1
        driven.wait(lambda count=count: frames.count > count)  # type: ignore[misc]
        frames.wait_for_gl()
        shown_ms.append(1000 * (time.perf_counter() - ended_s))
        QApplication.sendEvent(canvas, mouse_event(canvas, _Type.MouseButtonRelease, at))
        driven.settle()
    driven.show_pane(None)
    return {
        "full_frame_to_input_ms": statistics.median(waits_ms),
        "full_frame_to_input_longest_ms": max(waits_ms),
        "full_frame_to_frame_of_input_ms": statistics.median(shown_ms),
        "full_frames_before_input": float(full_frames),
    }


class _Arrival(QObject):
    """Posts an event when the next full frame begins, and notes when it is handled.

    Attributes
    ----------
    handled_s : float or None
        By `time.perf_counter`; None until then.
    full_frames : int
        How often until then the volume was drawn at its best.
    """

    def __init__(self, driven: DrivenWindow, event: QMouseEvent) -> None:
        super().__init__()
        self.handled_s: float | None = None
        self.full_frames = 0
        self._scene = driven.window.scene
        stage = self._scene._stage
        assert stage is not None
        self._canvas, self._window = stage.canvas.widget, stage.canvas.window
        self._event: QMouseEvent | None = event
        self._drawn = self._scene.volume_draws
        self._tag = self._window.AddObserver("StartEvent", self._on_window_start)
        self._canvas.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        if event.type() == _Type.MouseMove and self._event is None and self.handled_s is None:
            self.handled_s = time.perf_counter()
            self._window.RemoveObserver(self._tag)
            self._canvas.removeEventFilter(self)
        return False

    def _on_window_start(self, _window: object, _event: str) -> None:
        if not self._scene.is_at_rest or self._scene.volume_draws == self._drawn:
            return
        self._drawn = self._scene.volume_draws
        self.full_frames += 1
        if self._event is not None:
            event, self._event = self._event, None
            QApplication.postEvent(self._canvas, event)
