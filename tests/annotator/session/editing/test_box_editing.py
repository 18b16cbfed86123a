"""Boxes in the session: two clicks place one, and each gesture, key and number is one edit."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.geometry.boxes import Box
from annotations.volumes import write_sidecar
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.session.editing.placed_boxes import BASE_UM, TIP_UM, box_of, place_two


@pytest.fixture
def placed(boxes_session: Session) -> Session:
    """A session in place mode, with the box of link 0 placed and active."""
    boxes_session.set_mode("place")
    place_two(boxes_session)
    boxes_session.activate("link0")
    return boxes_session


def test_two_clicks_place_a_box_as_one_edit(boxes_session: Session, box_messages: list[str]) -> None:
    session = boxes_session
    assert session.view.active_part == "link0"
    session.place(BASE_UM)
    assert session.view.first_end_um == BASE_UM
    assert session.undo_stack.count == 0
    assert "other end of link0" in box_messages[-1]
    session.place(TIP_UM)
    box = box_of(session)
    assert box.base_um == pytest.approx(BASE_UM)
    assert box.tip_um == pytest.approx(TIP_UM)
    assert box.size_um == pytest.approx((500.0, 4000.0, 4000.0))
    assert session.document.part("link0").source == "clicked"  # type: ignore[union-attr]
    assert session.view.active_part == "link1"
    assert session.view.first_end_um is None
    assert box_messages[-1] == (
        "Two clicks do not tell the roll of link0: once all boxes are placed the check proposes it; "
        "or press 1 and turn it with X"
    )
    assert session.undo_stack.count == 1
    session.undo_stack.undo()
    assert session.document.placed_boxes == {}  # type: ignore[union-attr]


def test_of_the_last_box_it_is_said_how_to_turn_it_as_it_stays_active(
    boxes_session: Session, box_messages: list[str]
) -> None:
    for _ in range(3):
        place_two(boxes_session)
    assert boxes_session.view.active_part == "link2"
    assert box_messages[-1].endswith("or turn it with X or its knob")


def test_the_second_end_is_shown_before_it_is_clicked(boxes_session: Session) -> None:
    session = boxes_session
    before = session.document
    session.aim_second_end(TIP_UM)
    assert session.view.draft is None, "there is no first end yet"
    session.place(BASE_UM)
    session.aim_second_end(TIP_UM)
    assert session.shown_document is not None
    assert session.shown_document.placed_boxes["link0"].tip_um == pytest.approx(TIP_UM)
    assert session.active_box() == session.shown_document.placed_boxes["link0"]
    assert session.document is before
    session.aim_second_end(BASE_UM)
    assert session.shown_document.placed_boxes["link0"].tip_um == pytest.approx(TIP_UM)
    session.drop_preview()
    assert session.view.first_end_um is None
    assert session.shown_document is before


def test_what_is_aimed_at_can_be_kept_and_goes_on_to_the_next_link(boxes_session: Session) -> None:
    boxes_session.place(BASE_UM)
    boxes_session.aim_second_end(TIP_UM)
    boxes_session.keep_draft()
    assert box_of(boxes_session).tip_um == pytest.approx(TIP_UM)
    assert boxes_session.view.first_end_um is None
    assert boxes_session.view.active_part == "link1"
    assert boxes_session.undo_stack.count == 1


def test_a_second_click_at_the_first_place_is_refused(
    boxes_session: Session, box_messages: list[str]
) -> None:
    place_two(boxes_session, BASE_UM, BASE_UM)
    assert "Both ends are at one place" in box_messages[-1]
    assert boxes_session.view.first_end_um == BASE_UM
    assert boxes_session.undo_stack.count == 0


def test_a_first_click_is_forgotten_once_the_box_is_there_another_way(boxes_session: Session) -> None:
    place_two(boxes_session)
    boxes_session.undo_stack.undo()
    boxes_session.activate("link0")
    boxes_session.place(BASE_UM)
    boxes_session.set_certainty("link2", "unsure")
    assert boxes_session.view.first_end_um == BASE_UM
    boxes_session.undo_stack.undo()
    boxes_session.undo_stack.redo()
    boxes_session.type_box("link0", Box((1.0, 2.0, 3.0), (500.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0)))
    assert boxes_session.view.first_end_um is None
    assert boxes_session.view.draft is None


def test_choosing_another_link_gives_the_first_click_up(boxes_session: Session) -> None:
    boxes_session.place(BASE_UM)
    boxes_session.activate("link1")
    assert boxes_session.view.first_end_um is None


@pytest.mark.parametrize("depth_axis", [0, 2])
def test_a_first_box_lies_with_its_height_along_the_light(
    qtbot: QtBot, options: SessionOptions, volume_path: Path, depth_axis: int
) -> None:
    write_sidecar(volume_path, (15.9, 13.5, 9.4), depth_axis)  # type: ignore[arg-type]
    session = Session(replace(options, method="boxes"))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    assert session.volume is not None
    assert session.volume.depth_axis == depth_axis
    across = (100.0, 500.0, 700.0) if depth_axis == 0 else TIP_UM
    place_two(session, BASE_UM, across)
    np.testing.assert_allclose(box_of(session).axes[:, 2], np.eye(3)[depth_axis], atol=1e-12)
    # Along the light no height can be across it: any hinge is as good.
    session.activate("link1")
    along = tuple(np.add(BASE_UM, 300 * np.eye(3)[depth_axis]))
    session.clear("link0")
    session.activate("link0")
    place_two(session, BASE_UM, along)
    np.testing.assert_allclose(box_of(session).axes[:, 0], np.eye(3)[depth_axis], atol=1e-12)
    session.shut_down()


def test_a_childs_box_carries_its_parents_hinge_on(placed: Session) -> None:
    placed.turn(0, 25.0)
    placed.activate("link1")
    hinge = box_of(placed).axes[:, 1]
    # A tip that the joint can reach: in the plane across the hinge.
    reached_um = np.add(TIP_UM, 300 * np.cross(hinge, (0.3, 0.1, 0.9)))
    place_two(placed, TIP_UM, tuple(reached_um))
    np.testing.assert_allclose(box_of(placed, "link1").axes[:, 1], hinge, atol=1e-9)


def test_a_placed_box_is_not_clicked_anew(placed: Session, box_messages: list[str]) -> None:
    before = placed.document
    placed.place((1.0, 2.0, 3.0))
    assert "drag its handles, or clear it" in box_messages[-1]
    assert placed.document is before


def test_without_an_active_link_a_click_says_what_to_choose(
    boxes_session: Session, box_messages: list[str]
) -> None:
    boxes_session.activate(None)
    boxes_session.place(BASE_UM)
    assert "Choose a link first" in box_messages[-1]


def test_a_drag_is_shown_and_kept_as_one_edit(placed: Session) -> None:
    before, steps = placed.document, placed.undo_stack.count
    for x_um in (510.0, 520.0, 600.0):
        placed.drag_handle("tip", (x_um, 500.0, 300.0))
    assert placed.document is before
    assert placed.shown_positions_um()["k1"] == pytest.approx((600.0, 500.0, 300.0))
    placed.keep_draft()
    assert placed.undo_stack.count == steps + 1
    assert placed.undo_stack.undo_text == "Resize link0"
    assert box_of(placed).tip_um == pytest.approx((600.0, 500.0, 300.0))
    assert box_of(placed).base_um == pytest.approx(BASE_UM)
    assert placed.document.part("link0").source == "dragged"  # type: ignore[union-attr]
    assert placed.view.draft is None
    placed.undo_stack.undo()
    assert placed.document == before


@pytest.mark.parametrize("text", ["Move", "Turn", "Resize"])
def test_the_menu_says_what_a_drag_did(placed: Session, text: str) -> None:
    handle = {"Move": "center", "Turn": "swing", "Resize": "base"}[text]
    placed.drag_handle(handle, (0.0, 0.0, 0.0))
    placed.keep_draft()
    assert placed.undo_stack.undo_text == f"{text} link0"


def test_a_drag_that_is_dropped_or_kept_where_nothing_is_on_its_way_changes_nothing(placed: Session) -> None:
    before = placed.document
    placed.drag_handle("center", (0.0, 0.0, 0.0))
    placed.drop_preview()
    placed.keep_draft()
    assert placed.document is before
    assert placed.shown_document is before


def test_undo_in_the_middle_of_a_drag_drops_it(placed: Session) -> None:
    placed.nudge(0, 1)
    placed.drag_handle("center", (0.0, 0.0, 0.0))
    placed.undo_stack.undo()
    assert placed.view.draft is None
    assert box_of(placed).base_um == pytest.approx(BASE_UM)
    placed.keep_draft()
    assert box_of(placed).base_um == pytest.approx(BASE_UM)


def test_a_body_is_dragged_by_the_whole_way_since_the_press(placed: Session) -> None:
    placed.drag_body("link0", (10.0, 0.0, 0.0))
    placed.drag_body("link0", (30.0, -5.0, 0.0))
    placed.keep_draft()
    assert box_of(placed).base_um == pytest.approx((130.0, 195.0, 300.0))


@pytest.mark.parametrize("mode", ["navigate", "pose"])
def test_a_handle_that_is_not_shown_is_not_dragged(placed: Session, mode: str) -> None:
    placed.drag_handle("+y", (0.0, 0.0, 0.0))
    assert placed.view.draft is None, "the cross-section is not free"
    placed.set_mode(mode)  # type: ignore[arg-type]
    placed.drag_handle("center", (0.0, 0.0, 0.0))
    assert placed.view.draft is None


def test_navigating_moves_no_body(placed: Session) -> None:
    placed.set_mode("navigate")
    placed.drag_body("link0", (10.0, 0.0, 0.0))
    assert placed.view.draft is None


@pytest.mark.parametrize(
    "change",
    [
        lambda session: session.drag_handle("center", (0.0, 0.0, 0.0)),
        lambda session: session.drag_body("link0", (1.0, 1.0, 1.0)),
        lambda session: session.nudge(0, 1),
        lambda session: session.turn(0, 1.0),
        lambda session: session.move_face(0, 1, leading=True),
        lambda session: session.turn_over(),
        lambda session: session.type_box("link0", box_of(session).turned_over),
        lambda session: session.place((1.0, 1.0, 1.0)),
        lambda session: session.clear("link0"),
        lambda session: session.set_state("link0", "occluded"),
    ],
)
def test_a_locked_box_refuses_every_change(
    placed: Session, box_messages: list[str], change: Callable[[Session], None]
) -> None:
    placed.set_locked("link0", True)
    before = placed.document
    change(placed)
    assert box_messages[-1].startswith("The box of link0 is locked")
    assert placed.document is before
    assert placed.view.draft is None
    assert placed.handles() == ()


def test_keys_move_turn_and_turn_over(placed: Session) -> None:
    placed.nudge(1, -10)
    assert box_of(placed).base_um == pytest.approx((100.0, 65.0, 300.0))
    axes = box_of(placed).axes
    placed.turn(0, 90.0)
    np.testing.assert_allclose(box_of(placed).axes[:, 1], axes[:, 2], atol=1e-12)
    placed.turn(0, -90.0)
    placed.turn_over()
    np.testing.assert_allclose(box_of(placed).axes[:, 1], -axes[:, 1], atol=1e-12)
    np.testing.assert_allclose(box_of(placed).axes[:, 0], axes[:, 0], atol=1e-12)
    assert placed.document.part("link0").source == "nudged"  # type: ignore[union-attr]
    assert placed.undo_stack.count == 5


@pytest.mark.parametrize(("voxels", "end"), [(2, "tip"), (-2, "base")])
def test_a_face_grows_along_the_arrow_and_the_opposite_one_shrinks_along_it(
    boxes_session: Session, voxels: int, end: str
) -> None:
    session = boxes_session
    session.set_mode("place")
    place_two(session, (100.0, 200.0, 300.0), (600.0, 200.0, 300.0))
    session.activate("link0")
    ends = {"base": 100.0, "tip": 600.0}
    other = {"base": "tip", "tip": "base"}[end]
    session.move_face(0, voxels, leading=True)
    ends[end] += voxels * 15.9
    session.move_face(0, voxels, leading=False)
    ends[other] += voxels * 15.9
    assert (box_of(session).base_um[0], box_of(session).tip_um[0]) == pytest.approx(
        (ends["base"], ends["tip"])
    )
    assert box_of(session).size_um == pytest.approx((500.0, 4000.0, 4000.0))


def test_the_cross_section_is_fixed_until_it_is_freed(placed: Session, box_messages: list[str]) -> None:
    before = placed.document
    wider = replace(box_of(placed), size_um=(500.0, 4100.0, 4000.0))
    placed.move_face(2, 1, leading=True)
    assert box_messages[-1] == "The cross-section of link0 is fixed: press C to free it"
    placed.type_box("link0", wider)
    assert "cross-section of link0 is fixed" in box_messages[-1]
    assert placed.document is before
    assert len(placed.handles()) == 5
    placed.free_cross_section("link0", True)
    assert len(placed.handles()) == 9
    placed.type_box("link0", wider)
    assert box_of(placed) == wider
    placed.move_face(2, 3, leading=True)
    assert box_of(placed).size_um == pytest.approx((500.0, 4100.0, 4000.0 + 3 * 9.4))
    placed.free_cross_section("link0", False)
    # What was measured stays, and is the cross-section that is fixed now.
    placed.nudge(0, 1)
    assert box_of(placed).size_um[1] == 4100.0


def test_a_reversed_box_is_turned_end_for_end_and_its_hinge_stays(placed: Session) -> None:
    before, steps = box_of(placed), placed.undo_stack.count
    placed.activate("link1")
    placed.reverse("link0")
    assert placed.undo_stack.count == steps + 1
    assert box_of(placed).base_um == pytest.approx(before.tip_um)
    assert box_of(placed).tip_um == pytest.approx(before.base_um)
    np.testing.assert_allclose(box_of(placed).axes[:, 1], before.axes[:, 1], atol=1e-12)
    placed.reverse("link2")
    assert placed.undo_stack.count == steps + 1, "there is no box to be reversed"


def test_typing_gives_an_unplaced_link_a_box(boxes_session: Session) -> None:
    box = Box((1.0, 2.0, 3.0), (5000.0, 4000.0, 4000.0), (0.5, 0.5, 0.5, 0.5))
    boxes_session.type_box("link1", box)
    assert box_of(boxes_session, "link1") == box
    part = boxes_session.document.part("link1")  # type: ignore[union-attr]
    assert (part.state, part.source) == ("placed", "typed")
    with_nothing_changed = boxes_session.undo_stack.count
    boxes_session.type_box("link1", box)
    assert boxes_session.undo_stack.count == with_nothing_changed


@pytest.mark.parametrize(
    "change",
    [
        lambda session: session.nudge(0, 1),
        lambda session: session.turn(0, 1.0),
        lambda session: session.turn_over(),
        lambda session: session.move_face(0, 1, leading=True),
    ],
)
def test_keys_say_so_where_no_box_is_placed(
    boxes_session: Session, box_messages: list[str], change: Callable[[Session], None]
) -> None:
    change(boxes_session)
    assert box_messages[-1] == "link0 has no box yet: place it first, or choose one that is placed"
    boxes_session.activate(None)
    change(boxes_session)
    assert "Choose a box that is placed first" in box_messages[-1]
    assert boxes_session.undo_stack.count == 0


def test_keypoints_of_boxes_are_no_parts_of_the_document(placed: Session, box_messages: list[str]) -> None:
    before = placed.document
    placed.begin_preview("k0", (1.0, 1.0, 1.0), "dragged")
    assert "drag the handles" in box_messages[-1]
    placed.type_position("k0", (1.0, 1.0, 1.0))
    assert "no box 'k0'" in box_messages[-1]
    placed.snap("edge")
    assert "boxes do not snap" in box_messages[-1]
    assert placed.document is before
    assert placed.view.preview is None


def test_the_name_of_a_keypoint_chooses_the_box_that_it_ends(placed: Session) -> None:
    placed.activate("k3", jump=True)
    assert placed.view.active_part == "link1"
    placed.activate("k1", jump=True)
    assert placed.view.active_part == "link0"
    assert placed.view.crosshair_um == pytest.approx(TIP_UM)
    placed.activate("link0", jump=True)
    assert placed.view.crosshair_um == pytest.approx((300.0, 350.0, 300.0))
    placed.activate_next_unplaced()
    assert placed.view.active_part == "link1"


def test_boxes_are_judged_like_keypoints(placed: Session) -> None:
    placed.set_state("link0", "occluded")
    placed.set_certainty("link0", "unsure")
    part = placed.document.part("link0")  # type: ignore[union-attr]
    assert (part.state, part.certainty) == ("occluded", "unsure")
    placed.clear("link0")
    assert placed.document.placed_boxes == {}  # type: ignore[union-attr]
    assert placed.handles() == ()


def test_all_placed_is_said_in_words_of_the_method(boxes_session: Session, box_messages: list[str]) -> None:
    for link in ("link0", "link1", "link2"):
        section_um = boxes_session.tool.link(link).cross_section_um  # type: ignore[union-attr]
        boxes_session.type_box(link, Box((1.0, 2.0, 3.0), (500.0, *section_um), (1.0, 0.0, 0.0, 0.0)))
    boxes_session.activate_next_unplaced()
    assert box_messages[-1] == "All boxes are placed"
