"""The part of the volume that the scene shows: a range along each axis."""

from PySide6.QtCore import QSignalBlocker, Slot
from PySide6.QtWidgets import QGridLayout, QPushButton, QSizePolicy, QVBoxLayout, QWidget

from annotations.geometry.frames import Vector, extent_um, vector
from annotator.looks.labels import ColoredLabel, axis_color
from annotator.looks.naming import named
from annotator.panels.widgets.quiet_inputs import QuietSpinBox
from annotator.panels.widgets.range_slider import RangeSlider
from annotator.session import Session
from annotator.session.viewing.view import View

_ENDS = ("from", "to")


class CroppingControls(QWidget):
    """Three ranges in mm and a button that shows everything again; slices are never cropped."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setObjectName("cropping_controls")
        self._sliders: list[RangeSlider] = []
        self._boxes: list[tuple[QuietSpinBox, QuietSpinBox]] = []
        self._drawn: object = None
        grid = QGridLayout()
        grid.setColumnStretch(1, 1)
        for axis, letter in enumerate("xyz"):
            label = ColoredLabel(letter)
            label.set_color(axis_color(axis))
            slider = RangeSlider()
            slider.setObjectName(f"cropping_{letter}")
            slider.setAccessibleName(f"Part along {letter}")
            slider.setToolTip(f"Part of the volume along {letter} that the scene shows")
            slider.range_requested.connect(self._on_slider_range_requested)
            low, high = (self._make_box(letter, end) for end in _ENDS)
            for column, widget in enumerate((label, slider, low, high)):
                grid.addWidget(widget, axis, column)
            self._sliders.append(slider)
            self._boxes.append((low, high))
        self._reset = named(QPushButton("Show e&verything"), "cropping_reset")
        self._reset.setToolTip("Take the cropping box away")
        self._reset.clicked.connect(self._on_reset_clicked)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(grid)
        layout.addWidget(self._reset)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw()

    def _make_box(self, letter: str, end: str) -> QuietSpinBox:
        box = QuietSpinBox()
        box.setObjectName(f"cropping_{letter}_{end}")
        box.setAccessibleName(f"Part along {letter}, {end}, in mm")
        box.setToolTip(f"Where the shown part along {letter} {'begins' if end == 'from' else 'ends'}, in mm")
        box.setDecimals(2)
        box.setSingleStep(0.1)
        box.setKeyboardTracking(False)
        box.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        box.setFixedWidth(box.fontMetrics().horizontalAdvance("00.00") + box.fontMetrics().height() * 2)
        box.valueChanged.connect(self._on_box_value_changed)
        return box

    @Slot(float, float)
    def _on_slider_range_requested(self, low: float, high: float) -> None:
        slider = self.sender()
        if isinstance(slider, RangeSlider):
            axis = self._sliders.index(slider)
            length_um = self._extent_um()[axis]
            self._ask(axis, low * length_um, high * length_um)

    @Slot()
    def _on_box_value_changed(self) -> None:
        changed = self.sender()
        for axis, (low, high) in enumerate(self._boxes):
            if changed in (low, high):
                low_mm, high_mm = low.value(), high.value()
                if changed is low:
                    high_mm = max(low_mm, high_mm)
                else:
                    low_mm = min(low_mm, high_mm)
                self._ask(axis, low_mm * 1000, high_mm * 1000)

    @Slot()
    def _on_reset_clicked(self) -> None:
        self._session.look(cropping_um=None)

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.cropping_um != after.cropping_um:
            self._draw()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._draw()

    def _ask(self, axis: int, low_um: float, high_um: float) -> None:
        whole = self._extent_um()
        part_low, part_high = (list(corner) for corner in self._part())
        # The boxes round to 10 µm: the last of them means the very end.
        nearly = 5.0
        part_low[axis] = 0.0 if low_um < nearly else min(low_um, whole[axis])
        part_high[axis] = whole[axis] if high_um > whole[axis] - nearly else max(high_um, 0.0)
        part = (vector(part_low), vector(part_high))
        self._session.look(cropping_um=None if part == ((0.0, 0.0, 0.0), whole) else part)

    def _extent_um(self) -> Vector:
        volume, spacing_um = self._session.volume, self._session.spacing_um
        if volume is None or spacing_um is None:
            return (0.0, 0.0, 0.0)
        return extent_um(volume.shape, spacing_um)

    def _part(self) -> tuple[Vector, Vector]:
        return self._session.view.cropping_um or ((0.0, 0.0, 0.0), self._extent_um())

    def _draw(self) -> None:
        whole, (part_low, part_high) = self._extent_um(), self._part()
        drawn, self._drawn = self._drawn, (whole, self._session.view.cropping_um)
        if self._drawn == drawn:
            # As from one volume of a study to the next: the fields would ask for their room again.
            return
        for axis, (slider, boxes) in enumerate(zip(self._sliders, self._boxes, strict=True)):
            length_um = whole[axis]
            slider.setEnabled(length_um > 0)
            slider.set_range(
                *(
                    part[axis] / length_um if length_um else side
                    for side, part in enumerate((part_low, part_high))
                )
            )
            for box, value_um in zip(boxes, (part_low[axis], part_high[axis]), strict=True):
                with QSignalBlocker(box):
                    box.setEnabled(length_um > 0)
                    box.setRange(0, round(length_um / 1000, 2))
                    box.setValue(value_um / 1000)
        self._reset.setEnabled(self._session.view.cropping_um is not None)
