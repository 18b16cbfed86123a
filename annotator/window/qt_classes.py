"""Qt's classes, made by the thread that uses them."""

from collections.abc import Callable, Iterator

import PySide6.QtCore
import PySide6.QtGui
import PySide6.QtWidgets
from PySide6.QtCore import QElapsedTimer, QObject, QTimer, Slot

_MODULES = (PySide6.QtCore, PySide6.QtGui, PySide6.QtWidgets)
_AT_A_TIME_MS = 5


class QtClasses(QObject):
    """Makes the classes that PySide puts off until somebody names them, a few in each turn of the event loop.

    Mayavi names all of them when it is imported. An import in another thread would make them there, in steps
    between which Python's lock changes hands; and what the window calls meanwhile finds half a class: one
    start in thirty ended in a segmentation fault.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._names = _names()
        self._then: Callable[[], object] | None = None
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._on_timer_timeout)

    def make(self, then: Callable[[], object]) -> None:
        """Begin, or begin again after `stop`; call ``then()`` when there are all."""
        self._then = then
        self._timer.start()

    def stop(self) -> None:
        """Make no more, and call nobody."""
        self._then = None
        self._timer.stop()

    @Slot()
    def _on_timer_timeout(self) -> None:
        clock = QElapsedTimer()
        clock.start()
        for module, name in self._names:
            getattr(module, name, None)
            if clock.elapsed() >= _AT_A_TIME_MS:
                return
        then = self._then
        self.stop()
        if then is not None:
            then()


def _names() -> Iterator[tuple[object, str]]:
    return ((module, name) for module in _MODULES for name in dir(module))
