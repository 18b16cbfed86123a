"""Numbers that are shown rounded and never rounded by being shown; several typed in a row are one wish."""

import math
from collections.abc import Sequence

from PySide6.QtCore import QObject, QSignalBlocker, QTimer, Signal, Slot
from PySide6.QtWidgets import QApplication, QSizePolicy, QWidget

from annotator.panels.widgets.quiet_inputs import QuietSpinBox

_SETTLE_MS = 700
_DECIMALS = 2
_FARTHEST = 1e9


class NumberField(QuietSpinBox):
    """A spin box for one number. Only another number than that which it shows is a person's wish.

    Parameters
    ----------
    lowest, highest : float
        What can be typed.

    Signals
    -------
    number_requested : float
        Typed or stepped by a person, never by `show_number`.
    """

    number_requested = Signal(float)

    def __init__(
        self,
        name: str,
        title: str,
        *,
        lowest: float = -_FARTHEST,
        highest: float = _FARTHEST,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._number = 0.0
        self.setObjectName(name)
        self.setAccessibleName(title)
        self.setDecimals(_DECIMALS)
        self.setRange(lowest, highest)
        # Its own hint would leave room for the largest number allowed.
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.setMinimumWidth(
            self.fontMetrics().horizontalAdvance("00000.0") + self.fontMetrics().height() * 2
        )
        self.valueChanged.connect(self._on_value_changed)

    def show_number(self, number: float, step: float, *, over_typing: bool = False) -> None:
        """Show a number and what the arrows add to it; text that stands for it stays as it was typed."""
        self._number = number
        # Setting either rewrites the text, and would move the cursor of the person who is typing it.
        if self.singleStep() != step:
            self.setSingleStep(step)
        # A field that was empty and out of use has kept its value without showing it.
        if over_typing or not self.isEnabled() or not self._is_shown():
            with QSignalBlocker(self):
                self.setValue(number)

    def show_nothing(self) -> None:
        """Empty the field: the last number was another volume's."""
        with QSignalBlocker(self):
            self.clear()

    @Slot(float)
    def _on_value_changed(self, value: float) -> None:
        # Enter repeats the value that is shown, rounded: that is no wish to round the number.
        if not self._is_shown():
            self.number_requested.emit(value)

    def _is_shown(self) -> bool:
        """Say whether the number and what is shown are the same in the field's decimals."""
        return math.isclose(self.value(), self._number, rel_tol=0, abs_tol=0.6 * 10**-_DECIMALS)


class NumberFields(QObject):
    """Fields that are typed in a row: going from one of them to the next is not leaving.

    Signals
    -------
    number_requested : int, float
        Which of the fields, and the number.
    settled
        A person pressed Enter, left the fields, or has stopped stepping.
    """

    number_requested = Signal(int, float)
    settled = Signal()

    def __init__(self, fields: Sequence[NumberField], parent: QObject) -> None:
        super().__init__(parent)
        self._fields = tuple(fields)
        for field in self._fields:
            field.number_requested.connect(self._on_field_number_requested)
            field.stepped.connect(self._on_field_stepped)
            field.editingFinished.connect(self._on_field_editing_finished)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_SETTLE_MS)
        self._rest.timeout.connect(self.settled)

    @property
    def fields(self) -> tuple[NumberField, ...]:
        """The fields in their order."""
        return self._fields

    @property
    def is_resting(self) -> bool:
        """Whether a person has stepped, and may step on: the number settles soon."""
        return self._rest.isActive()

    def stop(self) -> None:
        """Forget that a person has stepped."""
        self._rest.stop()

    @Slot(float)
    def _on_field_number_requested(self, number: float) -> None:
        # Only steps come to rest by themselves; a person may pause in the middle of a number.
        self._rest.stop()
        field = self.sender()
        if isinstance(field, NumberField):
            self.number_requested.emit(self._fields.index(field), number)

    @Slot()
    def _on_field_stepped(self) -> None:
        self._rest.start()

    @Slot()
    def _on_field_editing_finished(self) -> None:
        focused = QApplication.focusWidget()
        if focused is self.sender() or focused not in self._fields:
            self._rest.stop()
            self.settled.emit()
