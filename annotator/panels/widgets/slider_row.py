"""One number, by slider and by typing."""

import math

from PySide6.QtCore import QObject, QSignalBlocker, Signal, Slot
from PySide6.QtWidgets import QGridLayout, QLabel, QSizePolicy

from annotator.panels.widgets.quiet_inputs import QuietSlider, QuietSpinBox

_STEPS = 1000


class SliderRow(QObject):
    """A label, a slider and a spin box in one row of a grid, that ask together for one value.

    Signals
    -------
    value_requested : float
        Moved or typed by a person, never by `set_value`.
    """

    value_requested = Signal(float)

    def __init__(self, grid: QGridLayout, row: int, title: str, tooltip: str, *, name: str) -> None:
        super().__init__(grid)
        self._low, self._high = 0.0, 1.0
        self._slider = QuietSlider()
        self._slider.setRange(0, _STEPS)
        self._slider.setObjectName(f"{name}_slider")
        self._box = QuietSpinBox()
        self._box.setObjectName(f"{name}_box")
        self._box.setRange(-1e12, 1e12)
        self._box.setKeyboardTracking(False)
        self._box.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._box.setFixedWidth(
            self._box.fontMetrics().horizontalAdvance("−00000.0") + self._box.fontMetrics().height() * 2
        )
        label = QLabel(title)
        label.setBuddy(self._box)
        for column, widget in enumerate((label, self._slider, self._box)):
            widget.setToolTip(tooltip)
            widget.setAccessibleName(title.replace("&", ""))
            grid.addWidget(widget, row, column)
        self._slider.valueChanged.connect(self._on_slider_value_changed)
        self._box.valueChanged.connect(self._on_box_value_changed)

    def set_range(self, low: float, high: float, step: float) -> None:
        """Say between which values the slider runs; the box takes others too."""
        self._low, self._high = low, high
        with QSignalBlocker(self._box):
            self._box.setDecimals(0 if step >= 1 else min(6, 1 - math.floor(math.log10(step))))
        self._box.setSingleStep(step)

    def set_value(self, value: float) -> None:
        """Show a value."""
        fraction = (value - self._low) / (self._high - self._low)
        with QSignalBlocker(self._slider), QSignalBlocker(self._box):
            self._slider.setValue(round(min(max(fraction, 0.0), 1.0) * _STEPS))
            self._box.setValue(value)

    @Slot(int)
    def _on_slider_value_changed(self, steps: int) -> None:
        self.value_requested.emit(self._low + steps / _STEPS * (self._high - self._low))

    @Slot(float)
    def _on_box_value_changed(self, value: float) -> None:
        self.value_requested.emit(value)
