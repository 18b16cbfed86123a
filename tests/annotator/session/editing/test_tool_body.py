"""What follows from document and view: fit, pose and handles, each worked out once."""

from dataclasses import replace

import pytest

from annotations.fitting.pose_fit import ToolFit
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotator.session import Session
from annotator.session.editing import tool_body
from annotator.session.editing.pose_handles import moved
from annotator.session.viewing.view import Mode, Preview

POSE = ToolPose((3000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 40.0, "theta2": 30.0})


@pytest.fixture
def placed(session: Session) -> Session:
    """A session with all keypoints where the tool in a pose has them."""
    assert session.tool is not None
    for name, position_um in keypoints_um(POSE, session.tool).items():
        session.place(position_um, keypoint=name)
    return session


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The documents that are fitted from now on."""
    fitted: list[object] = []
    real = tool_body.fit_document

    def count(document: object, *arguments: object, **more: object) -> ToolFit | None:
        fitted.append(document)
        return real(document, *arguments, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(tool_body, "fit_document", count)
    return fitted


def test_nothing_open_has_no_body(empty_session: Session) -> None:
    assert empty_session.tool_fit is None
    assert empty_session.tool_pose is None
    assert empty_session.settled_pose is None
    assert empty_session.handles() == ()
    assert empty_session.solids() == ()
    assert empty_session.active_box() is None


def test_each_document_is_fitted_once(placed: Session, fits: list[object]) -> None:
    placed.activate("k5")
    placed.nudge(0, 1)
    fits.clear()
    for _ in range(3):
        assert placed.tool_fit is not None
        assert placed.tool_pose is not None
        assert placed.settled_pose is not None
        assert placed.solids()
    placed.look(crosshair_um=(1.0, 2.0, 3.0))
    assert placed.tool_fit is not None
    assert len(fits) <= 1
    assert all(document is placed.document for document in fits)


def test_the_fit_follows_a_keypoint_on_its_way_and_the_settled_pose_does_not(placed: Session) -> None:
    settled = placed.settled_pose
    assert settled is not None
    assert settled.position_um == pytest.approx(POSE.position_um, abs=0.1)
    x_um, y_um, z_um = placed.shown_positions_um()["k0"]
    placed.look(preview=Preview("k0", (x_um, y_um, z_um + 500.0), "dragged"))
    assert placed.tool_fit is not None
    assert placed.tool_fit.pose.position_um[2] > settled.position_um[2] + 10
    assert placed.tool_pose is placed.tool_fit.pose
    assert placed.settled_pose is settled
    placed.drop_preview()
    assert placed.tool_pose is settled


def test_the_last_pose_counts_as_long_as_the_document_agrees(placed: Session) -> None:
    exact = replace(POSE)
    placed.look(pose=exact)
    assert placed.settled_pose is exact
    placed.clear("k5")
    assert placed.settled_pose is exact, "what is not placed cannot disagree"
    placed.look(pose=replace(POSE, position_um=(3001.0, 4000.0, 2000.0)))
    assert placed.settled_pose is not placed.view.pose


def test_a_tools_keypoint_that_ends_no_link_does_not_disagree(session: Session) -> None:
    # The tool of the open document with one more keypoint, as nine marks on a shaft have it.
    assert session.tool is not None
    tool = session.tool.model_copy(update={"links": session.tool.links[:1], "joints": ()})
    session.place((5.0, 5.0, 5.0), keypoint="k5")
    assert session.document is not None
    for name, position_um in keypoints_um(POSE, tool).items():
        session.place(position_um, keypoint=name)
    assert tool_body._agrees(session.document, POSE, tool)
    assert not tool_body._agrees(session.document, POSE, session.tool)


def test_boxes_must_agree_in_roll_too(boxes_session: Session) -> None:
    session = boxes_session
    assert session.tool is not None
    for link, box in link_boxes(POSE, session.tool).items():
        session.type_box(link, box)
    session.look(pose=POSE)
    assert session.settled_pose is POSE
    session.activate("link2")
    session.turn_over()
    assert session.settled_pose is not POSE


def test_handles_are_those_of_the_mode(boxes_session: Session) -> None:
    session = boxes_session
    session.type_box("link0", Box((0.0, 0.0, 0.0), (11_000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    session.activate("link0")
    assert session.handles() == ()
    session.set_mode("place")
    assert {handle.name for handle in session.handles()} == {"center", "base", "tip", "swing", "roll"}
    session.activate("link1")
    assert session.handles() == ()
    session.place((0.0, 0.0, 0.0))
    session.aim_second_end((100.0, 0.0, 0.0))
    assert session.handles() == (), "it waits for its second click"
    session.set_mode("pose")
    assert {handle.kind for handle in session.handles()} == {"move", "turn", "bend"}
    session.activate(None)
    session.set_mode("place")
    assert session.handles() == ()


def test_handles_follow_the_drag(boxes_session: Session) -> None:
    session = boxes_session
    session.type_box("link0", Box((0.0, 0.0, 0.0), (11_000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    session.set_mode("place")
    session.activate("link0")
    session.drag_handle("center", (70.0, 80.0, 90.0))
    assert next(handle for handle in session.handles() if handle.name == "center").position_um == (
        70.0,
        80.0,
        90.0,
    )


@pytest.mark.parametrize("mode", ["place", "pose"])
def test_views_that_draw_one_change_get_the_same_bodies_and_handles(
    boxes_session: Session, mode: Mode
) -> None:
    session = boxes_session
    session.pose_tool(POSE)
    session.set_mode(mode)
    session.activate("link1")
    first = (session.solids(), session.handles(), session.shown_positions_um())
    assert all(first)
    session.look(crosshair_um=(100.0, 200.0, 300.0))
    again = (session.solids(), session.handles(), session.shown_positions_um())
    assert all(one is other for one, other in zip(first, again, strict=True))
    session.pose_tool(moved(POSE, (100.0, 0.0, 0.0)))
    assert session.solids() != first[0]
    assert session.handles() != first[1]
    assert session.shown_positions_um() != first[2]
