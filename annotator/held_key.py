"""Something that lasts as long as a key is held."""

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QKeyEvent

from annotator.application import running_application


class HeldKey(QObject):
    """Waits for a key to be let go, wherever the focus is by then.

    Signals
    -------
    released
        The key was let go, or the program is no longer the active one and would not hear of it.
    """

    released = Signal()

    def __init__(self, key: Qt.Key, parent: QObject) -> None:
        super().__init__(parent)
        self._key = key

    def watch(self) -> None:
        """Begin to wait."""
        # Only while the key is held: a filter on the whole application slows every event.
        running_application().installEventFilter(self)

    def eventFilter(self, _: QObject, event: QEvent) -> bool:
        """Look for the release among the application's events."""
        if event.type() == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            over = event.key() == self._key and not event.isAutoRepeat()
        else:
            over = event.type() == QEvent.Type.ApplicationDeactivate
        if over:
            running_application().removeEventFilter(self)
            self.released.emit()
        return False
