"""The cropping box, by slider and by typing."""

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QDoubleSpinBox, QPushButton
from pytestqt.qtbot import QtBot

from annotator.panels.display.cropping_controls import CroppingControls
from annotator.panels.widgets.range_slider import RangeSlider
from annotator.session import Session

LEFT = Qt.MouseButton.LeftButton
# Centre of the last voxel of the small volume of 40 × 60 × 50.
EXTENT_UM = (39 * 15.9, 59 * 13.5, 49 * 9.4)


@pytest.fixture
def controls(qtbot: QtBot, session: Session) -> CroppingControls:
    controls = CroppingControls(session)
    qtbot.addWidget(controls)
    controls.resize(420, 160)
    with qtbot.waitActive(controls):
        controls.show()
        controls.activateWindow()
    return controls


def slider(controls: CroppingControls, axis: str) -> RangeSlider:
    found = controls.findChild(RangeSlider, f"cropping_{axis}")
    assert isinstance(found, RangeSlider)
    return found


def box(controls: CroppingControls, name: str) -> QDoubleSpinBox:
    found = controls.findChild(QDoubleSpinBox, f"cropping_{name}")
    assert isinstance(found, QDoubleSpinBox)
    return found


def drag(qtbot: QtBot, target: RangeSlider, begin: float, end: float) -> None:
    first, last = (QPoint(round(target.x_of(part)), target.height() // 2) for part in (begin, end))
    qtbot.mousePress(target, LEFT, pos=first)
    qtbot.mouseMove(target, last)
    qtbot.mouseRelease(target, LEFT, pos=last)


def type_number(qtbot: QtBot, target: QDoubleSpinBox, text: str) -> None:
    target.setFocus()
    target.selectAll()
    qtbot.keyClicks(target, text)
    qtbot.keyClick(target, Qt.Key.Key_Return)


def reset(controls: CroppingControls) -> QPushButton:
    found = controls.findChild(QPushButton, "cropping_reset")
    assert isinstance(found, QPushButton)
    return found


def test_the_whole_volume_is_shown_at_first(session: Session, controls: CroppingControls) -> None:
    assert session.view.cropping_um is None
    assert box(controls, "x_from").value() == 0
    assert box(controls, "x_to").value() == 0.62
    assert not reset(controls).isEnabled()


def test_a_dragged_handle_crops_and_back_again_does_not(
    qtbot: QtBot, session: Session, controls: CroppingControls
) -> None:
    drag(qtbot, slider(controls, "y"), 1.0, 0.5)
    assert session.view.cropping_um is not None
    low_um, high_um = session.view.cropping_um
    assert low_um == (0.0, 0.0, 0.0)
    assert high_um == pytest.approx((EXTENT_UM[0], EXTENT_UM[1] / 2, EXTENT_UM[2]), rel=0.02)
    drag(qtbot, slider(controls, "y"), 0.5, 1.0)
    assert session.view.cropping_um is None


def test_handles_do_not_cross(qtbot: QtBot, session: Session, controls: CroppingControls) -> None:
    drag(qtbot, slider(controls, "z"), 1.0, 0.4)
    drag(qtbot, slider(controls, "z"), 0.0, 0.9)
    assert session.view.cropping_um is not None
    low_um, high_um = session.view.cropping_um
    assert low_um[2] == high_um[2] == pytest.approx(0.4 * EXTENT_UM[2], rel=0.05)


def test_ends_are_typed_in_millimetres(qtbot: QtBot, session: Session, controls: CroppingControls) -> None:
    type_number(qtbot, box(controls, "x_from"), "0.1")
    type_number(qtbot, box(controls, "x_to"), "0.3")
    assert session.view.cropping_um is not None
    low_um, high_um = session.view.cropping_um
    assert (low_um[0], high_um[0]) == pytest.approx((100.0, 300.0))
    type_number(qtbot, box(controls, "x_from"), "0.5")
    low_um, high_um = session.view.cropping_um
    assert (low_um[0], high_um[0]) == pytest.approx((500.0, 500.0))


def test_more_than_the_volume_cannot_be_typed(
    qtbot: QtBot, session: Session, controls: CroppingControls
) -> None:
    type_number(qtbot, box(controls, "x_to"), "99")
    assert box(controls, "x_to").value() <= 0.62
    type_number(qtbot, box(controls, "x_from"), "-5")
    assert box(controls, "x_from").value() >= 0


def test_everything_is_shown_again(qtbot: QtBot, session: Session, controls: CroppingControls) -> None:
    drag(qtbot, slider(controls, "x"), 0.0, 0.3)
    assert reset(controls).isEnabled()
    qtbot.mouseClick(reset(controls), LEFT)
    assert session.view.cropping_um is None
    assert box(controls, "x_from").value() == 0


def test_the_sliders_show_the_view(session: Session, controls: CroppingControls) -> None:
    session.look(cropping_um=((62.01, 0.0, 0.0), (310.05, EXTENT_UM[1], EXTENT_UM[2])))
    assert box(controls, "x_from").value() == 0.06
    assert box(controls, "x_to").value() == 0.31
    image = slider(controls, "x").grab().toImage()
    middle = image.height() // 2
    inside = image.pixelColor(round(slider(controls, "x").x_of(0.3)), middle)
    outside = image.pixelColor(round(slider(controls, "x").x_of(0.8)), middle)
    assert inside != outside


def test_without_a_volume_there_is_nothing_to_crop(session: Session, controls: CroppingControls) -> None:
    session.close_volume()
    assert not slider(controls, "x").isEnabled()
    assert not box(controls, "x_to").isEnabled()
    assert not reset(controls).isEnabled()
