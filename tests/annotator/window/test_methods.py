"""The switch between keypoints and boxes in the window: by panel, menu and key, remembered and followed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDockWidget, QWidget
from pytestqt.qtbot import QtBot

from annotations.documents.record import Method
from annotations.documents.study import Study, StudyVolume, save_study
from annotations.geometry.boxes import Box
from annotator.panels.annotation.annotation_panel import AnnotationPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from annotator.settings import Settings
from annotator.window.main_window import MainWindow
from tests.annotator.conftest import open_and_wait, write_volume
from tests.annotator.window.conftest import Person


def dock(window: MainWindow) -> QDockWidget:
    found = window.findChild(QDockWidget, "dock_keypoints")
    assert isinstance(found, QDockWidget)
    return found


def panel(window: MainWindow) -> AnnotationPanel:
    found = window.findChild(AnnotationPanel)
    assert isinstance(found, AnnotationPanel)
    return found


def wait_for(qtbot: QtBot, session: Session, method: Method) -> None:
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == method)
    qtbot.waitUntil(lambda: not session.jobs.running)


def test_the_panel_switches_the_method_and_the_choice_is_remembered(
    qtbot: QtBot, window: MainWindow, session: Session, settings: Settings, person: Person
) -> None:
    assert dock(window).windowTitle() == "Keypoints"
    person.click(panel(window), "method_boxes")
    wait_for(qtbot, session, "boxes")
    assert settings.method == "boxes"
    assert dock(window).windowTitle() == "Boxes"
    assert person.action("method_boxes").isChecked()
    person.click(panel(window), "method_keypoints")
    wait_for(qtbot, session, "keypoints")
    assert settings.method == "keypoints"
    assert dock(window).windowTitle() == "Keypoints"


def test_the_panel_follows_the_menus_key(
    qtbot: QtBot, window: MainWindow, session: Session, person: Person
) -> None:
    person.press(Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    wait_for(qtbot, session, "boxes")
    assert panel(window).method == "boxes"
    assert dock(window).windowTitle() == "Boxes"


def test_the_panels_button_derives_the_other_method(
    qtbot: QtBot, window: MainWindow, session: Session, person: Person
) -> None:
    session.set_method("boxes")
    wait_for(qtbot, session, "boxes")
    session.type_box("link0", Box((300.0, 400.0, 200.0), (11000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    person.click(panel(window), "derive")
    wait_for(qtbot, session, "keypoints")
    assert session.document is not None
    assert session.document.derived_from is not None


def test_a_window_that_opens_boxes_begins_with_their_panel(
    make_window: Callable[..., MainWindow], boxes_session: Session
) -> None:
    window = make_window(boxes_session)
    assert dock(window).windowTitle() == "Boxes"
    assert panel(window).method == "boxes"


def test_number_keys_choose_links(
    qtbot: QtBot, make_window: Callable[..., MainWindow], boxes_session: Session
) -> None:
    window = make_window(boxes_session)
    window.slices[2].setFocus()
    person = Person(qtbot, window)
    person.press(Qt.Key.Key_2)
    assert boxes_session.view.active_part == "link1"
    person.press(Qt.Key.Key_7)
    assert boxes_session.view.active_part == "link1"


def test_the_dock_makes_room_for_the_numbers_of_boxes(
    qtbot: QtBot, window: MainWindow, session: Session
) -> None:
    session.set_method("boxes")
    wait_for(qtbot, session, "boxes")
    quaternion = window.findChild(QWidget, "quaternion_editor")
    assert isinstance(quaternion, QWidget)
    # All of it is in sight.
    qtbot.waitUntil(lambda: quaternion.visibleRegion().boundingRect() == quaternion.rect())


def test_a_person_who_annotates_by_boxes_begins_with_their_panel(
    options: SessionOptions, make_window: Callable[..., MainWindow]
) -> None:
    session = Session(replace(options, method="boxes"))
    window = make_window(session)
    assert dock(window).windowTitle() == "Boxes"
    session.shut_down()


def test_a_method_that_the_study_refuses_is_not_remembered(
    qtbot: QtBot,
    options: SessionOptions,
    settings: Settings,
    make_window: Callable[..., MainWindow],
    tmp_path: Path,
) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    write_volume(folder / "v001.npy")
    save_study(
        Study(
            title="One method", tool="magnetic-forceps", volumes=(StudyVolume(id="v001", path="v001.npy"),)
        ),
        folder,
    )
    session = Session(options)
    open_and_wait(qtbot, session, folder)
    window = make_window(session)

    window.actions_by_name["method_boxes"].trigger()

    assert settings.method == "keypoints"
    assert session.method == "keypoints"
    session.shut_down()
