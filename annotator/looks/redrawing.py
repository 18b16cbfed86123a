"""Drawings that can wait, or be spared: what a person looks at first is painted first."""

from collections import deque
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
        self._is_apart = False
        self._next_turn = _NextTurn(self.draw_now, self)

    def ask(self) -> None:
        """Draw soon; what is asked for until then is one drawing."""
        if not self.is_owed or self._is_apart:
            self.is_owed, self._is_apart = True, False
            self._next_turn.wait()

    def ask_apart(self, *, first: bool = False) -> None:
        """Draw after that, and after others that ask so: each has a turn of the event loop for itself.

        For what comes with another volume, where together they would keep the window from answering. What is
        asked for in the usual way meanwhile does not wait for them.

        Parameters
        ----------
        first : bool
            Before all that wait and are not first; who asks for it first is drawn first.
        """
        if not self.is_owed:
            self.is_owed = self._is_apart = True
            _turns().add(self, first=first)

    @Slot()
    def draw_now(self) -> None:
        """Draw at once if a drawing is owed: for whoever hands on what would be drawn."""
        if self.is_owed:
            self.is_owed = False
            self._draw()

    def drop(self) -> None:
        """Forget what was asked for: everything has just been drawn."""
        self.is_owed = False


class PaintingApart(QObject):
    """Paints a widget in a turn of the event loop of its own, where most of it has changed.

    For a table that comes with another volume: to paint it takes as long as all the images.
    """

    def __init__(self, widget: QWidget) -> None:
        super().__init__(widget)
        self._widget = widget
        self._redrawing = Redrawing(self._paint, self)

    def ask(self) -> None:
        """Leave what stands there until its turn; to be called before any of it is asked to be painted."""
        if self._widget.isVisible():
            self._widget.setUpdatesEnabled(False)
            self._redrawing.ask_apart()

    def _paint(self) -> None:
        self._widget.setUpdatesEnabled(True)


class HeldPainting(QObject):
    """Keeps a window from being painted in a turn of the event loop, and has it painted in one of its own.

    For a change that nearly everything in the window reacts to: Qt would paint before it looks for input. A
    dock that floats is a window of its own, and is painted as ever.
    """

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window = window
        self._redrawing = Redrawing(self._paint, self)
        self._appearing: QWidget | None = None

    def ask(self) -> None:
        """Hold back what is asked to be painted from now on until the next turn."""
        if self._window.isVisible() and not self._redrawing.is_owed:
            self._window.installEventFilter(self)
            self._redrawing.ask_apart(first=True)

    def show(self, part: QWidget) -> None:
        """Show a part of the window; it is painted in that turn, too, if there is to be one.

        The system asks for what comes into sight, and Qt does not wait with it.
        """
        if self._redrawing.is_owed:
            part.setUpdatesEnabled(False)
            self._appearing = part
        part.show()

    def eventFilter(self, _window: QObject, event: QEvent) -> bool:
        return event.type() == QEvent.Type.UpdateRequest

    def _paint(self) -> None:
        self._window.removeEventFilter(self)
        if self._appearing is not None:
            self._appearing.setUpdatesEnabled(True)
            self._appearing = None
        # All in one go: each painting of its own would be sent to the screen for itself.
        QCoreApplication.sendEvent(self._window, QEvent(QEvent.Type.UpdateRequest))


class _NextTurn(QObject):
    """Calls back at the beginning of the turn of the event loop that follows the next painting."""

    def __init__(self, come: Callable[[], None], parent: QObject) -> None:
        super().__init__(parent)
        # Painting and the event that follows it are one turn of the event loop, which a timer without delay
        # ends. What the timer queues begins the next one.
        self._turn_end = QTimer(self, singleShot=True)
        self._turn_end.timeout.connect(come, Qt.ConnectionType.QueuedConnection)

    def wait(self) -> None:
        QCoreApplication.postEvent(self, QEvent(QEvent.Type.User), _AFTER_PAINTING)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.User:
            self._turn_end.start()
            return True
        return super().event(event)


class _Turns(QObject):
    """Lets drawings that do not hurry have a turn each, in which that is painted, too."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._first: deque[Redrawing] = deque()
        self._waiting: deque[Redrawing] = deque()
        self._is_waiting = self._is_overtaken = False
        self._next_turn = _NextTurn(self._draw_next, self)

    def add(self, redrawing: Redrawing, *, first: bool) -> None:
        (self._first if first else self._waiting).append(redrawing)
        if self._is_waiting:
            # The turn that has been waited for may be the one that asks.
            self._is_overtaken |= first
        else:
            self._is_waiting = True
            self._next_turn.wait()

    @Slot()
    def _draw_next(self) -> None:
        if self._is_overtaken:
            self._is_overtaken = False
            self._next_turn.wait()
            return
        is_due = False
        while (waiting := self._first or self._waiting) and not is_due:
            redrawing = waiting.popleft()
            is_due = redrawing.is_owed and _is_there(redrawing)
        self._is_waiting = bool(self._first or self._waiting)
        if self._is_waiting:
            # Before it draws: one that fails keeps none of the others back.
            self._next_turn.wait()
        if is_due:
            redrawing.draw_now()


def _is_there(wrapped: QObject) -> bool:
    """Say whether Qt has not deleted an object yet that Python still knows."""
    try:
        wrapped.parent()
    except RuntimeError:
        return False
    return True


def _turns() -> _Turns:
    """Return the application's."""
    application = QCoreApplication.instance()
    if application is None:
        raise RuntimeError("nothing is drawn without an application")
    return application.findChild(_Turns) or _Turns(application)


def owes_drawing(parent: QObject) -> bool:
    """Say whether anything in a window or a panel was asked for that is not drawn yet."""
    return any(redrawing.is_owed for redrawing in parent.findChildren(Redrawing))


def keep_painted(widget: QWidget) -> None:
    """Let a widget of another height paint what comes into sight, and nothing else; nor its children.

    Python is asked for each cell of a table, and many panels get another height whenever one of them is
    opened. What it paints itself, if anything, has to stand where it stands at any size. The rows of a
    `QTableView` do not: scrolled to the end, they move when it becomes smaller.
    """
    widget.setAttribute(Qt.WidgetAttribute.WA_StaticContents)
