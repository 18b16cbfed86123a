"""Drawings that can wait, or be spared: what a person looks at first is painted first."""

from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QEvent, QObject, Qt, QTimer, Slot
from PySide6.QtWidgets import QWidget

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
        # Painting and the event that follows it are one turn of the event loop, which a timer without delay
        # ends. What the timer queues begins the next one.
        self._turn_end = QTimer(self, singleShot=True)
        self._turn_end.timeout.connect(self.draw_now, Qt.ConnectionType.QueuedConnection)

    def ask(self) -> None:
        """Draw soon; what is asked for until then is one drawing."""
        if not self.is_owed:
            self.is_owed = True
            QCoreApplication.postEvent(self, QEvent(QEvent.Type.User), _AFTER_PAINTING)

    @Slot()
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
            self._turn_end.start()
            return True
        return super().event(event)


def keep_painted(widget: QWidget) -> None:
    """Let a widget of another height paint what comes into sight, and nothing else; nor its children.

    Python is asked for each cell of a table, and many panels get another height whenever one of them is
    opened. What it paints itself, if anything, has to stand where it stands at any size. The rows of a
    `QTableView` do not: scrolled to the end, they move when it becomes smaller.
    """
    widget.setAttribute(Qt.WidgetAttribute.WA_StaticContents)
