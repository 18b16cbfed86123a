"""Memory that the program has freed, and that the C library keeps for the next time."""

import ctypes
import sys
from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

from annotator.session import Session

# Until the slices are given back, and everything is drawn anew with nothing open.
_AFTER_MS = 1000


def _trim_heap() -> None:
    """Give free memory back to the system; only the GNU C library has to be told."""
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)) is not None:
        trim(0)


class FreedMemory(QObject):
    """Gives memory back to the system when no volume is open any more.

    By itself the GNU C library gives back only what lies at the end of its heap, and what thousands of edits
    took lies scattered between things that stay. From volume to volume it is needed again at once.

    Parameters
    ----------
    session : Session
    give_back : callable
        What is called for it.
    """

    def __init__(
        self,
        session: Session,
        give_back: Callable[[], None] = _trim_heap,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._timer = QTimer(self, singleShot=True, interval=_AFTER_MS)
        self._timer.timeout.connect(give_back)
        session.volume_changed.connect(self._on_session_volume_changed)

    def _on_session_volume_changed(self) -> None:
        if self._session.volume is None:
            self._timer.start()
        else:
            self._timer.stop()
