"""The mouse over the scene: what was dragged, turned or clicked, told as wishes in Qt's pixels."""

from collections.abc import Callable
from typing import Literal

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

CLICK_PX = 4.0
"""A button that is released this near to where it was pressed has clicked, not dragged."""

_ZOOM_A_NOTCH = 1.15
_ANGLE_A_NOTCH = 120.0
_ZOOM_A_PX = 1.008

_Drag = Literal["turn", "hold", "shift", "zoom", "window"]
_Button = Qt.MouseButton
_Modifier = Qt.KeyboardModifier


class Gestures(QObject):
    """Takes every mouse event of a widget, so that VTK sees none.

    Parameters
    ----------
    widget : QWidget
    takes_hold : callable
        Says whether a press of the left button at a place takes hold of something, which is dragged then
        instead of the camera.

    Signals
    -------
    turn_requested, shift_requested, window_requested : QPointF
        How far the mouse was dragged since the last time: to the right, and down.
    carry_requested : QPointF
        What was taken hold of shall go along to this place of the mouse.
    released
        What was taken hold of was let go, carried or not.
    zoom_requested : float, QPointF
        How many times larger things shall be, and the place that shall stay where it is.
    pick_requested : QPointF
        A click of the left button.
    look_requested : QPointF
        A double click of the left button.
    hovered : QPointF
        The mouse moved without a button.
    left
        It is no longer over the widget.
    """

    turn_requested = Signal(QPointF)
    shift_requested = Signal(QPointF)
    window_requested = Signal(QPointF)
    carry_requested = Signal(QPointF)
    released = Signal()
    zoom_requested = Signal(float, QPointF)
    pick_requested = Signal(QPointF)
    look_requested = Signal(QPointF)
    hovered = Signal(QPointF)
    left = Signal()

    def __init__(self, widget: QWidget, takes_hold: Callable[[QPointF], bool]) -> None:
        super().__init__(widget)
        self._takes_hold = takes_hold
        self._pressed: QPointF | None = None
        self._last = QPointF()
        self._button = _Button.NoButton
        self._drag: _Drag | None = None
        self._dragged = False
        self._double = False
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if isinstance(event, QMouseEvent):
            if kind == QEvent.Type.MouseMove:
                self._move(event)
            elif kind == QEvent.Type.MouseButtonRelease:
                self._release(event)
            else:
                self._press(event, double=kind == QEvent.Type.MouseButtonDblClick)
        elif isinstance(event, QWheelEvent):
            self._wheel(event)
        elif kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            # On to the window's actions; neither Mayavi nor VTK has keys here.
            event.ignore()
        elif kind == QEvent.Type.Leave:
            self.left.emit()
        else:
            return kind == QEvent.Type.Enter
        return True

    def _press(self, event: QMouseEvent, *, double: bool) -> None:
        if self._pressed is not None:
            return  # the first button goes on
        self._pressed = self._last = event.position()
        self._button = event.button()
        self._drag = _drag_of(event.button(), event.modifiers())
        if self._drag == "turn" and self._takes_hold(event.position()):
            self._drag = "hold"
        self._dragged = False
        self._double = double

    def _move(self, event: QMouseEvent) -> None:
        if self._pressed is None:
            self.hovered.emit(event.position())
            return
        if not self._dragged and (event.position() - self._pressed).manhattanLength() < CLICK_PX:
            return
        self._dragged = True
        moved = event.position() - self._last
        self._last = event.position()
        match self._drag:
            case "turn":
                self.turn_requested.emit(moved)
            case "hold":
                self.carry_requested.emit(event.position())
            case "shift":
                self.shift_requested.emit(moved)
            case "window":
                self.window_requested.emit(moved)
            case "zoom":
                self.zoom_requested.emit(_ZOOM_A_PX ** -moved.y(), self._pressed)

    def _release(self, event: QMouseEvent) -> None:
        if self._pressed is None or event.button() != self._button:
            return
        pressed, self._pressed = self._pressed, None
        if self._drag == "hold":
            self.released.emit()
        if self._dragged or self._drag not in ("turn", "hold"):
            return
        # A double click has clicked once already: its second release is no other click.
        (self.look_requested if self._double else self.pick_requested).emit(pressed)

    def _wheel(self, event: QWheelEvent) -> None:
        notches = event.angleDelta().y() / _ANGLE_A_NOTCH
        if notches:
            self.zoom_requested.emit(_ZOOM_A_NOTCH**notches, event.position())


def _drag_of(button: Qt.MouseButton, modifiers: Qt.KeyboardModifier) -> _Drag | None:
    if button == _Button.LeftButton:
        if modifiers & _Modifier.ControlModifier:
            return "window"
        return "shift" if modifiers & _Modifier.ShiftModifier else "turn"
    if button == _Button.MiddleButton:
        return "shift"
    return "zoom" if button == _Button.RightButton else None
