"""What a person chooses: name, looks, tool, what to open; and that it is remembered."""

import shutil
import threading

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QFileDialog,
    QInputDialog,
    QLabel,
    QLineEdit,
    QTreeWidget,
    QWidget,
)

from annotations.volumes.opening import SUFFIXES
from annotator.dialogs.about_dialog import AboutDialog
from annotator.dialogs.settings_dialog import SettingsDialog
from annotator.dialogs.shortcut_sheet import ShortcutSheet
from annotator.looks import theme
from annotator.session.volumes import opening
from annotator.settings import Settings

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
A_UM = (200.0, 300.0, 250.0)


@pytest.fixture(autouse=True)
def _looks_put_back(qapp):
    before = qapp.palette()
    yield
    qapp.setPalette(before)


@pytest.fixture
def empty_window(make_window, empty_session):
    return make_window(empty_session)


def test_theme_is_chosen_and_remembered(window, settings):
    actions = window.actions_by_name
    actions["theme_dark"].trigger()
    assert theme.is_dark(QApplication.palette())
    assert actions["theme_dark"].isChecked()
    assert not actions["theme_light"].isChecked()
    actions["theme_light"].trigger()
    assert not theme.is_dark(QApplication.palette())
    assert Settings(settings.path).theme == "light"


def test_settings_are_changed_in_a_dialog(qtbot, person, session, settings):
    person.press(Qt.Key.Key_Comma, CONTROL)
    dialog = person.dialog(SettingsDialog)
    name = dialog.findChild(QLineEdit, "settings_annotator_name")
    name.setText("berta")
    dialog.findChild(QComboBox, "settings_renderer").setCurrentIndex(1)
    person.click(dialog, "settings_ok")
    assert settings.annotator_name == "berta"
    assert settings.renderer == "software"
    qtbot.waitUntil(lambda: session.volume is not None and session.document.annotator == "berta")


def test_sheet_lists_every_action(person):
    person.press(Qt.Key.Key_Question)
    sheet = person.dialog(ShortcutSheet)
    tree = sheet.findChild(QTreeWidget, "shortcut_tree")
    texts = {
        tree.topLevelItem(group).child(row).text(0)
        for group in range(tree.topLevelItemCount())
        for row in range(tree.topLevelItem(group).childCount())
    }
    assert {"Save", "Place Keypoints or Boxes", "Snap to Edge"} <= texts
    person.click(sheet, "shortcut_close")


def test_about_names_the_versions(person):
    person.action("about").trigger()
    person.click(person.dialog(AboutDialog), "about_close")


def test_pose_is_copied(person, session):
    session.place(A_UM, keypoint="k0")
    session.place((400.0, 300.0, 250.0), keypoint="k1")
    person.press(Qt.Key.Key_C, CONTROL | SHIFT)
    table = QGuiApplication.clipboard().text()
    assert "\t" in table
    assert "300" in table


def test_tool_is_chosen(qtbot, person, session, settings):
    assert session.tool.name == "magnetic-forceps"
    person.press(Qt.Key.Key_T)
    dialog = person.dialog(QInputDialog)
    choice = next(text for text in dialog.comboBoxItems() if text.startswith("needle"))
    dialog.setTextValue(choice)
    dialog.accept()
    qtbot.waitUntil(lambda: session.tool is not None and session.tool.name == "needle")
    assert settings.tool_name == "needle"
    assert person.action("keypoint_1").text().startswith("tip")
    assert not person.action("keypoint_3").isVisible()


def test_file_is_opened_by_key_and_is_recent(
    qtbot, monkeypatch, empty_window, person_at, volume_path, settings
):
    person = person_at(empty_window)
    assert empty_window.findChild(QWidget, "start_page").isVisible()
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(volume_path), ""))
    person.press(Qt.Key.Key_O, CONTROL)
    session = empty_window.session
    qtbot.waitUntil(lambda: session.volume is not None and not session.jobs.running)
    qtbot.waitUntil(lambda: not empty_window.findChild(QWidget, "start_page").isVisible())
    assert settings.recent_paths == (volume_path,)

    person.press(Qt.Key.Key_W, CONTROL)
    assert session.volume is None
    qtbot.waitUntil(empty_window.findChild(QWidget, "start_page").isVisible)
    person.click(empty_window, "start_recent_1")
    qtbot.waitUntil(lambda: session.volume is not None)


def test_folder_is_opened_by_key(qtbot, monkeypatch, empty_window, person_at, volume_path):
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(volume_path.parent))
    person_at(empty_window).press(Qt.Key.Key_O, CONTROL | SHIFT)
    qtbot.waitUntil(lambda: empty_window.session.volume is not None)
    assert empty_window.session.title == "volumes"


def test_nothing_chosen_opens_nothing(monkeypatch, empty_window):
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: ("", ""))
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: "")
    empty_window.actions_by_name["open_file"].trigger()
    empty_window.actions_by_name["open_folder"].trigger()
    assert not empty_window.session.jobs.running


def test_recent_file_that_is_gone_is_said_and_forgotten(qtbot, empty_window, person_at, settings, tmp_path):
    settings.remember_path(tmp_path / "gone.npy")
    settings.remember_path(tmp_path)
    empty_window.actions_by_name["recent_2"].trigger()
    person = person_at(empty_window)
    qtbot.waitUntil(person.has_dialog)
    assert settings.recent_paths == (tmp_path,)
    QApplication.activeModalWidget().close()


def test_saving_as_goes_on_with_the_new_file(monkeypatch, person, session, tmp_path):
    session.place(A_UM)
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "mine"), ""))
    person.press(Qt.Key.Key_S, CONTROL | SHIFT)
    assert session.annotation_path == tmp_path / "mine.json"
    assert not session.unsaved
    assert (tmp_path / "mine.json").exists()


class TestDisplay:
    """Window, colour map and rendering go from volume to volume and from start to start."""

    @pytest.fixture
    def second_path(self, volume_path):
        for name in ("v001.npy", "v001.npy.volume.toml"):
            shutil.copy(volume_path.with_name(name), volume_path.with_name(name.replace("v001", "v002")))
        return volume_path.with_name("v002.npy")

    def go_to(self, qtbot, window, path):
        session = window.session
        window.open_path(path)
        qtbot.waitUntil(
            lambda: session.volume is not None and session.volume.path == path and not session.jobs.running
        )

    def test_chosen_window_comes_back(self, qtbot, window, session, second_path, settings):
        qtbot.waitUntil(lambda: not session.jobs.running)
        session.look(window=(20.0, 150.0), colormap="viridis", rendering="mip", review_colors="blue_orange")
        window.close()
        assert settings.display_window("uint8") == (20.0, 150.0)
        assert settings.colormap == "viridis"
        assert settings.rendering == "mip"
        assert settings.review_colors == "blue_orange"

    def test_next_volume_is_looked_at_alike(self, qtbot, window, session, second_path, settings):
        settings.remember_display_window("uint8", (20.0, 150.0))
        settings.colormap = "viridis"
        settings.review_colors = "blue_orange"
        self.go_to(qtbot, window, second_path)
        qtbot.waitUntil(lambda: session.view.window == (20.0, 150.0))
        assert session.view.colormap == "viridis"
        assert session.view.review_colors == "blue_orange"

    def test_window_that_would_show_nothing_does_not_come_back(
        self, qtbot, window, session, second_path, settings
    ):
        automatic = session.view.window
        settings.remember_display_window("uint8", (5000.0, 9000.0))
        settings.colormap = "no such map"
        settings.rendering = "mip"
        self.go_to(qtbot, window, second_path)
        qtbot.waitUntil(lambda: session.view.rendering == "mip")
        assert session.view.window == pytest.approx(automatic, abs=10)
        assert session.view.colormap == "gray"

    def test_automatic_window_is_forgotten(self, qtbot, window, session, settings):
        settings.remember_display_window("uint8", (20.0, 150.0))
        session.look(window=(30.0, 40.0))
        window.actions_by_name["auto_window"].trigger()
        window.close()
        assert settings.display_window("uint8") is None


def test_file_that_could_not_be_opened_is_not_recent(
    qtbot, empty_window, person_at, settings, volume_path, tmp_path
):
    broken = tmp_path / "broken.npy"
    broken.write_bytes(b"nothing")
    empty_window.open_path(broken)
    person = person_at(empty_window)
    qtbot.waitUntil(person.has_dialog)
    QApplication.activeModalWidget().close()
    empty_window.session.open_path(volume_path)
    qtbot.waitUntil(lambda: empty_window.session.volume is not None)
    assert settings.recent_paths == ()


def test_dialog_offers_every_volume_that_can_be_opened(monkeypatch, empty_window):
    asked = []
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *given: asked.append(given[-1]) or ("", ""))
    empty_window.actions_by_name["open_file"].trigger()
    volumes = asked[0].split(";;")[1]
    assert volumes == f"Volumes ({' '.join(f'*{suffix}' for suffix in SUFFIXES)})"


def test_start_page_says_what_is_being_opened(qtbot, monkeypatch, empty_window, volume_path):
    find, is_seen = opening.find, threading.Event()

    def find_once_it_is_seen(request):
        assert is_seen.wait(10)
        return find(request)

    monkeypatch.setattr(opening, "find", find_once_it_is_seen)
    title = empty_window.findChild(QLabel, "start_title")
    assert title.text() == "Open a volume to annotate"
    empty_window.open_path(volume_path)
    qtbot.waitUntil(lambda: title.text().startswith(f"Opening {volume_path.name}"))
    is_seen.set()
    qtbot.waitUntil(lambda: empty_window.session.volume is not None)


def test_detail_is_named_and_brought_into_view(qtbot, window, session):
    session.place((318.0, 405.0, 235.0))
    session.activate("k0")
    window.prepare_scene()
    qtbot.waitUntil(window.scene.isVisible, timeout=30_000)
    window.scene.picture()
    whole = window.scene.camera
    window.actions_by_name["detail"].trigger()
    assert window.status.currentMessage() == "The scene shows 2 mm around k0 at full resolution"
    assert window.scene.camera.height_um < whole.height_um
    window.actions_by_name["detail"].trigger()
    assert window.scene.camera.height_um == pytest.approx(whole.height_um, rel=0.05)
