"""Settings are kept on OK alone; the theme shows at once."""

from collections.abc import Iterator
from typing import TypeVar

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotator.dialogs.settings_dialog import SettingsDialog
from annotator.looks import theme
from annotator.settings import Settings

LEFT = Qt.MouseButton.LeftButton
W = TypeVar("W", bound=QWidget)


@pytest.fixture(autouse=True)
def light_afterwards(qapp: QApplication) -> Iterator[None]:
    yield
    theme.apply_theme("light")


@pytest.fixture
def dialog(qtbot: QtBot, settings: Settings) -> SettingsDialog:
    settings.annotator_name = "anna"
    settings.theme = "light"
    dialog = SettingsDialog(settings)
    qtbot.addWidget(dialog)
    with qtbot.waitActive(dialog):
        dialog.show()
        dialog.activateWindow()
    return dialog


def find(dialog: SettingsDialog, kind: type[W], name: str) -> W:
    found = dialog.findChild(kind, f"settings_{name}")
    assert isinstance(found, kind)
    return found


def retype(qtbot: QtBot, target: QWidget, text: str) -> None:
    target.setFocus()
    qtbot.keyClick(target, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClicks(target, text)


def choose(qtbot: QtBot, box: QComboBox, value: str) -> None:
    box.setFocus()
    qtbot.keyClick(box, Qt.Key.Key_Home)
    for _ in range(box.findData(value)):
        qtbot.keyClick(box, Qt.Key.Key_Down)


def test_everything_is_kept_on_ok(qtbot: QtBot, dialog: SettingsDialog, settings: Settings) -> None:
    retype(qtbot, find(dialog, QLineEdit, "annotator_name"), "bert")
    choose(qtbot, find(dialog, QComboBox, "theme"), "dark")
    choose(qtbot, find(dialog, QComboBox, "renderer"), "software")
    retype(qtbot, find(dialog, QDoubleSpinBox, "autosave_seconds"), "30")
    retype(qtbot, find(dialog, QSpinBox, "cache_limit_mib"), "512")
    assert settings.annotator_name == "anna"
    qtbot.mouseClick(find(dialog, QPushButton, "ok"), LEFT)
    assert dialog.result() == QDialog.DialogCode.Accepted
    assert settings.annotator_name == "bert"
    assert settings.theme == "dark"
    assert settings.renderer == "software"
    assert settings.autosave_seconds == 30
    assert settings.cache_limit_mib == 512


def test_the_theme_shows_at_once_and_is_taken_back(
    qtbot: QtBot, dialog: SettingsDialog, settings: Settings, qapp: QApplication
) -> None:
    choose(qtbot, find(dialog, QComboBox, "theme"), "dark")
    assert theme.is_dark(qapp.palette())
    qtbot.mouseClick(find(dialog, QPushButton, "cancel"), LEFT)
    assert not theme.is_dark(qapp.palette())
    assert settings.theme == "light"


@pytest.mark.parametrize("nothing", [" ", "   "])
def test_an_annotator_needs_a_name(
    qtbot: QtBot, dialog: SettingsDialog, settings: Settings, nothing: str
) -> None:
    retype(qtbot, find(dialog, QLineEdit, "annotator_name"), nothing)
    assert "type yours" in find(dialog, QLabel, "problem").text()
    assert not find(dialog, QPushButton, "ok").isEnabled()
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.isVisible()
    retype(qtbot, find(dialog, QLineEdit, "annotator_name"), "bert")
    assert find(dialog, QPushButton, "ok").isEnabled()
    assert not find(dialog, QLabel, "problem").isVisible()


def test_impossible_numbers_are_not_taken(qtbot: QtBot, dialog: SettingsDialog, settings: Settings) -> None:
    retype(qtbot, find(dialog, QDoubleSpinBox, "autosave_seconds"), "99999")
    retype(qtbot, find(dialog, QSpinBox, "cache_limit_mib"), "-5")
    qtbot.mouseClick(find(dialog, QPushButton, "ok"), LEFT)
    assert 0 <= settings.autosave_seconds <= 3600
    assert settings.cache_limit_mib >= 0


def test_every_field_has_an_accessible_name_and_a_tooltip(dialog: SettingsDialog) -> None:
    for kind, name in (
        (QLineEdit, "annotator_name"),
        (QComboBox, "theme"),
        (QComboBox, "renderer"),
        (QDoubleSpinBox, "autosave_seconds"),
        (QSpinBox, "cache_limit_mib"),
    ):
        field = find(dialog, kind, name)
        assert field.accessibleName()
        assert field.toolTip()


@pytest.mark.parametrize("name", ["a/b", "a:b", "..", "anna."])
def test_a_name_that_cannot_be_a_folders_is_refused_with_the_reason(
    qtbot: QtBot, dialog: SettingsDialog, settings: Settings, name: str
) -> None:
    retype(qtbot, find(dialog, QLineEdit, "annotator_name"), name)
    assert "also a folder's" in find(dialog, QLabel, "problem").text()
    assert not find(dialog, QPushButton, "ok").isEnabled()
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    assert dialog.isVisible()
    assert settings.annotator_name == "anna"


def test_saving_can_be_left_to_the_person(qtbot: QtBot, settings: Settings) -> None:
    settings.autosave_seconds = 0.0
    dialog = SettingsDialog(settings)
    qtbot.addWidget(dialog)
    dialog.show()
    assert find(dialog, QDoubleSpinBox, "autosave_seconds").text() == "Only when I save"
    qtbot.mouseClick(find(dialog, QPushButton, "ok"), LEFT)
    assert settings.autosave_seconds == 0.0


def test_the_settings_file_is_named_with_its_folder(dialog: SettingsDialog, settings: Settings) -> None:
    assert str(settings.path) in find(dialog, QLabel, "path").toolTip()
