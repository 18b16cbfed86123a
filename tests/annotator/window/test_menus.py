"""Actions that a person reaches through the menus rather than by working on keypoints."""

import shutil
import threading
from itertools import product

import numpy as np
import pytest
from PySide6.QtCore import SIGNAL, QByteArray
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QMenu, QSplitter, QToolButton

from annotations import demo
from annotations.geometry.boxes import Box
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotator.actions.table import ACTIONS
from annotator.slices.viewport import fitting_scale
from annotator.window.four_up import FourUp


def test_every_action_is_in_exactly_one_menu(window):
    found = [
        action.objectName()
        for menu in window.menuBar().findChildren(QMenu)
        for action in menu.actions()
        if action.objectName().startswith("action_")
    ]
    assert sorted(found) == sorted(f"action_{entry.name}" for entry in ACTIONS)


def test_a_button_is_connected_to_its_action_once_however_often_that_changes(qtbot, window, session):
    for position_um in ((1.0, 2.0, 3.0), (2.0, 3.0, 4.0), (3.0, 4.0, 5.0)):
        session.place(position_um, "clicked", "k0")
        session.place(position_um, "clicked", "k1")
    undo = window.actions_by_name["undo"]
    assert undo.text() == "Undo: Move k1"
    assert undo.receivers(SIGNAL("changed()")) == 1
    button = window.findChild(QToolButton, "button_undo")
    with qtbot.waitSignal(button.triggered):
        button.click()
    assert undo.text() == "Undo: Move k0"


def test_demo_study_is_made_and_opened(
    qtbot, make_window, empty_session, volume_path, user_home, monkeypatch
):
    made = []

    def make(folder, progress, cancelled):
        made.append(folder)
        progress(0.5)
        assert not cancelled()
        return shutil.copytree(volume_path.parent, folder)

    monkeypatch.setattr(demo, "make_demo_study", make)
    window = make_window(empty_session)
    window.actions_by_name["open_demo"].trigger()
    qtbot.waitUntil(lambda: empty_session.volume is not None)
    assert made[0].is_relative_to(user_home)
    assert empty_session.volume.path == made[0] / "v001.npy"


def test_background_work_is_cancelled(qtbot, window, session):
    begun, stopped = threading.Event(), threading.Event()

    def work(_progress, cancelled):
        begun.set()
        while not cancelled():
            stopped.wait(0.01)
        stopped.set()

    assert not window.actions_by_name["cancel_jobs"].isEnabled()
    session.jobs.start("Waiting", work, done=lambda _: None, failed=lambda _: None)
    qtbot.waitUntil(window.actions_by_name["cancel_jobs"].isEnabled)
    assert begun.wait(10)
    window.actions_by_name["cancel_jobs"].trigger()
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert stopped.wait(10)
    qtbot.waitUntil(lambda: not window.actions_by_name["cancel_jobs"].isEnabled())


def test_work_that_nobody_sees_is_not_cancelled(qtbot, window, session):
    go_on, done = threading.Event(), []
    shown = session.jobs.start("Seen", lambda *_: go_on.wait(10), done=done.append, failed=done.append)
    hidden = session.jobs.start(
        "A lock, say", lambda *_: go_on.wait(10), done=done.append, failed=done.append, shown=False
    )
    qtbot.waitUntil(window.actions_by_name["cancel_jobs"].isEnabled)
    window.actions_by_name["cancel_jobs"].trigger()
    go_on.set()
    qtbot.waitUntil(lambda: not {shown, hidden} & set(session.jobs.running))
    assert (shown.state, hidden.state) == ("cancelled", "done")
    assert done == [True]


def test_log_is_opened_once_there_is_one(window, monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", lambda url: opened.append(url.toLocalFile()))
    window.actions_by_name["open_log"].trigger()
    assert "no log yet" in window.status.currentMessage()
    (tmp_path / "annotator.log").write_text("something")
    window.actions_by_name["open_log"].trigger()
    assert opened == [str(tmp_path / "annotator.log")]


def test_nothing_to_recover_asks_nothing(qtbot, person, session):
    person.action("recover").trigger()
    assert "you will be asked" in person.window.status.currentMessage()
    qtbot.waitUntil(lambda: not session.jobs.running)
    assert not person.has_dialog()


def test_full_screen_and_back(qtbot, window):
    window.actions_by_name["full_screen"].trigger()
    qtbot.waitUntil(window.isFullScreen)
    assert window.actions_by_name["full_screen"].isChecked()
    window.actions_by_name["full_screen"].trigger()
    qtbot.waitUntil(lambda: not window.isFullScreen())


@pytest.fixture
def rows(window):
    return [window.findChild(QSplitter, f"pane_row_{number}") for number in range(2)]


def test_panes_are_divided_by_one_cross(window, rows):
    upper, lower = rows
    upper.moveSplitter(upper.width() // 3, 1)
    assert lower.sizes() == upper.sizes()


def test_unreadable_division_of_panes_is_left_as_it_is(window, rows):
    before = rows[0].sizes()
    window.four_up.restore(QByteArray(b"nonsense"))
    assert rows[0].sizes() == before


def test_division_of_panes_survives_packing(window, rows):
    four_up: FourUp = window.four_up
    rows[0].setSizes([100, 300])
    state, sizes = four_up.state(), rows[0].sizes()
    four_up.reset()
    assert rows[0].sizes() != sizes
    four_up.restore(state)
    assert rows[0].sizes() == sizes


def test_camera_looks_along_an_axis_and_in_perspective(qtbot, window):
    window.prepare_scene()
    qtbot.waitUntil(lambda: window.scene.camera is not None, timeout=30_000)
    window.actions_by_name["camera_+x"].trigger()
    assert window.scene.camera.forward == (1.0, 0.0, 0.0)
    assert window.scene.camera.parallel
    window.actions_by_name["perspective"].trigger()
    assert not window.scene.camera.parallel
    assert window.actions_by_name["perspective"].isChecked()


def test_zoom_to_the_active_part(qtbot, window, session):
    window.prepare_scene()
    qtbot.waitUntil(lambda: window.scene.camera is not None, timeout=30_000)
    session.place((200.0, 300.0, 250.0))
    session.activate("k0")
    session.look(crosshair_um=(0.0, 0.0, 0.0))
    before = window.slices[0].viewport.scale, window.scene.camera.height_um
    window.actions_by_name["zoom_keypoint"].trigger()
    assert session.view.crosshair_um == (200.0, 300.0, 250.0)
    assert window.scene.camera.focal_um == (200.0, 300.0, 250.0)
    assert window.scene.camera.height_um < before[1]
    assert window.slices[0].viewport.scale >= before[0]


def test_zoom_to_the_active_box(qtbot, window, session):
    with qtbot.waitSignal(session.volume_changed):
        session.set_method("boxes")
    window.prepare_scene()
    qtbot.waitUntil(lambda: window.scene.camera is not None, timeout=30_000)
    box = Box((400.0, 500.0, 250.0), (300.0, 120.0, 80.0), from_yaw_pitch_roll(30.0, 20.0, 10.0))
    session.free_cross_section("link0", True)
    session.type_box("link0", box)
    session.activate("link0")
    session.look(crosshair_um=(0.0, 0.0, 0.0))
    before_um = window.scene.camera.height_um
    window.actions_by_name["zoom_keypoint"].trigger()
    assert session.view.crosshair_um == pytest.approx(box.center_um)
    assert window.scene.camera.focal_um == pytest.approx(box.center_um)
    # The whole box, and not much more.
    assert 80.0 < window.scene.camera.height_um < before_um
    corners_um = [box.position_um(share) for share in product((-0.5, 0.5), repeat=3)]
    for view in window.slices:
        assert all(view.viewport.shows(corner_um) for corner_um in corners_um)
    assert any(
        view.viewport.scale > fitting_scale(view.viewport.plane, view.viewport.area) for view in window.slices
    )


def test_a_large_box_is_seen_whole_in_the_scene(qtbot, window, session):
    with qtbot.waitSignal(session.volume_changed):
        session.set_method("boxes")
    window.prepare_scene()
    qtbot.waitUntil(lambda: window.scene.camera is not None, timeout=30_000)
    session.type_box("link0", Box((200.0, 300.0, 250.0), (9700.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    session.activate("link0")
    window.scene.look_from("-z")
    window.actions_by_name["zoom_keypoint"].trigger()
    camera = window.scene.camera
    along_um = abs(np.dot(camera.right, (9700.0, 0.0, 0.0))), abs(np.dot(camera.up, (9700.0, 0.0, 0.0)))
    aspect = window.scene.width() / window.scene.height()
    assert camera.height_um * aspect >= along_um[0]
    assert camera.height_um >= along_um[1]
