"""A field for a number of things of which there are only so many."""

import re

from PySide6.QtCore import Signal, Slot
from PySide6.QtGui import QValidator
from PySide6.QtWidgets import QSpinBox, QWidget


class ClampedCount(QSpinBox):
    """Takes a number that is too large for the largest one, and says so.

    By itself Qt would not let the number be typed at all, without a word.

    Signals
    -------
    clamped : int
        What was typed.
    """

    clamped = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.lineEdit().textEdited.connect(self._on_line_edit_text_edited)

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        if self._too_large(text) is not None:
            return QValidator.State.Intermediate, text, position
        state, text, position = super().validate(text, position)
        return state, text, position

    def _too_large(self, text: str) -> int | None:
        typed = re.match(r"\s*(\d{1,9})\s*$", text.removesuffix(self.suffix()))
        return int(typed[1]) if typed is not None and int(typed[1]) > self.maximum() else None

    @Slot(str)
    def _on_line_edit_text_edited(self, text: str) -> None:
        typed = self._too_large(text)
        if typed is not None:
            self.setValue(self.maximum())
            # Where that was the number before, its text has not been written anew.
            self.lineEdit().setText(f"{self.maximum()}{self.suffix()}")
            self.clamped.emit(typed)
