"""A rotation as four numbers: previewed once they make one, and refused with a sentence while they do not."""

import contextlib

from PySide6.QtCore import QEvent, QObject, Qt, Signal, Slot
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QApplication, QGridLayout, QLabel, QLineEdit, QSizePolicy, QWidget

from annotations.geometry.rotations import Quaternion, quaternion
from annotator.looks.typed_numbers import NotUnderstood, parse_number

_LETTERS = "wxyz"
_DECIMALS = 5
_NO_ROTATION = "All four are zero, which is no rotation: at least one must not be"


class QuaternionEditor(QWidget):
    """Four fields w, x, y, z. They may be of any length together: what is asked for is the unit quaternion.

    Signals
    -------
    rotation_requested : (float, float, float, float)
        What the fields make now; the rotation that was shown before, while they make none.
    refused : str
        Enter was pressed, or the fields were left, and why what they hold is no rotation; empty once it is.
    settled
        A person pressed Enter or left the fields, and they make a rotation.
    """

    rotation_requested = Signal(tuple)
    refused = Signal(str)
    settled = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("quaternion_editor")
        self._rotation: Quaternion | None = None
        self._asked: Quaternion | None = None
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._fields = tuple(self._make_field(letter) for letter in _LETTERS)
        for place, field in enumerate(self._fields):
            label = QLabel(f"q{_LETTERS[place]}")
            label.setBuddy(field)
            layout.addWidget(label, 0, place)
            layout.addWidget(field, 1, place)
            layout.setColumnStretch(place, 1)

    @property
    def is_typed(self) -> bool:
        """Whether a field holds something else than the rotation that is shown."""
        return self._rotation is not None and self._texts() != _texts_of(self._rotation)

    def show_rotation(self, rotation_wxyz: Quaternion | None, *, over_typing: bool = False) -> None:
        """Show a rotation, or none; what is being typed stays as long as the rotation follows from it."""
        was_shown = rotation_wxyz == self._rotation or rotation_wxyz == self._asked
        if was_shown and not over_typing:
            return
        self._rotation, self._asked = rotation_wxyz, None
        texts = _texts_of(rotation_wxyz) if rotation_wxyz is not None else ("",) * 4
        for field, text in zip(self._fields, texts, strict=True):
            field.setText(text)
            field.setCursorPosition(0)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take Enter from the fields, and see when they are left."""
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._settle(leaving=False)
                return True
        elif isinstance(event, QFocusEvent) and event.type() == QEvent.Type.FocusOut:
            # A menu that pops up takes the focus for a moment only.
            pops_up = event.reason() == Qt.FocusReason.PopupFocusReason
            if not pops_up and QApplication.focusWidget() not in self._fields:
                self._settle(leaving=True)
        return super().eventFilter(watched, event)

    def _make_field(self, letter: str) -> QLineEdit:
        field = QLineEdit(self)
        field.setObjectName(f"quaternion_{letter}")
        field.setAccessibleName(f"{letter} of the quaternion")
        field.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        field.setMinimumWidth(
            field.fontMetrics().horizontalAdvance("-0.00000") + field.fontMetrics().height() // 2
        )
        field.textEdited.connect(self._on_field_text_edited)
        field.installEventFilter(self)
        return field

    @Slot()
    def _on_field_text_edited(self) -> None:
        typed = self._rotation
        # In the middle of a number; Enter says what is wrong with it.
        with contextlib.suppress(NotUnderstood):
            typed = self._typed()
        if typed is not None:
            self._ask(typed)

    def _settle(self, *, leaving: bool) -> None:
        if not self.is_typed:
            return
        try:
            typed = self._typed()
        except NotUnderstood as error:
            self.refused.emit(f"{error}. Nothing was changed{'' if leaving else ' yet'}.")
            if leaving:
                self.show_rotation(self._rotation, over_typing=True)
            return
        self._ask(typed)
        self.refused.emit("")
        self.settled.emit()

    def _ask(self, rotation_wxyz: Quaternion) -> None:
        self._asked = rotation_wxyz
        self.rotation_requested.emit(rotation_wxyz)

    def _typed(self) -> Quaternion:
        """Return the rotation that the fields make; NotUnderstood where they make none."""
        if self._rotation is None:
            raise NotUnderstood("There is no box to turn")
        shown = _texts_of(self._rotation)
        # What is shown is rounded; a field that was left as it is must not round its number.
        numbers = [
            exact if text == known else parse_number(text)
            for text, known, exact in zip(self._texts(), shown, self._rotation, strict=True)
        ]
        try:
            return quaternion(numbers)
        except ValueError:
            raise NotUnderstood(_NO_ROTATION) from None

    def _texts(self) -> tuple[str, ...]:
        return tuple(field.text() for field in self._fields)


def _texts_of(rotation_wxyz: Quaternion) -> tuple[str, ...]:
    # Adding zero turns −0.0 into 0.0.
    return tuple(f"{round(number, _DECIMALS) + 0.0:.{_DECIMALS}f}" for number in rotation_wxyz)
