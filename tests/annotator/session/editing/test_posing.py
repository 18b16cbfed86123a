"""The tool as one body in the session: posed by handles and keys, filled in from its fit, refined."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.errors import Cancelled, UserError
from annotations.fitting import refine
from annotations.fitting.refine import Refinement, Support
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import from_yaw_pitch_roll, matrix
from annotations.volumes import Ray, write_sidecar
from annotator.session import Session
from annotator.session.options import SessionOptions

POSE = ToolPose(
    (3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 30.0), {"theta1": 40.0, "theta2": 25.0}
)
STRAIGHT = ToolPose((3000.0, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 65.0))


def refinement_of(pose: ToolPose) -> Refinement:
    return Refinement(pose, {"k0": 1.0}, {"link0": Support(90, 100)}, 80.0, 20.0, "")


@pytest.fixture
def messages(session: Session) -> list[str]:
    said: list[str] = []
    session.message_posted.connect(said.append)
    return said


@pytest.fixture
def posed(session: Session) -> Session:
    """A session in pose mode, with the tool posed."""
    session.set_mode("pose")
    session.pose_tool(POSE)
    return session


def assert_same(
    pose: ToolPose | None, expected: ToolPose, at_um: float = 1e-6, at_axis: float = 1e-9
) -> None:
    assert pose is not None
    assert pose.position_um == pytest.approx(expected.position_um, abs=at_um)
    np.testing.assert_allclose(matrix(pose.rotation_wxyz), matrix(expected.rotation_wxyz), atol=at_axis)
    for name in ("theta1", "theta2"):
        assert pose.angles_deg.get(name, 0.0) == pytest.approx(expected.angles_deg.get(name, 0.0), abs=1e-3)


# Beginning


@pytest.mark.parametrize("depth_axis", [0, 2])
def test_a_tool_that_nobody_placed_lies_at_the_crosshair_across_the_light(
    qtbot: QtBot, empty_session: Session, volume_path: Path, depth_axis: int
) -> None:
    write_sidecar(volume_path, (15.9, 13.5, 9.4), depth_axis)  # type: ignore[arg-type]
    session = empty_session
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    session.look(crosshair_um=(159.0, 270.0, 94.0))
    assert session.tool_pose is None
    assert session.solids() == ()
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_mode("pose")
    assert "Drag the tool" in said.args[0]
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == session.view.crosshair_um
    axes = matrix(session.tool_pose.rotation_wxyz)
    np.testing.assert_allclose(axes[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(axes[:, 2], np.eye(3)[depth_axis], atol=1e-12)
    assert len(session.handles()) == 7
    assert {solid.kind for solid in session.solids()} == {"ghost"}
    assert session.undo_stack.count == 0
    session.set_mode("navigate")
    assert session.solids() == (), "nothing is placed that it could be the fit of"


def test_one_keypoint_is_too_little_for_a_fit_but_not_for_posing(session: Session) -> None:
    session.place((100.0, 200.0, 300.0))
    session.set_mode("pose")
    assert session.tool_fit is None
    session.drag_handle("move:link0", (500.0, 500.0, 500.0))
    session.keep_draft()
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == pytest.approx((500.0, 500.0, 500.0))
    assert len(session.document.positions_um) == 6  # type: ignore[union-attr]
    session.undo_stack.undo()
    session.set_mode("place")
    assert session.tool_pose is None, "the last pose is no fit of the one keypoint"


def test_a_tool_without_links_cannot_be_posed(
    qtbot: QtBot, options: SessionOptions, volume_path: Path
) -> None:
    options.user_tool_folder.mkdir()
    (options.user_tool_folder / "marks.toml").write_text(
        'schema = "oct-tool/1"\nname = "marks"\nkeypoints = [{ name = "a" }, { name = "b" }]\n'
    )
    session = Session(replace(options, tool_name="marks"))
    session.set_mode("pose")
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    assert session.view.mode == "navigate", "the volume before may have been posed in"
    with qtbot.waitSignal(session.message_posted) as said:
        session.set_mode("pose")
    assert "no links" in said.args[0]
    assert session.view.mode == "navigate"
    session.place((1.0, 2.0, 3.0))
    assert session.tool_fit is None
    assert session.solids() == ()
    session.shut_down()


def test_a_needle_is_posed_too(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> None:
    session = Session(replace(options, tool_name="needle"))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    session.set_mode("pose")
    before = session.document
    session.bend(0, 10.0)
    assert session.document is before
    session.drag_handle("move:needle", (1000.0, 1000.0, 1000.0))
    session.keep_draft()
    document = session.document
    assert document is not None
    middle_um = np.mean([document.positions_um["tip"], document.positions_um["shaft"]], axis=0)
    assert middle_um == pytest.approx((1000.0, 1000.0, 1000.0))
    session.shut_down()


def test_pose_mode_goes_on_in_the_next_volume_with_a_tool_to_take_hold_of(
    qtbot: QtBot, session: Session, volume_path: Path
) -> None:
    second = volume_path.with_name("v002.npy")
    np.save(second, np.load(volume_path))
    write_sidecar(second, (15.9, 13.5, 9.4), 2)
    session.set_mode("pose")
    session.pose_tool(POSE)
    with qtbot.waitSignal(session.worklist_changed):
        session.open_path(volume_path.parent)
    qtbot.waitUntil(lambda: len(session.items) == 2 and not session.jobs.running)
    with qtbot.waitSignal(session.volume_changed):
        session.next_volume()
    assert session.view.mode == "pose"
    assert session.handles()
    assert session.tool_pose is not None
    assert session.tool_pose.position_um == session.view.crosshair_um
    with qtbot.waitSignal(session.volume_changed):
        session.previous_volume()
    assert_same(session.tool_pose, POSE, at_um=1.0, at_axis=1e-3)


# Posing


def test_a_drag_moves_everything_and_is_one_edit(session: Session) -> None:
    session.set_mode("pose")
    before = session.document
    for x_um in (500.0, 700.0, 900.0):
        session.drag_handle("move:link1", (x_um, 800.0, 400.0))
    assert session.document is before
    assert session.view.draft is not None
    assert session.tool_pose == session.view.draft.pose
    drawn_um = dict(session.shown_positions_um())
    session.keep_draft()
    document = session.document
    assert document is not None
    assert document.positions_um == drawn_um
    assert np.mean([drawn_um["k2"], drawn_um["k3"]], axis=0) == pytest.approx((900.0, 800.0, 400.0))
    assert {part.source for part in document.parts} == {"posed"}
    assert session.undo_stack.count == 1
    assert session.undo_stack.undo_text == "Pose the tool"
    session.undo_stack.undo()
    assert session.document == before


def test_every_gesture_begins_where_the_last_one_ended(posed: Session) -> None:
    posed.drag_handle(
        "bend:theta2",
        keypoints_um(replace(POSE, angles_deg={"theta1": 40.0, "theta2": 70.0}), posed.tool)["k5"],
    )  # type: ignore[arg-type]
    posed.keep_draft()
    assert_same(posed.settled_pose, replace(POSE, angles_deg={"theta1": 40.0, "theta2": 70.0}))
    posed.drag_body("link2", (10.0, 20.0, 30.0))
    posed.keep_draft()
    assert posed.settled_pose is not None
    assert posed.settled_pose.position_um == pytest.approx((3010.0, 4020.0, 2030.0))
    posed.undo_stack.undo()
    posed.undo_stack.undo()
    assert_same(posed.settled_pose, POSE, at_um=1e-2, at_axis=1e-5)


def test_a_drop_takes_the_whole_drag_back(posed: Session) -> None:
    before = posed.document
    posed.drag_handle("swing", (0.0, 0.0, 0.0))
    posed.drop_preview()
    assert posed.document is before
    assert_same(posed.tool_pose, POSE)


def test_undo_in_the_middle_of_a_drag_drops_it(posed: Session) -> None:
    posed.drag_handle("swing", (0.0, 0.0, 0.0))
    posed.undo_stack.undo()
    assert posed.view.draft is None
    assert posed.document.positions_um == {}  # type: ignore[union-attr]
    posed.keep_draft()
    assert posed.document.positions_um == {}  # type: ignore[union-attr]


def test_a_straight_tool_keeps_the_roll_in_which_a_person_left_it(session: Session) -> None:
    session.set_mode("pose")
    session.pose_tool(STRAIGHT)
    assert session.settled_pose == STRAIGHT
    session.nudge(0, 5)
    session.undo_stack.undo()
    # The keypoints hardly hold it, so that the fit from there may turn it a little.
    assert_same(session.settled_pose, STRAIGHT, at_um=1e-2, at_axis=0.02)


def test_a_keypoint_that_is_moved_by_itself_makes_the_fit_count_again(posed: Session) -> None:
    assert posed.settled_pose is POSE
    posed.set_mode("place")
    posed.activate("k5")
    posed.nudge(0, 20)
    assert posed.settled_pose is not POSE
    assert posed.tool_fit is not None
    assert posed.settled_pose == posed.tool_fit.pose
    posed.undo_stack.undo()
    assert posed.settled_pose is POSE


def test_keys_move_turn_and_bend_within_limits(posed: Session) -> None:
    steps = posed.undo_stack.count
    posed.nudge(0, 2)
    assert posed.tool_pose.position_um == pytest.approx((3031.8, 4000.0, 2000.0))  # type: ignore[union-attr]
    posed.turn(0, 10.0)
    posed.bend(0, -10.0)
    posed.bend(1, 80.0)
    pose = posed.tool_pose
    assert pose is not None
    expected = ToolPose(
        (3031.8, 4000.0, 2000.0), from_yaw_pitch_roll(20.0, 10.0, 40.0), {"theta1": 30.0, "theta2": 90.0}
    )
    assert_same(pose, expected)
    assert posed.undo_stack.count == steps + 4
    posed.bend(1, 1.0)
    assert posed.undo_stack.count == steps + 4, "it stands at its limit already"
    posed.bend(2, 1.0)
    assert posed.undo_stack.count == steps + 4, "there is no third joint"


def test_bending_outside_pose_mode_says_how(session: Session, messages: list[str]) -> None:
    session.bend(0, 1.0)
    assert "In pose mode (B)" in messages[-1]


def test_sliders_preview_an_angle_and_keep_the_others(posed: Session) -> None:
    posed.preview_angle("theta1", -20.0)
    posed.preview_angle("theta2", 50.0)
    assert posed.tool_pose is not None
    assert posed.tool_pose.angles_deg == {"theta1": -20.0, "theta2": 50.0}
    steps = posed.undo_stack.count
    posed.keep_draft()
    assert posed.undo_stack.count == steps + 1


def test_clicks_place_nothing(posed: Session, messages: list[str]) -> None:
    before = posed.document
    posed.place((1.0, 2.0, 3.0))
    assert "clicks place nothing" in messages[-1]
    posed.pick_ray(Ray((300.0, 400.0, -5000.0), (0.0, 0.0, 1.0)))
    assert posed.document is before
    assert posed.view.preview is None


@pytest.mark.parametrize(
    "change",
    [
        lambda session: session.drag_handle("move:link0", (0.0, 0.0, 0.0)),
        lambda session: session.drag_body("link0", (1.0, 1.0, 1.0)),
        lambda session: session.nudge(0, 1),
        lambda session: session.turn(0, 1.0),
        lambda session: session.bend(0, 1.0),
    ],
)
def test_a_locked_keypoint_holds_the_whole_tool(
    posed: Session, messages: list[str], change: Callable[[Session], None]
) -> None:
    posed.set_locked("k3", True)
    before = posed.document
    change(posed)
    assert "k3 is locked" in messages[-1]
    assert "Unlock it to move the tool as a whole" in messages[-1]
    assert posed.document is before
    assert posed.view.draft is None


@pytest.mark.parametrize("handle", ["center", "bend:theta3", ""])
def test_a_handle_that_is_not_shown_is_not_dragged(posed: Session, handle: str) -> None:
    posed.drag_handle(handle, (0.0, 0.0, 0.0))
    assert posed.view.draft is None


def test_boxes_follow_and_keep_the_cross_section_that_was_measured(boxes_session: Session) -> None:
    session = boxes_session
    session.free_cross_section("link1", True)
    session.type_box("link1", Box((0.0, 0.0, 0.0), (5000.0, 3900.0, 3800.0), (1.0, 0.0, 0.0, 0.0)))
    session.set_mode("pose")
    session.pose_tool(POSE)
    assert session.document is not None
    assert session.tool is not None
    boxes = session.document.placed_boxes
    for link, box in link_boxes(POSE, session.tool).items():
        assert boxes[link].center_um == pytest.approx(box.center_um)
        np.testing.assert_allclose(boxes[link].axes, box.axes, atol=1e-9)
    assert boxes["link1"].size_um == (5000.0, 3900.0, 3800.0)
    assert session.settled_pose is POSE
    assert session.document.keypoints == ()
    # Of the same body in another roll the keypoints agree, the boxes do not.
    session.set_mode("place")
    session.activate("link0")
    session.turn_over()
    assert session.settled_pose is not POSE


# From the fit


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


# Against the volume


class Refiner:
    """Stands in for the polishing against the volume, and ends when the test lets it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.result: Refinement | Exception = refinement_of(
            replace(POSE, position_um=(3100.0, 4000.0, 2000.0))
        )
        self.poses: list[ToolPose] = []
        self.go_on = threading.Event()
        monkeypatch.setattr(refine, "refine_pose", self._refine)

    def _refine(self, *arguments: Any, progress: Any, cancelled: Callable[[], bool]) -> Refinement:
        self.poses.append(arguments[3])
        while not self.go_on.wait(0.01):
            if cancelled():
                raise Cancelled
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


@pytest.fixture
def refiner(monkeypatch: pytest.MonkeyPatch) -> Refiner:
    return Refiner(monkeypatch)


def test_a_refinement_is_a_proposal_that_is_accepted_as_one_edit(
    qtbot: QtBot, posed: Session, refiner: Refiner, messages: list[str]
) -> None:
    before, steps = posed.document, posed.undo_stack.count
    posed.refine()
    assert posed.is_refining
    refiner.go_on.set()
    qtbot.waitUntil(lambda: posed.view.refinement is not None)
    assert not posed.is_refining
    assert refiner.poses == [POSE]
    assert posed.document is before
    assert "Return accepts" in messages[-1]
    assert posed.refinement_moves_um() == pytest.approx(dict.fromkeys((f"k{n}" for n in range(6)), 100.0))
    assert [solid.kind for solid in posed.solids()].count("proposal") == 3
    posed.accept_refinement()
    assert posed.view.refinement is None
    assert posed.undo_stack.count == steps + 1
    assert {part.source for part in posed.document.parts} == {"refined"}  # type: ignore[union-attr]
    assert posed.settled_pose is refiner.result.pose  # type: ignore[union-attr]
    posed.undo_stack.undo()
    assert posed.document == before


def test_a_refinement_is_rejected_or_dropped_by_another_edit(
    qtbot: QtBot, posed: Session, refiner: Refiner
) -> None:
    refiner.go_on.set()
    before = posed.document
    for give_up in (posed.reject_refinement, posed.drop_preview, lambda: posed.set_locked("k0", True)):
        posed.refine()
        qtbot.waitUntil(lambda: posed.view.refinement is not None)
        give_up()
        assert posed.view.refinement is None
        assert posed.refinement_moves_um() == {}
        posed.accept_refinement()
    assert posed.document.positions_um == before.positions_um  # type: ignore[union-attr]


def test_what_is_refined_of_an_older_document_is_not_proposed(
    qtbot: QtBot, posed: Session, refiner: Refiner, messages: list[str]
) -> None:
    posed.refine()
    posed.nudge(0, 1)
    refiner.go_on.set()
    qtbot.waitUntil(lambda: not posed.is_refining)
    assert posed.view.refinement is None
    assert "refine again" in messages[-1]


def test_a_second_refinement_takes_the_place_of_the_first(
    qtbot: QtBot, posed: Session, refiner: Refiner
) -> None:
    posed.refine()
    qtbot.waitUntil(lambda: len(refiner.poses) == 1)
    posed.refine()
    qtbot.waitUntil(lambda: len(refiner.poses) == 2)
    qtbot.waitUntil(lambda: sum(job.title.startswith("Refining") for job in posed.jobs.running) == 1)
    assert posed.is_refining, "the end of the first is not that of the second"
    refiner.go_on.set()
    qtbot.waitUntil(lambda: posed.view.refinement is not None)
    assert not posed.is_refining


def test_a_refinement_is_cancelled_by_a_person_and_by_closing(
    qtbot: QtBot, posed: Session, refiner: Refiner
) -> None:
    posed.refine()
    (job,) = (job for job in posed.jobs.running if job.title.startswith("Refining"))
    posed.jobs.cancel(job)
    qtbot.waitUntil(lambda: not posed.is_refining)
    posed.refine()
    posed.abandon()
    assert not posed.is_refining
    qtbot.waitUntil(lambda: not posed.jobs.running)
    assert posed.view.refinement is None


def test_a_refinement_that_fails_says_why(
    qtbot: QtBot, posed: Session, refiner: Refiner, messages: list[str]
) -> None:
    refiner.result = UserError("the volume shows nothing of the tool", remedy="Bring it nearer")
    refiner.go_on.set()
    posed.refine()
    qtbot.waitUntil(lambda: not posed.is_refining)
    assert "shows nothing of the tool" in messages[-1]


def test_nothing_is_refined_where_nothing_is_placed(
    session: Session, refiner: Refiner, messages: list[str]
) -> None:
    session.refine()
    assert "Place keypoints or boxes first" in messages[-1]
    session.set_mode("pose")
    session.refine()
    assert not session.is_refining
