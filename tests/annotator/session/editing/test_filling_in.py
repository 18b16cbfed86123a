"""What nobody sees of the tool: filled in from its fit, named where that does not tell it."""

from dataclasses import replace

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.geometry.kinematics import keypoints_um
from annotator.session import Session
from tests.annotator.session.editing.posed_tool import POSE, assert_same


def test_unseen_keypoints_are_filled_in_and_never_as_placed(session: Session, messages: list[str]) -> None:
    session.fill_in()
    assert "Too few keypoints" in messages[-1]
    assert session.tool is not None
    truth_um = keypoints_um(POSE, session.tool)
    for name in ("k0", "k1", "k2", "k3", "k5"):
        session.place(truth_um[name], keypoint=name)
    session.fill_in()
    assert session.document is not None
    filled = session.document.keypoint("k4")
    assert filled.source == "fitted"
    assert filled.state == "out_of_view", "the tool is larger than the small volume"
    assert filled.position_um == pytest.approx(truth_um["k4"], abs=1.0)
    assert session.undo_stack.undo_text == "Fill in from the fit"
    assert messages[-1] == "Filled in k4"
    session.fill_in()
    assert "Nothing to fill in" in messages[-1]


def test_what_was_filled_in_goes_stale_and_is_filled_in_again(session: Session, messages: list[str]) -> None:
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name != "k4":
            session.place(position_um, keypoint=name)
    assert session.fillable_keypoints == ("k4",)
    session.fill_in()
    assert session.fillable_keypoints == ()
    corrected = replace(POSE, position_um=tuple(np.add(POSE.position_um, 40.0)))
    for name, position_um in keypoints_um(corrected, session.tool).items():
        if name != "k4":
            session.place(position_um, keypoint=name)
    assert session.fillable_keypoints == ("k4",)
    session.fill_in()
    assert session.document is not None
    filled = session.document.keypoint("k4")
    assert filled.position_um == pytest.approx(keypoints_um(corrected, session.tool)["k4"], abs=1.0)
    assert filled.source == "fitted"
    assert messages[-1] == "Filled in k4"
    session.set_locked("k4", True)
    session.place(keypoints_um(POSE, session.tool)["k5"], keypoint="k5")
    assert session.fillable_keypoints == (), "a locked one stays where it is"


def test_what_a_fill_in_leaves_out_is_named(session: Session, messages: list[str]) -> None:
    assert session.tool is not None
    # Of link 1 one end is seen, of link 2 none.
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name in ("k0", "k1", "k3"):
            session.place(position_um, keypoint=name)
    session.fill_in()
    assert messages[-1] == "Filled in k2. What is placed does not tell where k4 and k5 would be"


def test_what_nothing_seen_tells_is_not_filled_in(session: Session, messages: list[str]) -> None:
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name not in ("k4", "k5"):
            session.place(position_um, keypoint=name)
    before = session.document
    session.fill_in()
    assert session.document is before
    assert messages[-1] == "What is placed does not tell where k4 and k5 would be"


def test_boxes_are_not_filled_in(qtbot: QtBot, boxes_session: Session) -> None:
    with qtbot.waitSignal(boxes_session.message_posted) as said:
        boxes_session.fill_in()
    assert "pose mode places the tool" in said.args[0]


def test_the_other_solution_is_taken_as_one_edit(session: Session) -> None:
    assert session.tool is not None
    # θ1 is bent and link 2 unseen: nothing says to which side of the hinge.
    for name, position_um in keypoints_um(replace(POSE, angles_deg={"theta1": 40.0}), session.tool).items():
        if name in ("k0", "k1", "k2", "k3"):
            session.place(position_um, keypoint=name)
    fit = session.tool_fit
    assert fit is not None
    assert len(fit.alternatives) == 1
    session.take_alternative(1)
    assert session.undo_stack.count == 4
    session.take_alternative(0)
    assert session.undo_stack.count == 5
    assert_same(session.settled_pose, fit.alternatives[0])
