"""Python's collector of reference cycles, kept in the GUI thread."""

import gc
import sys

from PySide6.QtCore import QObject, QTimer

# A thread that reads hundreds of files makes a hundred thousand objects a second: to look at those of a whole
# second holds the window up for a tenth of one.
_LOOK_EVERY_MS = 200
# The older generations come round as seldom as if it were looked once a second.
_LOOKS_A_SECOND = 1000 // _LOOK_EVERY_MS
_MANY_MODULES = 20


class GarbageCollection(QObject):
    """Collects cycles by a timer of the GUI thread, and keeps Python from doing it anywhere else.

    Python collects in whatever thread happens to allocate. A cycle with a widget in it, collected by a thread
    that reads slices, deletes that widget outside of the GUI thread: it takes Qt's lock of signals and waits
    for the interpreter, which the GUI thread holds while it waits for the lock. The program stands still.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._modules = len(sys.modules)
        self._timer = QTimer(self)
        self._timer.setInterval(_LOOK_EVERY_MS)
        self._timer.timeout.connect(self._on_timer_timeout)

    def start(self) -> None:
        """Take the collection over."""
        gc.disable()
        self._timer.start()

    def settle(self) -> None:
        """Leave what is there by now out of further collections: modules and window do not become garbage.

        With Mayavi's it would take an eighth of a second to look at them all, again and again; and also this
        once, for what is little. Of what is not collected yet, the cycles stay as long as the program runs.
        """
        gc.freeze()
        self._modules = len(sys.modules)

    def stop(self) -> None:
        """Give the collection back, when no other thread runs any more."""
        self._timer.stop()
        gc.unfreeze()
        gc.enable()

    def _on_timer_timeout(self) -> None:
        """Do what Python would have done by now: the oldest generation whose count is over its threshold."""
        if len(sys.modules) >= self._modules + _MANY_MODULES:
            # What a report or a network is made with came late, and stays too.
            self.settle()
        youngest, middle, oldest = gc.get_threshold()
        most = (youngest, _LOOKS_A_SECOND * middle, oldest)
        for generation in (2, 1, 0):
            if gc.get_count()[generation] > most[generation]:
                gc.collect(generation)
                return
