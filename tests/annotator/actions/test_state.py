"""Which actions make sense, which are on, and what they are called, for the states of a session."""

from pathlib import Path

import pytest

from annotations.fitting.refine import Refinement
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotator.actions.state import ActionState, state_of
from annotator.session import Session
from tests.annotations.prediction.tiny_networks import save_tiny

BOX = Box((100.0, 200.0, 300.0), (11_000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
POSE = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0})
OF_BODIES = {"keypoint", "box", "turnable", "posing", "positions", "keypoints", "alternatives"}


def now(session: Session) -> ActionState:
    return state_of(session, ())


@pytest.fixture
def boxes(qtbot, session: Session) -> Session:
    with qtbot.waitSignal(session.volume_changed):
        session.set_method("boxes")
    return session


def test_nothing_open_offers_nothing_of_the_tool(empty_session):
    state = now(empty_session)
    assert state.met == {"always", "shipped"}
    assert state.checked.isdisjoint({"method_keypoints", "method_boxes"})


def test_it_is_told_why_nothing_can_be_predicted(empty_session, tmp_path):
    assert dict(now(empty_session).reasons)["predict_volume"] == "Load a checkpoint first"
    empty_session.predicting.load(save_tiny(tmp_path / "tiny.onnx"))
    reasons = dict(now(empty_session).reasons)
    assert reasons["predict_volume"] == reasons["predict_study"] == "Open a volume first"


def test_keypoints_have_positions_and_no_box(session):
    assert now(session).met.isdisjoint(OF_BODIES)
    assert "method_keypoints" in now(session).checked
    session.place((1.0, 2.0, 3.0))
    session.activate("k0")
    assert now(session).met & OF_BODIES == {"keypoint", "positions", "keypoints"}


def test_pose_mode_turns_and_bends(session):
    session.set_mode("pose")
    assert now(session).met & OF_BODIES == {"turnable", "posing"}
    assert "pose_mode" in now(session).checked
    assert "place_mode" not in now(session).checked
    session.drag_handle("move:link0", (1.0, 2.0, 3.0))
    assert "preview" in now(session).met
    session.keep_draft()
    assert "preview" not in now(session).met


def test_a_placed_box_is_resized_and_turned(boxes):
    # The keys that turn are there before anything is placed, and say why nothing turns.
    assert now(boxes).met & OF_BODIES == {"turnable"}
    assert "method_boxes" in now(boxes).checked
    boxes.type_box("link0", BOX)
    assert now(boxes).met & OF_BODIES == {"box", "turnable", "positions"}
    assert "free_cross_section" not in now(boxes).checked
    boxes.free_cross_section("link0", True)
    assert "free_cross_section" in now(boxes).checked
    boxes.activate("link1")
    assert now(boxes).met & OF_BODIES == {"turnable", "positions"}
    assert "free_cross_section" not in now(boxes).checked


def test_a_box_that_waits_for_its_second_click_is_no_box_yet(boxes):
    boxes.place((0.0, 0.0, 0.0))
    boxes.aim_second_end((500.0, 0.0, 0.0))
    assert {"box", "positioned"}.isdisjoint(now(boxes).met)


def test_number_keys_are_called_after_keypoints_or_links(session, boxes):
    texts = dict(now(boxes).texts)
    assert (texts["keypoint_1"], texts["keypoint_3"], texts["keypoint_4"]) == ("link0", "link2", "")
    assert "keypoint_1" in now(boxes).checked


def test_keypoints_are_called_by_their_labels(session):
    texts = dict(now(session).texts)
    assert texts["keypoint_1"] == "k0 – base of link 0"
    assert texts["keypoint_7"] == ""


def test_another_solution_and_a_refinement_are_offered(session):
    for name, position_um in keypoints_um(POSE, session.tool).items():
        if name in ("k0", "k1", "k2", "k3"):
            session.place(position_um, keypoint=name)
    assert "alternatives" in now(session).met
    assert "preview" not in now(session).met
    session.look(refinement=Refinement(POSE, {}, {}, 2.0, 1.0, ""))
    assert "preview" in now(session).met


def test_recent_paths_are_named(empty_session):
    texts = dict(state_of(empty_session, (Path("/data/v001.npy"),)).texts)
    assert texts["recent_1"] == "v001.npy – /data"
    assert texts["recent_2"] == ""
