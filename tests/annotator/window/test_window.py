import subprocess
import sys
import threading

import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QAbstractButton, QDockWidget, QLabel, QLineEdit, QToolButton, QWidget

from annotator.actions.table import ACTIONS
from annotator.settings import Settings
from annotator.window import scene_import
from annotator.window.main_window import MainWindow


def test_scene_comes_after_the_window(qtbot, window):
    assert not window.scene.isVisible()
    assert window.findChild(QLabel, "scene_waiting").isVisible()
    window.prepare_scene()
    qtbot.waitUntil(window.scene.isVisible, timeout=30_000)
    assert window.scene.picture().width() > 100


def test_title_names_the_volume_and_marks_what_is_unsaved(window, session):
    assert window.windowTitle() == "v001.npy[*] – volumes – OCT Annotator"
    assert not window.isWindowModified()
    session.place((100.0, 100.0, 100.0))
    assert window.isWindowModified()
    session.save()
    assert not window.isWindowModified()
    session.close_volume()
    assert window.windowTitle() == "OCT Annotator"


def test_menu_names_what_is_undone(window, session):
    assert window.actions_by_name["undo"].text() == "Undo"
    assert not window.actions_by_name["undo"].isEnabled()
    session.place((100.0, 100.0, 100.0))
    assert window.actions_by_name["undo"].text() == "Undo: Place k0"
    session.undo_stack.undo()
    assert window.actions_by_name["redo"].text() == "Redo: Place k0"
    assert not window.actions_by_name["undo"].isEnabled()


def test_actions_follow_the_session(window, session):
    actions = window.actions_by_name
    assert actions["place_mode"].isEnabled()
    assert not actions["clear"].isEnabled()
    assert actions["keypoint_1"].isChecked()
    assert actions["keypoint_1"].text().startswith("k0")
    assert not actions["keypoint_7"].isVisible()
    session.place((100.0, 100.0, 100.0))
    assert actions["keypoint_2"].isChecked()
    session.activate("k0")
    assert actions["state_placed"].isChecked()
    assert actions["clear"].isEnabled()
    session.set_certainty("k0", "unsure")
    assert actions["unsure"].isChecked()
    session.close_volume()
    for entry in ACTIONS:
        if actions[entry.name].isVisible():
            enabled = entry.when in ("always", "previous", "next", "todo", "report", "shipped")
            assert actions[entry.name].isEnabled() == enabled, entry.name


def test_action_that_changes_nothing_keeps_its_mark(window, session):
    session.set_mode("place")
    window.actions_by_name["place_mode"].trigger()
    assert window.actions_by_name["place_mode"].isChecked()
    assert not window.actions_by_name["navigate_mode"].isChecked()


def test_every_control_has_a_name(window):
    unnamed = [
        f"{type(widget).__name__} in {widget.parent()}"
        for kind in (QAbstractButton, QDockWidget)
        for widget in window.findChildren(kind)
        # Qt's own button in a line edit has no name.
        if not widget.objectName() and not isinstance(widget.parent(), QLineEdit)
    ]
    assert not unnamed
    speechless = [
        button.objectName()
        for button in window.findChildren(QToolButton)
        if button.isVisible() and button.objectName() and not (button.accessibleName() or button.text())
    ]
    assert not speechless


def test_layout_theme_and_panes_come_back(qtbot, make_window, session, settings):
    first = make_window(session)
    first.resize(1111, 777)
    first.findChild(QDockWidget, "dock_worklist").hide()
    rows = first.findChild(QWidget, "pane_rows")
    rows.setSizes([300, 100])
    proportions = rows.sizes()[0] / sum(rows.sizes())
    first.close()

    again = make_window(session, Settings(settings.path))
    assert again.findChild(QDockWidget, "dock_worklist").isHidden()
    sizes = again.findChild(QWidget, "pane_rows").sizes()
    assert abs(sizes[0] / sum(sizes) - proportions) < 0.1


def test_layout_can_be_reset(window):
    dock = window.findChild(QDockWidget, "dock_worklist")
    dock.hide()
    window.actions_by_name["reset_layout"].trigger()
    assert not dock.isHidden()


@pytest.mark.qt_log_ignore("This plugin does not support raise")
def test_panels_are_shown_and_hidden(window):
    dock = window.findChild(QDockWidget, "dock_pose")
    action = window.actions_by_name["panel_pose"]
    assert action.isChecked()
    action.trigger()
    assert dock.isHidden()
    assert not action.isChecked()
    action.trigger()
    assert not dock.isHidden()
    assert action.isChecked()


def test_dropped_file_is_opened(qtbot, make_window, empty_session, volume_path, settings):
    window = make_window(empty_session)
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(volume_path))])
    event = QDropEvent(
        QPointF(10, 10),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.dropEvent(event)
    qtbot.waitUntil(lambda: empty_session.volume is not None)
    assert empty_session.volume.path == volume_path
    assert settings.recent_paths == (volume_path,)
    assert window.actions_by_name["recent_1"].text().startswith("v001.npy")


def test_dropped_text_is_left_alone(window):
    data = QMimeData()
    data.setText("v001.npy")
    event = QDropEvent(
        QPointF(10, 10),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    event.setAccepted(False)
    window.dropEvent(event)
    assert not event.isAccepted()


def test_panes_get_most_of_a_small_window(qtbot, session, settings, tmp_path):
    window = MainWindow(session, settings, tmp_path / "annotator.log")
    qtbot.addWidget(window, before_close_func=lambda window: window.session.abandon())
    window.resize(1024, 700)
    window.show()
    qtbot.waitUntil(lambda: window.four_up.width() > 0.6 * window.width())
    worklist = window.findChild(QDockWidget, "dock_worklist")
    assert window.findChild(QDockWidget, "dock_pose") in window.tabifiedDockWidgets(worklist)


def test_frame_of_the_first_window_fits_on_the_screen(qtbot, empty_session, settings, tmp_path):
    window = MainWindow(empty_session, settings, tmp_path / "annotator.log")
    qtbot.addWidget(window)
    available = window.screen().availableSize()
    # A title bar of the usual systems is 24 to 48 pixels high.
    assert window.height() <= available.height() - 48
    assert window.width() < available.width()


def test_a_volume_opens_while_what_levels_the_fit_and_the_scene_need_is_loaded(
    qtbot, make_window, empty_session, volume_path, monkeypatch
):
    begun, go_on, levels_first = threading.Event(), threading.Event(), threading.Event()

    def load():
        assert levels_first.is_set()
        begun.set()
        assert go_on.wait(10)

    monkeypatch.setattr(scene_import, "prepare_cache", levels_first.set)
    monkeypatch.setattr(scene_import, "prepare_fitting", load)
    window = make_window(empty_session)
    window.prepare_scene()
    qtbot.waitUntil(begun.is_set)
    window.open_path(volume_path)
    qtbot.waitUntil(lambda: empty_session.volume is not None)
    with qtbot.waitSignal(window.scene_prepared, timeout=30_000):
        go_on.set()


def test_what_only_fits_snaps_demos_and_predictions_need_is_not_imported_with_the_window():
    late = (
        "scipy",
        "matplotlib",
        "onnx",
        "openvino",
        "annotations.synthesis",
        "annotations.fitting.refine",
        "annotations.prediction.prediction",
        "annotations.prediction.checkpoint",
        "mayavi",
        "vtkmodules",
    )
    code = (
        "import sys; import annotator.window.main_window; from annotator.looks.colormaps import COLORMAPS; "
        f"COLORMAPS['gray']; print([n for n in {late!r} if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
