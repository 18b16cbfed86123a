"""The display panel asks for the view, shows it, and changes no annotation."""

from pathlib import Path
from typing import TypeVar, get_args

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QCheckBox, QComboBox, QDoubleSpinBox, QLabel, QPushButton, QSlider, QWidget
from pytestqt.qtbot import QtBot

from annotations.volumes import intensity_window
from annotator.looks.colormaps import COLORMAPS
from annotator.panels.display import display_panel
from annotator.panels.display.display_panel import DisplayPanel
from annotator.panels.display.histogram import HistogramView, intensity_histogram
from annotator.session import Session
from annotator.session.viewing.view import FIRST_LAYERS, Layer
from tests.annotator.conftest import open_and_wait

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> DisplayPanel:
    panel = DisplayPanel(session)
    qtbot.addWidget(panel)
    panel.resize(340, 760)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    session.look(window=(20.0, 120.0), opacity_threshold=60.0)
    return panel


W = TypeVar("W", bound=QWidget)


def find(panel: DisplayPanel, kind: type[W], name: str) -> W:
    found = panel.findChild(kind, name)
    assert isinstance(found, kind)
    return found


def type_number(qtbot: QtBot, box: QDoubleSpinBox, text: str) -> None:
    box.setFocus()
    box.selectAll()
    qtbot.keyClicks(box, text)
    qtbot.keyClick(box, Qt.Key.Key_Return)


def test_the_panel_shows_the_view(session: Session, panel: DisplayPanel) -> None:
    assert find(panel, QDoubleSpinBox, "window_low_box").value() == 20
    assert find(panel, QDoubleSpinBox, "window_high_box").value() == 120
    assert find(panel, QDoubleSpinBox, "opacity_threshold_box").value() == 60
    assert find(panel, QLabel, "window_words").text() == "Window 100, level 70"
    session.look(window=(-50.0, 400.0))
    assert find(panel, QDoubleSpinBox, "window_low_box").value() == -50
    assert find(panel, QSlider, "window_low_slider").value() == 0
    assert find(panel, QSlider, "window_high_slider").value() == 1000
    assert session.view.window == (-50.0, 400.0)


def test_behind_another_panel_it_waits_and_is_right_once_it_is_seen(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, empty_session: Session, volume_path: Path
) -> None:
    counted = []
    monkeypatch.setattr(
        display_panel, "intensity_histogram", lambda data: counted.append(data) or intensity_histogram(data)
    )
    panel = DisplayPanel(empty_session)
    qtbot.addWidget(panel)
    open_and_wait(qtbot, empty_session, volume_path)
    assert counted == []
    panel.follow(False)
    panel.show()
    assert counted == []
    panel.follow(True)
    assert len(counted) == 1
    assert find(panel, QDoubleSpinBox, "window_high_box").value() == empty_session.view.window[1]
    assert find(panel, QDoubleSpinBox, "window_high_box").isEnabled()


def test_limits_are_typed(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    type_number(qtbot, find(panel, QDoubleSpinBox, "window_low_box"), "30")
    type_number(qtbot, find(panel, QDoubleSpinBox, "window_high_box"), "90")
    type_number(qtbot, find(panel, QDoubleSpinBox, "opacity_threshold_box"), "45")
    assert session.view.window == (30.0, 90.0)
    assert session.view.opacity_threshold == 45.0


def test_a_limit_pushes_the_other_one_rather_than_cross_it(
    qtbot: QtBot, session: Session, panel: DisplayPanel
) -> None:
    type_number(qtbot, find(panel, QDoubleSpinBox, "window_low_box"), "200")
    assert session.view.window == (200.0, 201.0)
    type_number(qtbot, find(panel, QDoubleSpinBox, "window_high_box"), "10")
    assert session.view.window == (9.0, 10.0)


def test_sliders_move_the_limits(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    for name in ("window_low", "window_high", "opacity_threshold"):
        slider = find(panel, QSlider, f"{name}_slider")
        slider.setFocus()
        qtbot.keyClick(slider, Qt.Key.Key_End if name == "window_high" else Qt.Key.Key_Home)
    assert session.view.window == (0.0, 255.0)
    assert session.view.opacity_threshold == 0.0


def test_auto_chooses_by_the_intensities(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    qtbot.mouseClick(find(panel, QPushButton, "window_auto"), LEFT)
    assert session.slice_level is not None
    assert session.view.window == intensity_window(session.slice_level)


def test_dragging_in_the_histogram_moves_the_window(
    qtbot: QtBot, session: Session, panel: DisplayPanel
) -> None:
    bars = find(panel, HistogramView, "histogram")
    bars.window_requested.emit(33.3, 99.9)
    assert session.view.window == (33.0, 100.0)
    bars.threshold_requested.emit(71.2)
    assert session.view.opacity_threshold == 71.0


def test_colors_and_rendering_are_chosen(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    colormap = find(panel, QComboBox, "colormap")
    assert [colormap.itemText(index) for index in range(colormap.count())] == list(COLORMAPS)
    colormap.setFocus()
    qtbot.keyClick(colormap, Qt.Key.Key_End)
    assert session.view.colormap == list(COLORMAPS)[-1]
    rendering = find(panel, QComboBox, "rendering")
    rendering.setFocus()
    qtbot.keyClick(rendering, Qt.Key.Key_Down)
    assert session.view.rendering == "mip"
    session.look(rendering="volume", colormap="gray")
    assert rendering.currentText() == "Volume"
    assert colormap.currentText() == "gray"


@pytest.mark.parametrize("layer", get_args(Layer))
def test_layers_are_shown_and_hidden(
    qtbot: QtBot, session: Session, panel: DisplayPanel, layer: Layer
) -> None:
    box = find(panel, QCheckBox, f"layer_{layer}")
    at_first = layer in FIRST_LAYERS
    assert box.isChecked() == at_first
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Space)
    assert (layer in session.view.layers) != at_first
    session.toggle_layer(layer)
    assert box.isChecked() == at_first


def test_detail_is_asked_for(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    box = find(panel, QCheckBox, "detail")
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Space)
    assert session.view.detail
    qtbot.waitUntil(lambda: not session.jobs.running)
    session.look(detail=False)
    assert not box.isChecked()


def test_nothing_here_is_an_edit(qtbot: QtBot, session: Session, panel: DisplayPanel) -> None:
    before = session.document
    qtbot.mouseClick(find(panel, QPushButton, "window_auto"), LEFT)
    type_number(qtbot, find(panel, QDoubleSpinBox, "window_low_box"), "3")
    assert session.document is before
    assert session.undo_stack.count == 0


def test_without_a_volume_nothing_can_be_chosen(session: Session, panel: DisplayPanel) -> None:
    assert find(panel, QPushButton, "window_auto").isEnabled()
    session.close_volume()
    assert not find(panel, QPushButton, "window_auto").isEnabled()
    assert not find(panel, QComboBox, "rendering").isEnabled()
