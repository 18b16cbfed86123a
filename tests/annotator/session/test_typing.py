"""What is being typed is meant: it is kept before anything else happens, and only Esc drops it."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.files import load_annotation
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose
from annotator.session import Session

POSE = ToolPose((300.0, 400.0, 200.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0, "theta2": 25.0})
TYPED_UM = (310.0, 400.0, 200.0)


@pytest.fixture
def typing(boxes_session: Session) -> Session:
    """A session in place mode in which the centre of a placed box is being typed."""
    session = boxes_session
    session.pose_tool(POSE)
    session.set_mode("place")
    session.activate("link0")
    session.preview_box("link0", typed_box(session))
    return session


def typed_box(session: Session) -> Box:
    assert session.document is not None
    return replace(session.document.placed_boxes["link0"], center_um=TYPED_UM)


def center_um(session: Session) -> tuple[float, float, float]:
    assert session.document is not None
    return session.document.placed_boxes["link0"].center_um


@pytest.mark.parametrize(
    ("go_on", "further_edits"),
    [
        (lambda session: session.set_mode("pose"), 0),
        (lambda session: session.activate("link2"), 0),
        (lambda session: session.set_certainty("link1", "unsure"), 1),
        (lambda session: session.set_locked("link0", True), 1),
        (lambda session: session.set_status("done"), 1),
        (lambda session: session.turn(0, 10.0), 1),
        (lambda session: session.save(), 0),
    ],
    ids=["mode", "activate", "certainty", "lock", "done", "turn", "save"],
)
def test_whoever_goes_on_keeps_what_is_typed_as_a_step_of_its_own(
    typing: Session, go_on: Callable[[Session], object], further_edits: int
) -> None:
    before = typing.undo_stack.count
    go_on(typing)
    assert center_um(typing) == TYPED_UM
    assert typing.view.draft is None
    assert typing.undo_stack.count == before + 1 + further_edits


def test_a_key_that_moves_the_box_moves_it_from_where_it_was_typed_to(typing: Session) -> None:
    typing.nudge(0, 1)
    assert center_um(typing) == pytest.approx((TYPED_UM[0] + 15.9, *TYPED_UM[1:]))
    typing.undo()
    assert center_um(typing) == TYPED_UM


def test_undo_takes_back_what_is_being_typed_and_nothing_else(typing: Session) -> None:
    present = typing.document
    typing.undo()
    assert typing.document == present
    typing.redo()
    assert center_um(typing) == TYPED_UM


def test_esc_drops_it(typing: Session) -> None:
    present = typing.document
    typing.drop_preview()
    typing.set_certainty("link1", "unsure")
    assert center_um(typing) != TYPED_UM
    typing.undo()
    assert typing.document == present


def test_a_position_that_is_typed_is_kept_when_another_keypoint_becomes_active(session: Session) -> None:
    session.place((1.0, 2.0, 3.0), keypoint="k0")
    session.activate("k0")
    session.begin_preview("k0", (4.0, 5.0, 6.0), "typed")
    session.activate("k3")
    assert session.document is not None
    assert session.document.positions_um["k0"] == (4.0, 5.0, 6.0)
    assert session.view.active_part == "k3"


def test_what_is_in_hand_is_not_kept_by_another_edit(boxes_session: Session) -> None:
    session = boxes_session
    session.pose_tool(POSE)
    session.set_mode("place")
    session.activate("link0")
    session.drag_handle("center", TYPED_UM)
    session.set_certainty("link1", "unsure")
    assert center_um(session) != TYPED_UM
    assert session.view.draft is None


def test_a_step_of_a_joint_is_kept_when_a_key_bends_another_one(boxes_session: Session) -> None:
    session = boxes_session
    session.set_mode("pose")
    session.pose_tool(POSE)
    session.preview_angle("theta1", 41.0, is_typed=True)
    session.bend(1, 5.0)
    assert session.settled_pose is not None
    assert session.settled_pose.angles_deg == pytest.approx({"theta1": 41.0, "theta2": 30.0})
    session.undo()
    assert session.settled_pose.angles_deg["theta1"] == pytest.approx(41.0, abs=1e-3)


def test_autosave_leaves_a_number_alone_that_is_half_typed(typing: Session) -> None:
    edits = typing.undo_stack.count
    draft = typing.view.draft
    typing._autosave.save_requested.emit()
    assert not typing.unsaved
    assert typing.view.draft is draft
    assert typing.undo_stack.count == edits
    path = typing.annotation_path
    assert path is not None
    assert load_annotation(path)[0].placed_boxes["link0"].center_um != TYPED_UM
    assert typing.close_volume()
    assert load_annotation(path)[0].placed_boxes["link0"].center_um == TYPED_UM


def test_what_is_derived_follows_from_what_is_typed(qtbot: QtBot, typing: Session) -> None:
    typing.deriving.derive()
    qtbot.waitUntil(lambda: typing.document is not None and typing.document.method == "keypoints")
    assert typing.document is not None
    base_um, tip_um = (typing.document.positions_um[name] for name in ("k0", "k1"))
    middle_um = [(one + other) / 2 for one, other in zip(base_um, tip_um, strict=True)]
    assert middle_um == pytest.approx(TYPED_UM)
