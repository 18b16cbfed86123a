"""Inputs that the wheel changes only when they have the focus: scrolling past them must change nothing."""

from PySide6.QtCore import QLocale, Qt, Signal
from PySide6.QtGui import QKeyEvent, QValidator, QWheelEvent
from PySide6.QtWidgets import QAbstractSpinBox, QComboBox, QDoubleSpinBox, QSlider, QWidget


class QuietComboBox(QComboBox):
    """A combo box that passes the wheel on unless it has the focus."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


class QuietSlider(QSlider):
    """A horizontal slider that passes the wheel on unless it has the focus."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


class QuietSpinBox(QDoubleSpinBox):
    """A spin box for numbers with a decimal point, whatever the system's language.

    Signals
    -------
    stepped
        The value was changed by arrow, key or wheel rather than by typing.
    """

    stepped = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        # A decimal comma would have to be typed here and refused everywhere else.
        plain = QLocale(QLocale.Language.C)
        plain.setNumberOptions(
            QLocale.NumberOption.OmitGroupSeparator | QLocale.NumberOption.RejectGroupSeparator
        )
        self.setLocale(plain)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCorrectionMode(QAbstractSpinBox.CorrectionMode.CorrectToPreviousValue)

    def stepBy(self, steps: int) -> None:
        super().stepBy(steps)
        self.stepped.emit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()

    def textFromValue(self, value: float) -> str:
        """Write a number; what rounds to zero has no sign."""
        # Adding zero turns −0.0 into 0.0.
        return super().textFromValue(round(value, self.decimals()) + 0.0)

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Refuse every comma: in pasted text it could mean thousands as well as decimals.

        A minus can be typed where no negative number is allowed, and Enter brings the last number back: were
        the key only refused, −5 would become 5.
        """
        if "," in text:
            return (QValidator.State.Invalid, text, position)
        state, shown, at = super().validate(text, position)
        if state == QValidator.State.Invalid and self.minimum() >= 0 and text.lstrip().startswith("-"):
            positive, _, _ = super().validate(text.replace("-", "", 1), max(position - 1, 0))
            if positive != QValidator.State.Invalid:
                return (QValidator.State.Intermediate, text, position)
        return (state, shown, at)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.text() == ",":
            # Many number pads have no point. Were the comma only refused, 12,5 would become 125.
            point = QKeyEvent(event.type(), Qt.Key.Key_Period, event.modifiers(), ".")
            super().keyPressEvent(point)
        else:
            super().keyPressEvent(event)
