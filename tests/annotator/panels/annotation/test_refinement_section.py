"""The volume's proposal in the panel: asked for, looked at, accepted or rejected."""

from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QTableWidget
from pytestqt.qtbot import QtBot

from annotations.fitting.refine import Refinement, Support
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import from_yaw_pitch_roll
from annotator.panels.annotation.pose_panel import PosePanel
from annotator.session import Session
from tests.annotator.held_refiner import HeldRefiner

LEFT = Qt.MouseButton.LeftButton
POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)
PROPOSED = Refinement(
    replace(POSE, position_um=(3100.0, 4000.0, 2000.0)),
    dict.fromkeys((f"k{number}" for number in range(6)), 100.0),
    {"link0": Support(90, 100)},
    80.0,
    20.0,
    "No light reaches link2.",
)


@pytest.fixture
def refiner(monkeypatch: pytest.MonkeyPatch) -> HeldRefiner:
    return HeldRefiner(monkeypatch, PROPOSED)


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> PosePanel:
    panel = PosePanel(session)
    qtbot.addWidget(panel)
    panel.resize(360, 700)
    panel.show()
    return panel


def button(panel: PosePanel, name: str) -> QPushButton:
    found = panel.findChild(QPushButton, name)
    assert isinstance(found, QPushButton)
    return found


def text(panel: PosePanel, name: str) -> str:
    found = panel.findChild(QLabel, name)
    assert isinstance(found, QLabel)
    return found.text()


def propose(qtbot: QtBot, session: Session, refiner: HeldRefiner) -> None:
    refiner.go_on.set()
    session.pose_tool(POSE)
    session.refine()
    qtbot.waitUntil(lambda: session.view.refinement is not None)


def test_it_says_that_the_volume_is_read_and_then_what_it_proposes(
    qtbot: QtBot, session: Session, panel: PosePanel, refiner: HeldRefiner
) -> None:
    start = button(panel, "refine_start")
    assert not start.isEnabled(), "nothing is placed yet"
    session.pose_tool(POSE)
    assert start.isEnabled()
    assert not button(panel, "refine_accept").isVisible()
    qtbot.mouseClick(start, LEFT)
    assert text(panel, "refine_text") == "Reading the volume…"
    assert not start.isEnabled()
    refiner.go_on.set()
    qtbot.waitUntil(lambda: session.view.refinement is not None)
    assert not start.isVisible()
    moves = panel.findChild(QTableWidget, "refine_moves")
    assert isinstance(moves, QTableWidget)
    assert [(moves.item(row, 0).text(), moves.item(row, 1).text()) for row in range(moves.rowCount())] == [
        (f"k{number}", "100") for number in range(6)
    ]
    assert "20 µm rms" in text(panel, "refine_surface")
    assert text(panel, "refine_remark") == "No light reaches link2."


def test_the_proposal_is_accepted_as_one_step(
    qtbot: QtBot, session: Session, panel: PosePanel, refiner: HeldRefiner
) -> None:
    propose(qtbot, session, refiner)
    steps = session.undo_stack.count
    qtbot.mouseClick(button(panel, "refine_accept"), LEFT)
    assert session.undo_stack.count == steps + 1
    assert {part.source for part in session.document.parts} == {"refined"}  # type: ignore[union-attr]
    assert button(panel, "refine_start").isVisible()
    assert not button(panel, "refine_accept").isVisible()
    session.undo_stack.undo()
    assert {part.source for part in session.document.parts} == {"posed"}  # type: ignore[union-attr]


def test_the_proposal_is_rejected(
    qtbot: QtBot, session: Session, panel: PosePanel, refiner: HeldRefiner
) -> None:
    propose(qtbot, session, refiner)
    before = session.document
    qtbot.mouseClick(button(panel, "refine_reject"), LEFT)
    assert session.document is before
    assert session.view.refinement is None
    assert button(panel, "refine_start").isEnabled()


def test_a_proposal_comes_into_sight(
    qtbot: QtBot, session: Session, panel: PosePanel, refiner: HeldRefiner
) -> None:
    panel.resize(360, 300)
    propose(qtbot, session, refiner)
    accept = button(panel, "refine_accept")
    qtbot.waitUntil(lambda: 0 < accept.mapTo(panel, accept.rect().center()).y() < panel.height())


def test_a_refinement_that_is_cancelled_can_be_asked_for_again(
    qtbot: QtBot, session: Session, panel: PosePanel, refiner: HeldRefiner
) -> None:
    session.pose_tool(POSE)
    session.refine()
    (job,) = [job for job in session.jobs.running if job.title.startswith("Refining")]
    session.jobs.cancel(job)
    qtbot.waitUntil(lambda: not session.is_refining)
    qtbot.waitUntil(lambda: button(panel, "refine_start").isEnabled())
