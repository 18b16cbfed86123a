"""Memory that the program has freed, and that the C library keeps for the next time."""

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

from annotator.session import Session
from annotator.startup.heap import trim_heap

# Until the slices are given back, and everything is drawn anew with nothing open.
_AFTER_MS = 1000


class FreedMemory(QObject):
    """Gives memory back to the system when no volume is open any more.

    What a volume took lies scattered in the heap, between things that stay. From volume to volume it is
    needed again at once.

    Parameters
    ----------
    session : Session
    give_back : callable
        What is called for it.
    """

    def __init__(
        self,
        session: Session,
        give_back: Callable[[], None] = trim_heap,
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
