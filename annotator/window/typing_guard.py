"""Keeps the window's keys from acting while the focus is where the same keys mean something else."""

from PySide6.QtCore import QEvent, QObject, Qt, Slot
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QWidget,
)

from annotator.looks.application import running_application

_NAVIGATING = frozenset(
    (
        Qt.Key.Key_Left,
        Qt.Key.Key_Right,
        Qt.Key.Key_Up,
        Qt.Key.Key_Down,
        Qt.Key.Key_PageUp,
        Qt.Key.Key_PageDown,
        Qt.Key.Key_Home,
        Qt.Key.Key_End,
        Qt.Key.Key_Space,
        Qt.Key.Key_Return,
        Qt.Key.Key_Enter,
    )
)
_PLAIN = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.KeypadModifier


class TypingGuard(QObject):
    """Decides for every key of a window whether the focused widget has it before the actions.

    Text fields have every key that is not held with Ctrl, Alt or Meta; lists, tables, buttons and sliders
    have the keys to move in them and to press them. The image panes leave all keys to the actions.

    Parameters
    ----------
    panes : QWidget
        What holds the image panes.
    """

    def __init__(self, panes: QWidget) -> None:
        super().__init__(panes)
        self._panes = panes
        running_application().focusChanged.connect(self._on_application_focus_changed)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Answer Qt's question whether the focused widget wants a key for itself."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.ShortcutOverride:
            return False
        if not isinstance(watched, QWidget):
            return False
        if self._belongs_to(watched, event):
            event.accept()
            return True
        if _is_undo_of_nothing(watched, event):
            event.ignore()
            return True
        return False

    @Slot(QWidget, QWidget)
    def _on_application_focus_changed(self, old: QWidget | None, new: QWidget | None) -> None:
        # Only the focused widget is watched: a filter on the whole application would slow every event.
        if old is not None:
            old.removeEventFilter(self)
        if new is not None and new.window() is self._panes.window():
            new.installEventFilter(self)

    def _belongs_to(self, widget: QWidget, event: QKeyEvent) -> bool:
        if event.modifiers() & ~_PLAIN or self._panes.isAncestorOf(widget):
            return False
        if _takes_text(widget):
            # Function keys are no text.
            return not Qt.Key.Key_F1 <= event.key() <= Qt.Key.Key_F35
        return event.key() in _NAVIGATING and widget is not self._panes.window()


def _takes_text(widget: QWidget) -> bool:
    if isinstance(widget, QComboBox):
        return widget.isEditable()
    return isinstance(widget, QLineEdit | QAbstractSpinBox | QTextEdit | QPlainTextEdit)


def _is_undo_of_nothing(widget: QWidget, event: QKeyEvent) -> bool:
    """Say whether a line edit would swallow an undo or redo although nothing was typed in it."""
    line = widget
    if isinstance(widget, QAbstractSpinBox):
        line = widget.findChild(QLineEdit) or widget
    if not isinstance(line, QLineEdit):
        return False
    undo = event.matches(QKeySequence.StandardKey.Undo) and not line.isUndoAvailable()
    return undo or (event.matches(QKeySequence.StandardKey.Redo) and not line.isRedoAvailable())
