"""The fit in the panel: live, with what can be made of it."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from annotations.fitting import pose_fit
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.session import Session
from annotator.session.editing import tool_body
from tests.annotator.redrawn import redrawn

LEFT = Qt.MouseButton.LeftButton
TURN = from_yaw_pitch_roll(20.0, 10.0, 30.0)
BENT = ToolPose((3000.0, 4000.0, 2000.0), TURN, {"theta1": 40.0, "theta2": 25.0})
CLOSED = ToolPose((3000.0, 4000.0, 2000.0), TURN, {"theta1": 40.0, "theta2": 0.0})


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> PosePanel:
    panel = PosePanel(session)
    qtbot.addWidget(panel)
    panel.resize(360, 900)
    panel.show()
    return panel


def place(session: Session, pose: ToolPose, *names: str) -> None:
    assert session.tool is not None
    positions_um = keypoints_um(pose, session.tool)
    for name in names or positions_um:
        session.place(positions_um[name], "clicked", name)


def text(panel: PosePanel, name: str) -> str:
    label = redrawn(panel).findChild(QLabel, name)
    assert isinstance(label, QLabel)
    return label.text()


def button(panel: PosePanel, name: str) -> QPushButton:
    found = redrawn(panel).findChild(QPushButton, name)
    assert isinstance(found, QPushButton)
    return found


def test_the_fit_appears_with_the_first_link(session: Session, panel: PosePanel) -> None:
    nothing = panel.findChild(QLabel, "fit_nothing")
    assert isinstance(nothing, QLabel)
    assert nothing.isVisible()
    place(session, BENT, "k0", "k1")
    redrawn(panel)
    assert not nothing.isVisible()
    assert "2 keypoints" in text(panel, "fit_rms")
    assert text(panel, "fit_theta1") == "open"
    session.undo_stack.undo()
    redrawn(panel)
    assert nothing.isVisible()


def test_the_fit_follows_a_drag_and_an_undo(session: Session, panel: PosePanel) -> None:
    place(session, BENT)
    assert text(panel, "fit_theta1").startswith("+40.0°")
    assert text(panel, "fit_rms").startswith("0 µm rms of 6")
    x, y, z = session.shown_positions_um()["k5"]
    session.begin_preview("k5", (x + 900.0, y, z), "dragged")
    dragged = text(panel, "fit_rms")
    assert not dragged.startswith("0 µm")
    session.keep_preview()
    assert text(panel, "fit_rms") == dragged
    session.undo_stack.undo()
    assert text(panel, "fit_rms").startswith("0 µm")


def test_a_document_that_is_shown_is_fitted_once(
    session: Session, panel: PosePanel, monkeypatch: pytest.MonkeyPatch
) -> None:
    place(session, BENT)
    fitted: list[object] = []

    def fit(document: object, *arguments: object, **options: object) -> object:
        fitted.append(document)
        return pose_fit.fit_document(document, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(tool_body, "fit_document", fit)
    for step in range(3):
        session.begin_preview("k5", (100.0 * step, 0.0, 0.0), "dragged")
        redrawn(panel)
    assert len(fitted) == 3


def test_the_other_solution_is_shown_and_taken_as_one_step(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    place(session, CLOSED)
    assert " or " in text(panel, "fit_theta1")
    assert "two senses" in text(panel, "fit_remarks")
    other = button(panel, "fit_other_0")
    wanted_deg = -session.tool_fit.pose.angles_deg["theta1"]  # type: ignore[union-attr]
    assert other.isVisible()
    steps = session.undo_stack.count
    qtbot.mouseClick(other, LEFT)
    assert session.undo_stack.count == steps + 1
    assert session.tool_pose is not None
    assert session.tool_pose.angles_deg["theta1"] == pytest.approx(wanted_deg, abs=0.1)
    sign = "+" if wanted_deg > 0 else "−"
    assert text(panel, "fit_theta1").startswith(f"{sign}40.0° or"), "the one that was taken stands first"
    session.undo_stack.undo()
    assert session.document.part("k0").source == "clicked"  # type: ignore[union-attr]


def test_nothing_is_offered_where_the_fit_is_alone(session: Session, panel: PosePanel) -> None:
    place(session, CLOSED)
    other = button(panel, "fit_other_0")
    place(session, BENT)
    redrawn(panel)
    assert not other.isVisible()
    remarks = panel.findChild(QLabel, "fit_remarks")
    assert isinstance(remarks, QLabel)
    assert not remarks.isVisible()


def test_what_is_below_stays_while_remarks_come_and_go_in_a_drag(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    place(session, CLOSED)
    fill_in = button(panel, "fit_fill_in")
    qtbot.waitUntil(lambda: not session.is_searching_mistakes)
    # The layout follows a turn after what was drawn.
    redrawn(panel)
    qtbot.wait(30)
    height = fill_in.mapTo(panel, fill_in.rect().topLeft()).y()
    session.begin_preview("k5", keypoints_um(BENT, session.tool)["k5"], "dragged")  # type: ignore[arg-type]
    assert not button(panel, "fit_other_0").isVisible()
    redrawn(panel)
    qtbot.wait(30)
    assert fill_in.mapTo(panel, fill_in.rect().topLeft()).y() == height
    session.keep_preview()
    qtbot.waitUntil(lambda: fill_in.mapTo(panel, fill_in.rect().topLeft()).y() < height)


def test_unplaced_keypoints_are_filled_in_as_one_step(
    qtbot: QtBot, session: Session, panel: PosePanel
) -> None:
    fill_in = button(panel, "fit_fill_in")
    assert not fill_in.isEnabled()
    place(session, BENT, "k0", "k1", "k2", "k3")
    redrawn(panel)
    assert not fill_in.isEnabled()
    assert "does not tell where k4, k5" in fill_in.toolTip()
    place(session, BENT, "k5")
    redrawn(panel)
    assert fill_in.isEnabled()
    assert "k4" in fill_in.toolTip()
    qtbot.mouseClick(fill_in, LEFT)
    filled = session.document.part("k4")  # type: ignore[union-attr]
    assert (filled.state, filled.source) == ("out_of_view", "fitted")
    redrawn(panel)
    assert not fill_in.isEnabled()
    assert "5 keypoints" in text(panel, "fit_rms"), "what was filled in is no evidence"
    x_um, y_um, z_um = keypoints_um(BENT, session.tool)["k5"]  # type: ignore[arg-type]
    session.place((x_um, y_um, z_um + 300.0), "clicked", "k5")
    redrawn(panel)
    assert fill_in.isEnabled()
    assert fill_in.text() == "Fill in again"
    assert "has changed since k4" in fill_in.toolTip()
    qtbot.mouseClick(fill_in, LEFT)
    redrawn(panel)
    assert not fill_in.isEnabled()
    for _ in range(2):
        session.undo_stack.undo()
    redrawn(panel)
    assert fill_in.text() == "Fill in from the fit"
    session.undo_stack.undo()
    redrawn(panel)
    assert fill_in.isEnabled()
