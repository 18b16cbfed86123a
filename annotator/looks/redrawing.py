"""Drawings that can wait: what a person looks at first is painted first, the readouts beside it next."""

from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer

_AFTER_PAINTING = Qt.EventPriority.LowEventPriority.value - 1
"""Qt's wish to paint has a low priority: this one comes right after it."""


class Redrawing(QObject):
    """Draws once for any number of wishes: as soon as what was to be painted by then has been painted.

    It cannot starve. Qt sends posted events in turns, each of which ends; and after each turn it looks at its
    timers, however many events have come meanwhile.

    Attributes
    ----------
    is_owed : bool
        Whether something was asked for that is not drawn yet.
    """

    def __init__(self, draw: Callable[[], None], parent: QObject) -> None:
        super().__init__(parent)
        self._draw = draw
        self.is_owed = False
        # Painting and the event that follows it are one turn of the event loop. The drawing is in the next.
        self._next_turn = QTimer(self, singleShot=True)
        self._next_turn.timeout.connect(self.draw_now)

    def ask(self) -> None:
        """Draw soon; what is asked for until then is one drawing."""
        if not self.is_owed:
            self.is_owed = True
            QCoreApplication.postEvent(self, QEvent(QEvent.Type.User), _AFTER_PAINTING)

    def draw_now(self) -> None:
        """Draw at once if a drawing is owed: for whoever hands on what would be drawn."""
        if self.is_owed:
            self.is_owed = False
            self._draw()

    def drop(self) -> None:
        """Forget what was asked for: everything has just been drawn."""
        self.is_owed = False

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.User:
            self._next_turn.start()
            return True
        return super().event(event)
