"""Something that lasts as long as a key is held."""

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent

from annotator.looks.application import running_application

_REPEAT_MS = 60


class HeldKey(QObject):
    """Waits for a key to be let go, wherever the focus is by then.

    Some displays tell of a key that repeats as if it were let go and pressed again each time; so a release
    counts only if no press follows at once.

    Signals
    -------
    released
        The key was let go, or the program is no longer the active one and would not hear of it.
    """

    released = Signal()

    def __init__(self, key: Qt.Key, parent: QObject) -> None:
        super().__init__(parent)
        self._key = key
        self._release = QTimer(self)
        self._release.setSingleShot(True)
        self._release.setInterval(_REPEAT_MS)
        self._release.timeout.connect(self._end)

    @property
    def may_repeat(self) -> bool:
        """Whether the key was let go so recently that pressing it may be a repetition."""
        return self._release.isActive()

    def watch(self) -> None:
        """Begin to wait, or go on waiting when the key was only repeated."""
        self._release.stop()
        # Only while the key is held: a filter on the whole application slows every event.
        running_application().installEventFilter(self)

    def eventFilter(self, _: QObject, event: QEvent) -> bool:
        """Look for the release among the application's events."""
        if event.type() == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            if event.key() == self._key and not event.isAutoRepeat():
                self._release.start()
        elif event.type() == QEvent.Type.ApplicationDeactivate:
            self._end()
        return False

    def _end(self) -> None:
        self._release.stop()
        running_application().removeEventFilter(self)
        self.released.emit()
