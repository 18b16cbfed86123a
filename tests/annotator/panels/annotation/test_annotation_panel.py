"""One panel for either method: it follows the document, and asks for the other one."""

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QLabel, QWidget
from pytestqt.qtbot import QtBot

from annotations.documents.record import Method
from annotations.documents.study import Study, StudyVolume, save_study
from annotator.panels.annotation.annotation_panel import AnnotationPanel
from annotator.session import Session
from tests.annotator.conftest import open_and_wait

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def make_panel(qtbot: QtBot) -> Callable[[Session], AnnotationPanel]:
    """Make a panel of a session, shown."""

    def make(session: Session) -> AnnotationPanel:
        panel = AnnotationPanel(session)
        qtbot.addWidget(panel)
        panel.resize(400, 500)
        panel.show()
        return panel

    return make


def button(panel: AnnotationPanel, name: str) -> QAbstractButton:
    found = panel.findChild(QAbstractButton, name)
    assert isinstance(found, QAbstractButton)
    return found


def is_shown(panel: AnnotationPanel, name: str) -> bool:
    found = panel.findChild(QWidget, f"{name}_panel")
    assert isinstance(found, QWidget)
    return found.isVisible()


def origin(panel: AnnotationPanel) -> QLabel:
    found = panel.findChild(QLabel, "derived_from")
    assert isinstance(found, QLabel)
    return found


def wait_for(qtbot: QtBot, session: Session, method: Method) -> None:
    qtbot.waitUntil(lambda: session.document is not None and session.document.method == method)
    qtbot.waitUntil(lambda: not session.jobs.running)


def place_bent(session: Session) -> None:
    for number, position_um in enumerate(
        [
            (1000.0, 2000.0, 3000.0),
            (9000.0, 2000.0, 3000.0),
            (9300.0, 2200.0, 3000.0),
            (12000.0, 4000.0, 3000.0),
            (12000.0, 4200.0, 3000.0),
            (12000.0, 8000.0, 3000.0),
        ]
    ):
        session.place(position_um, keypoint=f"k{number}")


def test_the_panel_of_the_documents_method_is_shown_and_names_it(
    qtbot: QtBot, session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(session)
    assert (is_shown(panel, "keypoints"), is_shown(panel, "boxes")) == (True, False)
    assert button(panel, "method_keypoints").isChecked()
    assert panel.windowTitle() == "Keypoints"
    with qtbot.waitSignal(panel.windowTitleChanged):
        session.set_method("boxes")
    wait_for(qtbot, session, "boxes")
    assert (is_shown(panel, "keypoints"), is_shown(panel, "boxes")) == (False, True)
    assert button(panel, "method_boxes").isChecked()
    assert panel.windowTitle() == "Boxes"


def test_the_switch_asks_and_changes_nothing_by_itself(
    qtbot: QtBot, session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(session)
    with qtbot.waitSignal(panel.method_requested) as asked:
        qtbot.mouseClick(button(panel, "method_boxes"), LEFT)
    assert asked.args == ["boxes"]
    assert button(panel, "method_keypoints").isChecked()
    assert is_shown(panel, "keypoints")


def test_with_nothing_open_the_method_to_come_is_shown(
    empty_session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(empty_session)
    assert is_shown(panel, "keypoints")
    assert not button(panel, "derive").isEnabled()
    empty_session.set_method("boxes")
    assert is_shown(panel, "boxes")


def test_a_study_of_one_method_offers_no_other_and_says_so(
    qtbot: QtBot,
    empty_session: Session,
    volume_path: Path,
    make_panel: Callable[[Session], AnnotationPanel],
) -> None:
    folder = volume_path.parent
    study = Study(
        title="Study",
        tool="magnetic-forceps",
        annotators=("anna",),
        methods=("keypoints",),
        volumes=(StudyVolume(id="v001", path=volume_path.name),),
    )
    save_study(study, folder)
    open_and_wait(qtbot, empty_session, folder)
    panel = make_panel(empty_session)
    assert not button(panel, "method_boxes").isEnabled()
    assert "annotated by keypoints alone" in button(panel, "method_boxes").toolTip()
    place_bent(empty_session)
    assert not button(panel, "derive").isEnabled()
    assert "annotated by keypoints alone" in button(panel, "derive").toolTip()


def test_deriving_waits_for_something_to_derive_from(
    qtbot: QtBot, session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(session)
    assert not button(panel, "derive").isEnabled()
    assert "Place keypoints first" in button(panel, "derive").toolTip()
    session.place((100.0, 100.0, 100.0), keypoint="k0")
    assert button(panel, "derive").isEnabled()
    assert "annotation by boxes" in button(panel, "derive").toolTip()
    with qtbot.waitSignal(panel.derive_requested):
        qtbot.mouseClick(button(panel, "derive"), LEFT)


def test_a_derived_document_says_from_what(
    qtbot: QtBot, session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(session)
    assert not origin(panel).isVisible()
    place_bent(session)
    assert session.annotation_path is not None
    original = session.annotation_path
    session.deriving.derive(12.0)
    wait_for(qtbot, session, "boxes")
    assert origin(panel).isVisible()
    assert origin(panel).text() == f"Derived from {original.name}, roll 12.0°"
    session.set_method("keypoints")
    wait_for(qtbot, session, "keypoints")
    assert not origin(panel).isVisible()


def test_without_a_roll_that_a_person_said_none_is_told(
    qtbot: QtBot, boxes_session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(boxes_session)
    boxes_session.activate("link0")
    boxes_session.place((100.0, 100.0, 100.0))
    boxes_session.place((9100.0, 100.0, 100.0))
    boxes_session.deriving.derive()
    wait_for(qtbot, boxes_session, "keypoints")
    assert origin(panel).text().startswith("Derived from v001")
    assert "roll" not in origin(panel).text()


def test_hidden_panels_ask_for_no_room(
    qtbot: QtBot, session: Session, make_panel: Callable[[Session], AnnotationPanel]
) -> None:
    panel = make_panel(session)
    for_keypoints = panel.sizeHint().height()
    session.set_method("boxes")
    wait_for(qtbot, session, "boxes")
    for_boxes = panel.sizeHint().height()
    assert for_boxes > for_keypoints
    session.set_method("keypoints")
    wait_for(qtbot, session, "keypoints")
    assert panel.sizeHint().height() < for_boxes
