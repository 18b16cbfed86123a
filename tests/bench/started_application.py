"""The command ``annotator``, which says when it can be used: ``python -m tests.bench.started_application``.

Prints one line of JSON for each stage with the clock's time, `time.monotonic`, and leaves after the last one.
Whoever measures its start reads them: `tests.bench.starting`.
"""

import json
import sys
import time
from collections.abc import Callable

from annotator import __main__ as command
from annotator.startup import toolkit


def main() -> int:
    """Run the command with this program's own arguments."""
    # Before Qt is imported, as the command does it; what is imported here is what it imports next.
    toolkit.prepare(headless=False)
    from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer
    from PySide6.QtWidgets import QApplication

    from annotator.startup import start
    from annotator.window.main_window import MainWindow
    from tests.bench.frames import Frames
    from tests.bench.watchdog import Watchdog

    with_volume = len(sys.argv) > 1

    class Probe(QObject):
        """Looks every millisecond which stage has been reached."""

        def __init__(self, application: QApplication) -> None:
            super().__init__(application)
            self._waits: list[tuple[str, Callable[[MainWindow], bool]]] = [
                ("window", self._answers),
                *([("first_slice", self._has_slice)] if with_volume else []),
                ("scene", self._has_scene),
            ]
            self._asked = self._answered = False
            self._watchdog = Watchdog()
            self._timer = QTimer(self, interval=1, timerType=Qt.TimerType.PreciseTimer)
            self._timer.timeout.connect(self._on_timer_timeout)
            self._timer.start()

        def event(self, event: QEvent) -> bool:
            if event.type() == QEvent.Type.User:
                self._answered = True
                return True
            return super().event(event)

        def _on_timer_timeout(self) -> None:
            shown = [each for each in QApplication.topLevelWidgets() if isinstance(each, MainWindow)]
            if not shown or not self._waits[0][1](shown[0]):
                return
            stage, _ = self._waits.pop(0)
            said = {"stage": stage, "at_s": time.monotonic(), "cpu_s": time.process_time()}
            print(json.dumps(said), flush=True)
            if stage == "window":
                self._watchdog.__enter__()
            if not self._waits:
                self._timer.stop()
                self._watchdog.__exit__(None, None, None)
                watch = self._watchdog.watch
                print(json.dumps({"watch": watch.plain()}), flush=True)
                shown[0].close()

        def _answers(self, window: MainWindow) -> bool:
            handle = window.windowHandle()
            if handle is not None and handle.isExposed() and not self._asked:
                self._asked = True
                # After whatever is still to be painted.
                QCoreApplication.postEvent(
                    self, QEvent(QEvent.Type.User), Qt.EventPriority.LowEventPriority.value
                )
            return self._answered

        def _has_slice(self, window: MainWindow) -> bool:
            return window.session.volume is not None and any(view.times_drawn for view in window.slices)

        def _has_scene(self, window: MainWindow) -> bool:
            canvas = window.scene._construction.canvas
            if canvas is not None and self._watchdog.frames is None:
                # Before the first frame.
                self._watchdog.frames = Frames(canvas.window)
            is_built = window.scene._stage is not None
            return is_built and (not with_volume or window.scene.volume_draws > 0)

    made = start.make_application

    def make_application() -> QApplication:
        application = made()
        Probe(application)
        return application

    start.make_application = make_application
    return command.main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
