"""A person opens the live view from the menu."""

import pytest
from PySide6.QtWidgets import QPushButton

from annotator.dialogs.checkpoint_dialog import CheckpointDialog
from annotator.dialogs.live.live_window import LiveWindow


@pytest.fixture
def live(qtbot, person):
    person.action("live_view").trigger()
    window = person.window.findChild(LiveWindow)
    qtbot.waitUntil(window.isVisible)
    return window


def test_there_is_one_and_it_comes_back(person, live):
    live.close()
    assert not live.isVisible()

    person.action("live_view").trigger()

    assert live.isVisible()
    assert person.window.findChildren(LiveWindow) == [live]


def test_its_buttons_load_a_checkpoint_as_the_menu_does(qtbot, person, live):
    ships = live.findChild(QPushButton, "live_ship")
    qtbot.waitUntil(lambda: ships.isVisible() and person.action("shipped_checkpoint").isEnabled())

    person.click(live, "live_ship")

    person.click(person.dialog(CheckpointDialog), "checkpoint_close")


def test_it_is_open_beside_the_annotation_and_changes_nothing(person, live, session):
    assert session.volume is not None
    assert not session.unsaved
    assert not session.living.is_running
