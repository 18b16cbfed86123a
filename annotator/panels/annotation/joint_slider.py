"""The angle of one joint as a slider: moving it previews, letting it go keeps."""

from PySide6.QtCore import QSignalBlocker, QTimer, Signal, Slot
from PySide6.QtGui import QFocusEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from annotations.geometry.tool import Joint
from annotator.panels.widgets.quiet_inputs import QuietSlider

_STEPS_PER_DEG = 10
_SETTLE_MS = 700


class JointSlider(QuietSlider):
    """Runs over the limits of a joint.

    Signals
    -------
    angle_requested : float, bool
        The signed angle in degrees, and whether it came by key, wheel or click rather than being in hand.
    settled
        It was let go; or nothing has stepped it for a moment; or a person went on to something else.
    """

    angle_requested = Signal(float, bool)
    settled = Signal()

    def __init__(self, joint: Joint, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        low_deg, high_deg = joint.limits_deg
        self.setRange(round(low_deg * _STEPS_PER_DEG), round(high_deg * _STEPS_PER_DEG))
        self.setSingleStep(_STEPS_PER_DEG)
        self.setPageStep(10 * _STEPS_PER_DEG)
        self._is_given_up = False
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_SETTLE_MS)
        self._rest.timeout.connect(self.settled)
        self.valueChanged.connect(self._on_value_changed)
        self.sliderReleased.connect(self.settled)

    def show_angle(self, angle_deg: float) -> None:
        """Show a signed angle in degrees."""
        with QSignalBlocker(self):
            self.setValue(round(angle_deg * _STEPS_PER_DEG))

    def stop(self) -> None:
        """Forget that a person has stepped; one that is in hand rests until it is let go."""
        self._rest.stop()
        self._is_given_up = self.isSliderDown()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if not self._is_given_up:
            super().mouseMoveEvent(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        super().mouseReleaseEvent(event)
        self._is_given_up = False

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if self._rest.isActive():
            self._rest.stop()
            self.settled.emit()

    @Slot(int)
    def _on_value_changed(self, value: int) -> None:
        self._rest.stop()
        is_in_hand = self.isSliderDown()
        self.angle_requested.emit(value / _STEPS_PER_DEG, not is_in_hand)
        if not is_in_hand:
            self._rest.start()
