"""The pose panel follows the document, and a drag."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QApplication,
    QLabel,
    QPushButton,
    QScrollArea,
    QTableWidget,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotator.looks import theme
from annotator.looks.redrawing import Redrawing
from annotator.panels.annotation import pose_panel
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.panels.annotation.pose_readout import PoseReadout, pose_readout
from annotator.session import Session
from tests.annotator.redrawn import redrawn

STRAIGHT: dict[str, Vector] = {
    "k0": (0.0, 0.0, 0.0),
    "k1": (100.0, 0.0, 0.0),
    "k2": (110.0, 0.0, 0.0),
    "k3": (110.0, 200.0, 0.0),
}


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> PosePanel:
    panel = PosePanel(session)
    qtbot.addWidget(panel)
    panel.resize(360, 700)
    panel.show()
    return panel


def text(panel: PosePanel, name: str) -> str:
    label = redrawn(panel).findChild(QLabel, f"pose_{name}")
    assert isinstance(label, QLabel)
    return label.text()


def place_all(session: Session) -> None:
    for name, position_um in STRAIGHT.items():
        session.place(position_um, "clicked", name)


def test_targets_appear_as_their_keypoints_are_placed(session: Session, panel: PosePanel) -> None:
    assert text(panel, "position_um") == "needs k0, k1"
    assert text(panel, "theta2_deg") == "needs k2, k3, k4, k5"
    place_all(session)
    assert text(panel, "position_um").startswith("50.0  0.0  0.0")
    assert text(panel, "orientation") == "1.0000  0.0000  0.0000"
    assert text(panel, "theta1_deg") == "90.00°"
    assert text(panel, "theta2_deg") == "needs k4, k5"
    session.undo_stack.undo()
    assert text(panel, "theta1_deg") == "needs k3"


def test_the_pose_moves_with_a_drag_and_comes_back_when_it_is_dropped(
    session: Session, panel: PosePanel
) -> None:
    place_all(session)
    session.begin_preview("k3", (310.0, 0.0, 0.0), "dragged")
    assert text(panel, "theta1_deg") == "0.00°"
    session.drop_preview()
    assert text(panel, "theta1_deg") == "90.00°"


def test_the_note_says_what_is_not_known(session: Session, panel: PosePanel) -> None:
    assert "unsigned" in text(panel, "note")
    assert "hinge axis" in text(panel, "note")
    assert "roll" in text(panel, "note")


def test_entering_pose_mode_brings_its_controls_in_sight(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    place_all(session)
    panel.resize(360, 240)
    scroll = panel.findChild(QScrollArea, "pose_scroll")
    title = panel.findChild(QToolButton, "controls_unfold")
    scroll.verticalScrollBar().setValue(0)
    session.set_mode("pose")
    qtbot.waitUntil(lambda: not panel.findChild(QWidget, "pose_theta1_slider").visibleRegion().isEmpty())
    assert title.visibleRegion().boundingRect() == title.rect()
    # A person who scrolls on is not called back by every change.
    scroll.verticalScrollBar().setValue(0)
    session.preview_angle("theta1", 20.0)
    session.keep_draft()
    QApplication.processEvents()
    assert scroll.verticalScrollBar().value() == 0


def test_links_stand_beside_their_nominal_lengths(session: Session, panel: PosePanel) -> None:
    table = panel.findChild(QTableWidget, "link_table")
    assert isinstance(table, QTableWidget)
    session.place((0.0, 0.0, 0.0), "clicked", "k0")
    session.place((12100.0, 0.0, 0.0), "clicked", "k1")
    redrawn(panel)
    row = [table.item(0, column).text() for column in range(4)]
    assert row == ["link0  k0–k1", "12.100", "11.000", "+10.0 %"]
    assert [table.item(1, column).text() for column in (1, 3)] == ["—", "—"]
    assert table.item(1, 1).toolTip() == "Needs k2 and k3"
    session.begin_preview("k1", (9900.0, 0.0, 0.0), "dragged")
    redrawn(panel)
    assert table.item(0, 3).text() == "−10.0 %"
    session.begin_preview("k1", (10999.9999, 0.0, 0.0), "dragged")
    redrawn(panel)
    assert table.item(0, 3).text() == "0.0 %"


def test_a_length_that_nothing_explains_is_colored(session: Session, panel: PosePanel) -> None:
    table = panel.findChild(QTableWidget, "link_table")
    assert isinstance(table, QTableWidget)
    session.place((0.0, 0.0, 0.0), "clicked", "k0")
    session.place((11100.0, 0.0, 0.0), "clicked", "k1")
    redrawn(panel)
    colors = theme.colors(panel.palette())
    assert table.item(0, 3).foreground() == table.palette().text()
    for length_um, color in ((12200.0, colors.warning), (13500.0, colors.error)):
        session.begin_preview("k1", (length_um, 0.0, 0.0), "dragged")
        redrawn(panel)
        assert table.item(0, 3).foreground().color() == color
        assert "look at both ends" in table.item(0, 3).toolTip()
    session.drop_preview()
    redrawn(panel)
    assert table.item(0, 3).foreground() == table.palette().text()


def test_boxes_show_signed_angles_beside_the_published_ones(qtbot: QtBot, boxes_session: Session) -> None:
    panel = PosePanel(boxes_session)
    qtbot.addWidget(panel)
    assert text(panel, "theta1_deg") == "needs link0, link1"
    assert boxes_session.tool is not None
    pose = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": -35.2, "theta2": 20.0})
    for link, box in link_boxes(pose, boxes_session.tool).items():
        boxes_session.type_box(link, box)
    assert text(panel, "theta1_deg") == "35.20°   signed \N{MINUS SIGN}35.20°"
    assert text(panel, "theta2_deg") == "20.00°   signed +20.00°"
    assert "unsigned" not in text(panel, "note")
    boxes_session.activate("link0")
    boxes_session.turn_over()
    assert text(panel, "theta1_deg") == "35.20°   signed +35.20°"
    doubt = panel.findChild(QLabel, "pose_theta1_deg_doubt")
    assert not doubt.isVisibleTo(panel)
    boxes_session.turn(0, 90.0)
    assert text(panel, "theta1_deg") == "35.20°"
    assert doubt.isVisibleTo(panel)
    assert "not across the bend" in doubt.text()
    assert doubt.palette().color(doubt.foregroundRole()) == theme.colors(panel.palette()).warning
    boxes_session.undo_stack.undo()
    redrawn(panel)
    assert not doubt.isVisibleTo(panel)
    panel.copy_to_clipboard()
    assert "theta1_signed_deg\t35.2\n" in QApplication.clipboard().text()


def test_all_distances_are_folded_away_until_asked_for(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    place_all(session)
    table = redrawn(panel).findChild(QTableWidget, "distance_matrix")
    fold = panel.findChild(QToolButton, "distances_unfold")
    assert isinstance(table, QTableWidget)
    assert isinstance(fold, QToolButton)
    assert not table.isVisible()
    qtbot.mouseClick(fold, Qt.MouseButton.LeftButton)
    assert table.isVisible()
    assert table.rowCount() == table.columnCount() == 5
    assert table.verticalHeaderItem(2).text() == "k3"
    assert table.horizontalHeaderItem(0).text() == "k0"
    assert table.item(2, 2).text() == "0.200"
    assert table.item(3, 0).text() == "—"
    assert table.item(0, 1) is None
    qtbot.mouseClick(fold, Qt.MouseButton.LeftButton)
    assert not table.isVisible()


def test_everything_is_copied_as_a_table(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    place_all(session)
    button = panel.findChild(QPushButton, "pose_copy")
    assert isinstance(button, QPushButton)
    with qtbot.waitSignal(session.message_posted):
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    copied = QApplication.clipboard().text()
    assert "theta1_deg\t90\n" in copied
    assert "distance_k2_k3_um\t200\n" in copied


def test_without_a_volume_the_panel_says_so(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    nothing = panel.findChild(QLabel, "pose_nothing")
    assert isinstance(nothing, QLabel)
    assert not nothing.isVisible()
    QApplication.clipboard().setText("untouched")
    session.close_volume()
    # At once: the panel follows a turn later.
    panel.copy_to_clipboard()
    assert QApplication.clipboard().text() == "untouched"
    qtbot.waitUntil(nothing.isVisible)


def test_a_needle_has_fewer_rows(qtbot: QtBot, session: Session, panel: PosePanel) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.choose_tool("needle")
        qtbot.waitUntil(lambda: session.tool is not None and session.tool.name == "needle")
    qtbot.waitUntil(lambda: panel.findChild(QLabel, "pose_theta1_deg") is None)
    assert text(panel, "position_um") == "needs tip"
    assert text(panel, "orientation") == "needs shaft, tip"
    assert "unsigned" not in text(panel, "note")
    table = panel.findChild(QTableWidget, "distance_matrix")
    assert isinstance(table, QTableWidget)
    assert (table.rowCount(), table.columnCount()) == (1, 1)
    qtbot.waitUntil(lambda: not session.jobs.running)


def test_the_pose_of_another_volume_does_not_wait_until_lists_and_tables_are_drawn(
    session: Session, panel: PosePanel
) -> None:
    nothing = panel.findChild(QLabel, "pose_nothing")
    assert isinstance(nothing, QLabel)
    others = [Redrawing(lambda: None, panel) for _ in range(40)]
    for other in others:
        other.ask_apart()
    session.close_volume()
    # A hand on its fields would go on from what they show.
    while not nothing.isVisible():
        assert any(other.is_owed for other in others)
        QApplication.processEvents()
    assert any(other.is_owed for other in others)


def counted_readouts(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Return a list that grows by a document with each drawing from now on."""
    drawn: list[object] = []

    def readout(document: Annotation, tool: ToolSpecification) -> PoseReadout:
        drawn.append(document)
        return pose_readout(document, tool)

    monkeypatch.setattr(pose_panel, "pose_readout", readout)
    return drawn


def test_many_edits_in_one_turn_are_drawn_once_and_as_the_last_one_left_them(
    qtbot: QtBot, session: Session, panel: PosePanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    place_all(session)
    redrawn(panel)
    drawn = counted_readouts(monkeypatch)
    for step in range(1, 11):
        session.type_position("k1", (100.0 + step, 0.0, 0.0))
    assert drawn == []
    qtbot.waitUntil(lambda: bool(drawn))
    QApplication.processEvents()
    assert drawn == [session.document]
    label = panel.findChild(QLabel, "pose_position_um")
    assert isinstance(label, QLabel)
    assert label.text().startswith("55.0  0.0  0.0")


def test_it_is_drawn_in_a_drag_without_end(
    session: Session, panel: PosePanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    place_all(session)
    redrawn(panel)
    drawn = counted_readouts(monkeypatch)
    for step in range(20):
        # The next moves are there at every turn of the event loop.
        session.begin_preview("k3", (110.0, 200.0 + 2 * step, 0.0), "dragged")
        session.begin_preview("k3", (110.0, 201.0 + 2 * step, 0.0), "dragged")
        QApplication.processEvents()
    assert 5 < len(drawn) <= 20


def test_what_stands_below_is_drawn_a_turn_after_the_pose_of_another_volume(
    qtbot: QtBot, empty_session: Session, request: pytest.FixtureRequest
) -> None:
    panel = PosePanel(empty_session)
    qtbot.addWidget(panel)
    panel.resize(360, 700)
    panel.show()
    shown: list[tuple[bool, bool]] = []

    def is_shown(name: str) -> bool:
        button = panel.findChild(QToolButton, name)
        assert isinstance(button, QToolButton)
        return button.isVisible()

    draw_below = panel._draw_lower
    panel._draw_lower = lambda: (
        shown.append((is_shown("pose_unfold"), is_shown("fit_unfold"))),
        draw_below(),
    )  # type: ignore[method-assign,assignment,return-value]
    session: Session = request.getfixturevalue("session")
    assert session is empty_session
    redrawn(panel)
    qtbot.waitUntil(lambda: bool(shown) and not panel._arrival_below.is_owed)
    assert shown[0] == (True, False)
    assert is_shown("fit_unfold")

    # Nothing of it stands below when nothing is open.
    assert session.close_volume()
    panel._arrival.draw_now()
    assert not is_shown("fit_unfold")


def test_whoever_is_led_to_a_section_right_after_opening_finds_it(session: Session, panel: PosePanel) -> None:
    redrawn(panel)
    session.volume_changed.emit()
    panel._arrival.draw_now()
    assert panel._arrival_below.is_owed
    session.set_mode("pose")
    assert not panel._arrival_below.is_owed
