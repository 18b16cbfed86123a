"""The panels share windows of every size: nothing is wider than its screen, and the pose keeps its room."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QDockWidget, QWidget
from pytestqt.qtbot import QtBot

from annotations.documents.record import Method
from annotations.geometry.boxes import Box
from annotator.session import Session
from annotator.settings import Settings
from annotator.window.main_window import MainWindow

BOX = Box((300.0, 400.0, 200.0), (11000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))


@pytest.fixture
def open_window(
    qtbot: QtBot, session: Session, settings: Settings, tmp_path: Path
) -> Callable[[int, int], MainWindow]:
    def open_window(width: int, height: int) -> MainWindow:
        window = MainWindow(session, settings, tmp_path / "annotator.log")
        qtbot.addWidget(window, before_close_func=lambda window: window.session.abandon())
        window.resize(width, height)
        window.show()
        QApplication.processEvents()
        return window

    return open_window


@pytest.fixture
def large_font(qapp: QApplication) -> object:
    """Text of one and a half times the size."""
    font = qapp.font()
    larger = qapp.font()
    larger.setPointSizeF(1.5 * font.pointSizeF())
    qapp.setFont(larger)
    yield
    qapp.setFont(font)


def height(window: MainWindow, name: str) -> int:
    return dock(window, name).height()


def dock(window: MainWindow, name: str) -> QDockWidget:
    found = window.findChild(QDockWidget, f"dock_{name}")
    assert isinstance(found, QDockWidget)
    return found


def change_to(qtbot: QtBot, window: MainWindow, method: Method) -> None:
    with qtbot.waitSignal(window.session.volume_changed):
        window.session.set_method(method)
    qtbot.waitUntil(lambda: not window.session.jobs.running)
    # The room is shared once the panel is laid out.
    qtbot.wait(50)


def share_of_pose(window: MainWindow) -> float:
    return height(window, "pose") / (height(window, "pose") + height(window, "keypoints"))


@pytest.mark.parametrize("size", [(1024, 700), (1280, 800), (1600, 1000)])
def test_boxes_leave_the_pose_room(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow], size: tuple[int, int]
) -> None:
    window = open_window(*size)
    change_to(qtbot, window, "boxes")
    window.session.type_box("link0", BOX)
    assert share_of_pose(window) > 0.4


def test_keypoints_take_back_no_more_room_than_they_had(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1600, 1000)
    before = height(window, "keypoints")
    change_to(qtbot, window, "boxes")
    of_boxes = height(window, "keypoints")
    assert of_boxes > before + 50
    for _ in range(3):
        change_to(qtbot, window, "keypoints")
        assert height(window, "keypoints") == pytest.approx(before, abs=3)
        change_to(qtbot, window, "boxes")
        assert height(window, "keypoints") == pytest.approx(of_boxes, abs=3)


def test_each_method_has_the_height_that_a_person_gave_it(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1600, 1000)
    docks = [dock(window, "keypoints"), dock(window, "pose")]
    window.resizeDocks(docks, [600, 250], Qt.Orientation.Vertical)
    QApplication.processEvents()
    chosen = height(window, "keypoints")
    change_to(qtbot, window, "boxes")
    assert height(window, "keypoints") < chosen - 50
    change_to(qtbot, window, "keypoints")
    assert height(window, "keypoints") == pytest.approx(chosen, abs=3)


def test_a_low_window_has_the_pose_behind_the_keypoints_until_it_is_wanted(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(680, 420)
    assert dock(window, "pose") in window.tabifiedDockWidgets(dock(window, "keypoints"))
    assert not dock(window, "keypoints").visibleRegion().isEmpty()
    assert window.height() == 420
    assert window.width() <= 700
    window.session.set_mode("pose")
    qtbot.waitUntil(lambda: not dock(window, "pose").visibleRegion().isEmpty())


@pytest.mark.usefixtures("large_font")
def test_large_text_makes_no_window_wider_than_a_small_screen(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1024, 700)
    window.session.set_mode("place")
    window.session.place((300.0, 400.0, 200.0))
    window.status.show_cursor((300.0, 400.0, 200.0), "117")
    change_to(qtbot, window, "boxes")
    assert (window.width(), window.height()) == (1024, 700)
    panel = window.findChild(QWidget, "annotation_panel")
    assert isinstance(panel, QWidget)
    assert panel.mapTo(window, panel.rect().bottomRight()).x() < window.width()


def test_a_window_that_becomes_narrow_leaves_the_panes_more_than_half_of_it(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1600, 1000)
    beside = dock(window, "worklist")
    assert window.dockWidgetArea(beside) == Qt.DockWidgetArea.LeftDockWidgetArea
    window.resize(1024, 700)
    qtbot.waitUntil(lambda: window.four_up.width() > 1024 / 2)
    assert not dock(window, "pose").visibleRegion().isEmpty()
    window.resize(1600, 1000)
    qtbot.waitUntil(lambda: window.dockWidgetArea(beside) == Qt.DockWidgetArea.LeftDockWidgetArea)


def test_a_layout_of_a_wide_window_leaves_the_panes_of_a_narrow_one_their_room(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow], settings: Settings
) -> None:
    settings.window_state = open_window(1600, 1000).saveState()
    window = open_window(1024, 700)
    qtbot.waitUntil(lambda: window.four_up.width() > 1024 / 2)


def show_predictions(qtbot: QtBot, window: MainWindow) -> QDockWidget:
    window.actions_by_name["panel_predictions"].trigger()
    qtbot.waitUntil(lambda: not dock(window, "predictions").visibleRegion().isEmpty())
    # The room is shared once the panel is laid out.
    qtbot.wait(50)
    return dock(window, "predictions")


def test_predictions_stand_below_the_panes_of_a_large_window_at_a_height_for_tables(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1600, 1000)
    before = height(window, "keypoints")
    predictions = show_predictions(qtbot, window)
    assert window.dockWidgetArea(predictions) == Qt.DockWidgetArea.BottomDockWidgetArea
    assert predictions.width() == window.width()
    qtbot.waitUntil(lambda: predictions.height() > 0.3 * window.height())
    qtbot.waitUntil(lambda: height(window, "keypoints") == pytest.approx(before, abs=3))
    window.resizeDocks([predictions], [280], Qt.Orientation.Vertical)
    for name in ("panel_predictions", "panel_predictions"):
        window.actions_by_name[name].trigger()
        qtbot.wait(50)
    assert predictions.height() == pytest.approx(280, abs=3)


def test_predictions_have_a_low_column_to_themselves_as_long_as_they_are_seen(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1024, 700)
    predictions, keypoints = show_predictions(qtbot, window), dock(window, "keypoints")
    qtbot.waitUntil(keypoints.isHidden)
    assert window.dockWidgetArea(predictions) == Qt.DockWidgetArea.RightDockWidgetArea
    dock(window, "pose").raise_()
    qtbot.waitUntil(lambda: not keypoints.isHidden())
    predictions.raise_()
    qtbot.waitUntil(keypoints.isHidden)
    window.close()
    assert not keypoints.isHidden()


def test_keypoints_that_a_person_hides_while_reviewing_stay_hidden(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1024, 700)
    show_predictions(qtbot, window)
    keypoints = dock(window, "keypoints")
    qtbot.waitUntil(keypoints.isHidden)
    keypoints.show()
    qtbot.waitUntil(lambda: not keypoints.visibleRegion().isEmpty())
    keypoints.hide()

    dock(window, "pose").raise_()
    qtbot.waitUntil(lambda: not dock(window, "pose").visibleRegion().isEmpty())
    qtbot.wait(50)
    assert keypoints.isHidden()


def test_predictions_go_behind_the_pose_in_a_window_that_becomes_narrow(
    qtbot: QtBot, open_window: Callable[[int, int], MainWindow]
) -> None:
    window = open_window(1600, 1000)
    predictions = show_predictions(qtbot, window)
    window.resize(1024, 700)
    qtbot.waitUntil(lambda: predictions in window.tabifiedDockWidgets(dock(window, "pose")))
    assert not predictions.isHidden()
    window.resize(1600, 1000)
    below = Qt.DockWidgetArea.BottomDockWidgetArea
    qtbot.waitUntil(lambda: window.dockWidgetArea(predictions) == below)
    assert not predictions.isHidden()
    assert not dock(window, "keypoints").isHidden()
