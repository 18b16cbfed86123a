"""Boxes placed, moved, turned and resized with the mouse on slices, on real views and a real session."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from annotations.documents.annotation import BoxAnnotation
from annotations.geometry.boxes import Box
from annotator.session import Session
from annotator.slices.slice_view import SliceView
from tests.annotator.status_line import messages_of

Views = tuple[SliceView, SliceView, SliceView]
WAY = QPoint(22, -13)
NO_MODIFIER = Qt.KeyboardModifier.NoModifier


def box_of(session: Session, link: str = "link0") -> Box:
    assert session.document is not None
    return session.document.placed_boxes[link]


def part_of(session: Session, link: str) -> BoxAnnotation:
    assert session.document is not None
    (part,) = (box for box in session.document.boxes if box.link == link)
    return part


def assert_one_step(session: Session, edits: int, before: object) -> None:
    """Say that one edit was made, and that undoing and redoing it is exact."""
    after = session.document
    assert after != before
    assert session.undo_stack.count == edits + 1
    session.undo_stack.undo()
    assert session.document == before
    session.undo_stack.redo()
    assert session.document == after


@pytest.fixture
def messages(unboxed: Session) -> list[str]:
    return messages_of(unboxed)


# Placing


@pytest.mark.parametrize("axis", range(3))
def test_two_clicks_place_a_box_with_the_cross_section_of_the_tool(
    unboxed: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    view, base, tip = roomy_views[axis], QPoint(170, 130), QPoint(240, 165)
    base_um, tip_um = hand.position_um(view, base), hand.position_um(view, tip)
    before = unboxed.document

    hand.click(view, base)

    assert unboxed.document is before
    assert unboxed.view.first_end_um == pytest.approx(base_um)
    assert unboxed.view.active_part == "link0"

    hand.click(view, tip)

    box = box_of(unboxed)
    assert box.base_um == pytest.approx(base_um)
    assert box.tip_um == pytest.approx(tip_um)
    assert box.size_um[1:] == (4000.0, 4000.0)
    assert part_of(unboxed, "link0").source == "clicked"
    assert unboxed.view.active_part == "link1"
    assert unboxed.view.first_end_um is None
    assert_one_step(unboxed, 0, before)


def test_the_ends_may_be_clicked_in_different_slices(unboxed: Session, roomy_views: Views, hand: Any) -> None:
    base_um = hand.position_um(roomy_views[2], QPoint(190, 100))
    hand.click(roomy_views[2], QPoint(190, 100))
    tip_um = hand.position_um(roomy_views[0], QPoint(240, 140))
    hand.click(roomy_views[0], QPoint(240, 140))

    assert box_of(unboxed).base_um == pytest.approx(base_um)
    assert box_of(unboxed).tip_um == pytest.approx(tip_um)


@pytest.mark.parametrize("axis", range(3))
def test_between_the_clicks_the_box_follows_the_mouse(
    unboxed: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    view, before = roomy_views[axis], unboxed.document
    hand.move(view, QPoint(150, 150))
    assert unboxed.view.draft is None, "nothing has been clicked yet"
    hand.click(view, QPoint(170, 130))
    for at in (QPoint(230, 160), QPoint(250, 140)):
        tip_um = hand.position_um(view, at)

        hand.move(view, at)

        assert unboxed.shown_document is not None
        assert unboxed.shown_document.placed_boxes["link0"].tip_um == pytest.approx(tip_um)
    assert unboxed.document is before
    assert view.handle_under(250, 140, 300) is None, "there is no box yet that could be changed"

    unboxed.drop_preview()
    hand.move(view, QPoint(255, 145))

    assert unboxed.view.draft is None
    assert unboxed.document is before
    assert unboxed.undo_stack.count == 0


def test_scrolling_takes_the_second_end_along(unboxed: Session, roomy_views: Views, hand: Any) -> None:
    view = roomy_views[0]
    hand.click(view, QPoint(170, 130))
    hand.move(view, QPoint(230, 160))

    hand.wheel(view, -120, QPoint(230, 160))

    assert unboxed.shown_document is not None
    tip_um = unboxed.shown_document.placed_boxes["link0"].tip_um
    assert tip_um == pytest.approx(hand.position_um(view, QPoint(230, 160)))


def test_a_click_within_another_box_places_while_the_active_one_waits(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    """The base of a link lies half a millimetre from the tip of the one before, mostly inside its box."""
    boxed.clear("link1")
    boxed.activate("link1")
    boxed.look(crosshair_um=box_of(boxed).center_um)
    at = hand.pixel(roomy_views[2], box_of(boxed).center_um)

    hand.click(roomy_views[2], at)

    assert boxed.view.active_part == "link1"
    assert boxed.view.first_end_um == pytest.approx(hand.position_um(roomy_views[2], at))


def test_one_spot_clicked_twice_is_no_box(
    unboxed: Session, roomy_views: Views, hand: Any, messages: list[str]
) -> None:
    before = unboxed.document

    hand.click(roomy_views[0], QPoint(200, 150))
    hand.click(roomy_views[0], QPoint(200, 150))

    assert unboxed.document is before
    assert unboxed.view.first_end_um is not None
    assert "one place" in messages[-1]


# Handles


@pytest.mark.parametrize("axis", range(3))
def test_the_handle_at_the_centre_moves_the_box_within_the_plane(
    boxed: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    view, before, was, edits = roomy_views[axis], boxed.document, box_of(boxed), boxed.undo_stack.count
    start = hand.handle(boxed, view, "center")

    hand.drag(view, start, start + QPoint(5, 5), start + WAY, release=False)

    assert boxed.document is before
    assert boxed.view.draft is not None
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + WAY)
    assert boxed.view.draft is None
    box = box_of(boxed)
    moved_um = np.subtract(box.center_um, was.center_um)
    assert moved_um == pytest.approx(hand.way_um(view, WAY), abs=1e-6)
    assert (box.size_um, box.rotation_wxyz) == (was.size_um, was.rotation_wxyz)
    assert part_of(boxed, "link0").source == "dragged"
    assert_one_step(boxed, edits, before)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("end", ["base", "tip"])
def test_the_handle_at_an_end_moves_it_and_the_other_stays(
    boxed: Session, roomy_views: Views, hand: Any, axis: int, end: str
) -> None:
    view, before, was, edits = roomy_views[axis], boxed.document, box_of(boxed), boxed.undo_stack.count
    start = hand.handle(boxed, view, end)

    hand.drag(view, start, start + WAY)

    box = box_of(boxed)
    moved, stayed = (box.base_um, box.tip_um) if end == "base" else (box.tip_um, box.base_um)
    began, fixed = (was.base_um, was.tip_um) if end == "base" else (was.tip_um, was.base_um)
    assert np.subtract(moved, began) == pytest.approx(hand.way_um(view, WAY), abs=1e-6)
    assert stayed == pytest.approx(fixed)
    assert box.size_um[1:] == was.size_um[1:]
    assert_one_step(boxed, edits, before)


@pytest.mark.parametrize("axis", [0, 2])
def test_the_knob_beyond_the_tip_turns_the_box_about_its_centre(
    boxed: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    view, before, was, edits = roomy_views[axis], boxed.document, box_of(boxed), boxed.undo_stack.count
    start = hand.handle(boxed, view, "swing")
    way_um = np.array(hand.way_um(view, WAY))

    hand.drag(view, start, start + WAY)

    box = box_of(boxed)
    assert box.center_um == pytest.approx(was.center_um)
    assert box.size_um == was.size_um
    turned = box.axes[:, 0] - was.axes[:, 0]
    assert turned @ way_um > 0, "the axis follows the hand"
    assert np.degrees(np.arccos(box.axes[:, 0] @ was.axes[:, 0])) > 5
    assert_one_step(boxed, edits, before)


def test_the_knob_at_the_side_rolls_the_box_in_a_slice_across_it(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    view, before, was, edits = roomy_views[1], boxed.document, box_of(boxed), boxed.undo_stack.count
    start = hand.handle(boxed, view, "roll")
    aside = hand.pixel(view, was.position_um((0.0, 0.7, 0.0)))

    hand.drag(view, start, (start + aside) / 2, aside)

    box = box_of(boxed)
    assert box.axes[:, 0] == pytest.approx(was.axes[:, 0])
    assert box.center_um == pytest.approx(was.center_um)
    assert box.axes[:, 2] @ was.axes[:, 1] == pytest.approx(-1, abs=0.1), "the knob stands off −z"
    assert_one_step(boxed, edits, before)


def test_faces_have_handles_only_where_the_cross_section_is_free(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    assert not {handle.name for handle in boxed.handles()} & {"+y", "-y", "+z", "-z"}
    boxed.free_cross_section("link0", True)
    view, before, was, edits = roomy_views[1], boxed.document, box_of(boxed), boxed.undo_stack.count
    start = hand.handle(boxed, view, "+y")
    fixed_um = was.position_um((0.0, -0.5, 0.0))
    outwards = hand.pixel(view, was.position_um((0.0, 0.9, 0.0))) - hand.pixel(
        view, was.position_um((0.0, 0.5, 0.0))
    )

    hand.drag(view, start, start + outwards)

    box = box_of(boxed)
    assert box.size_um[1] == pytest.approx(1.4 * was.size_um[1], abs=150), "a pixel is about 70 µm"
    assert (box.size_um[0], box.size_um[2]) == (was.size_um[0], was.size_um[2])
    assert box.position_um((0.0, -0.5, 0.0)) == pytest.approx(fixed_um)
    assert_one_step(boxed, edits, before)


# Bodies


def inside(box: Box, along: float = 0.25) -> tuple[float, float, float]:
    """A place in a box away from its handles, and away from the boxes beside it."""
    return box.position_um((along, 0.2, 0.2))


@pytest.mark.parametrize("axis", range(3))
def test_a_press_within_the_outline_moves_the_box(
    boxed: Session, roomy_views: Views, hand: Any, axis: int
) -> None:
    view, before, was, edits = roomy_views[axis], boxed.document, box_of(boxed), boxed.undo_stack.count
    boxed.look(crosshair_um=inside(was))
    start = hand.pixel(view, inside(was))
    assert view.handle_under(start.x(), start.y(), 8) is None

    hand.drag(view, start, start + QPoint(9, 9), start + WAY)

    box = box_of(boxed)
    assert np.subtract(box.center_um, was.center_um) == pytest.approx(hand.way_um(view, WAY), abs=1e-6)
    assert box.rotation_wxyz == was.rotation_wxyz
    assert_one_step(boxed, edits, before)


def test_a_press_within_another_box_makes_it_active_and_moves_nothing(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    document = boxed.document
    boxed.look(crosshair_um=inside(box_of(boxed, "link1")))
    start = hand.pixel(roomy_views[2], inside(box_of(boxed, "link1")))

    hand.drag(roomy_views[2], start, start + WAY)

    assert boxed.view.active_part == "link1"
    assert boxed.document is document
    assert {handle.color for handle in boxed.handles()} == {"#e69f00"}


def test_the_ends_of_a_box_that_is_not_active_are_no_keypoints_to_drag(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    document = boxed.document
    tip_um = box_of(boxed, "link2").position_um((0.49, 0.0, 0.0))
    boxed.look(crosshair_um=tip_um)
    start = hand.pixel(roomy_views[2], tip_um)

    hand.drag(roomy_views[2], start, start + WAY)

    assert boxed.document is document
    assert boxed.view.preview is None
    assert boxed.view.active_part == "link2"


def test_a_press_beside_all_boxes_says_why_it_does_nothing(
    boxed: Session, roomy_views: Views, hand: Any, messages: list[str]
) -> None:
    document = boxed.document
    messages.clear()

    hand.drag(roomy_views[2], QPoint(20, 20), QPoint(60, 60))

    assert boxed.document is document
    assert messages == ["link0 has its box: drag its handles, or clear it to click it anew"]


def test_a_press_and_release_on_a_handle_changes_nothing(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    document, edits = boxed.document, boxed.undo_stack.count
    for name in ("center", "base", "tip", "swing"):
        start = hand.handle(boxed, roomy_views[2], name)
        view = boxed.view
        hand.click(roomy_views[2], start)
        hand.drag(roomy_views[2], start, start + QPoint(2, 1))
        assert boxed.view == view

    assert boxed.document is document
    assert boxed.undo_stack.count == edits


def test_a_click_on_the_body_brings_the_crosshair_there(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    document = boxed.document
    boxed.look(crosshair_um=box_of(boxed).center_um)
    at = hand.pixel(roomy_views[2], inside(box_of(boxed)))
    wanted_um = hand.position_um(roomy_views[2], at)

    hand.click(roomy_views[2], at)

    assert boxed.document is document
    assert boxed.view.crosshair_um[:2] == pytest.approx(wanted_um[:2])


# Refusing and taking back


def test_a_locked_box_does_not_move_and_says_why_once(
    boxed: Session, roomy_views: Views, hand: Any, messages: list[str]
) -> None:
    boxed.set_locked("link0", True)
    document, view = boxed.document, roomy_views[2]
    boxed.look(crosshair_um=inside(box_of(boxed)))
    start = hand.pixel(view, inside(box_of(boxed)))
    messages.clear()

    hand.move(view, start)
    assert view.cursor().shape() == Qt.CursorShape.ForbiddenCursor
    hand.drag(view, start, start + QPoint(9, 9), start + WAY)

    assert boxed.document is document
    assert boxed.view.draft is None
    assert len(messages) == 1
    assert "locked" in messages[0]
    at = hand.pixel(view, box_of(boxed).center_um)
    assert view.handle_under(at.x(), at.y(), 300) is None


@pytest.mark.parametrize("name", ["tip", ""])
def test_escape_takes_a_drag_back(boxed: Session, roomy_views: Views, hand: Any, name: str) -> None:
    view, document = roomy_views[2], boxed.document
    boxed.look(crosshair_um=inside(box_of(boxed)))
    start = hand.handle(boxed, view, name) if name else hand.pixel(view, inside(box_of(boxed)))
    hand.drag(view, start, start + WAY, release=False)
    assert boxed.view.draft is not None
    view.setFocus()

    QTest.keyClick(view, Qt.Key.Key_Escape)

    assert boxed.view.draft is None
    # The button is still down: neither moving on nor letting go brings the drag back.
    hand.move(view, start + 2 * WAY)
    assert boxed.view.draft is None
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + 2 * WAY)
    assert boxed.document is document


def test_a_draft_dropped_by_somebody_else_ends_the_drag(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    """The window's Esc action comes before the view's own key."""
    view, document = roomy_views[2], boxed.document
    start = hand.handle(boxed, view, "tip")
    hand.drag(view, start, start + WAY, release=False)

    boxed.drop_preview()
    hand.move(view, start + 2 * WAY)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start)

    assert boxed.view.draft is None
    assert boxed.document is document


def test_undoing_in_the_middle_of_a_drag_ends_it(boxed: Session, roomy_views: Views, hand: Any) -> None:
    view = roomy_views[2]
    start = hand.handle(boxed, view, "tip")
    hand.drag(view, start, start + WAY, release=False)

    boxed.undo_stack.undo()
    document = boxed.document
    hand.move(view, start + 2 * WAY)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start)

    assert boxed.view.draft is None
    assert boxed.document is document


@pytest.mark.parametrize("turn_away", ["mode", "link"])
def test_what_is_held_is_let_go_when_a_key_turns_to_something_else(
    boxed: Session, roomy_views: Views, hand: Any, turn_away: str
) -> None:
    view, document = roomy_views[2], boxed.document
    start = hand.handle(boxed, view, "tip")
    QTest.mousePress(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start)

    if turn_away == "mode":
        boxed.set_mode("navigate")
    else:
        boxed.activate("link1")
    hand.move(view, start + WAY)
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start + WAY)

    assert boxed.document is document


def test_navigating_never_moves_a_box(boxed: Session, roomy_views: Views, hand: Any) -> None:
    boxed.set_mode("navigate")
    document = boxed.document
    for view in roomy_views:
        boxed.look(crosshair_um=box_of(boxed).center_um)
        start = hand.pixel(view, box_of(boxed).center_um)
        hand.click(view, start)
        hand.drag(view, start, start + WAY)

    assert boxed.document is document
    assert boxed.handles() == ()


def test_hidden_overlays_cannot_be_taken_hold_of(
    boxed: Session, roomy_views: Views, hand: Any, messages: list[str]
) -> None:
    view, document = roomy_views[2], boxed.document
    start = hand.handle(boxed, view, "center")
    assert view.handle_under(start.x(), start.y(), 8) is not None
    boxed.look(overlays_hidden=True)
    assert view.handle_under(start.x(), start.y(), 8) is None

    hand.drag(view, start, start + WAY)

    assert boxed.document is document
    assert boxed.view.draft is None


def test_the_cursor_shows_what_a_press_would_do(boxed: Session, roomy_views: Views, hand: Any) -> None:
    view = roomy_views[2]
    start = hand.handle(boxed, view, "center")
    hand.move(view, start)
    assert view.cursor().shape() == Qt.CursorShape.OpenHandCursor
    hand.drag(view, start, start + WAY, release=False)
    assert view.cursor().shape() == Qt.CursorShape.ClosedHandCursor
    boxed.drop_preview()
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, NO_MODIFIER, start)
    hand.move(view, hand.pixel(view, inside(box_of(boxed))))
    assert view.cursor().shape() == Qt.CursorShape.OpenHandCursor
    boxed.look(crosshair_um=inside(box_of(boxed, "link1")))
    hand.move(view, hand.pixel(view, inside(box_of(boxed, "link1"))))
    assert view.cursor().shape() == Qt.CursorShape.PointingHandCursor
    hand.move(view, QPoint(20, 20))
    assert view.cursor().shape() == Qt.CursorShape.ArrowCursor
    boxed.clear("link0")
    hand.move(view, QPoint(21, 20))
    assert view.cursor().shape() == Qt.CursorShape.CrossCursor


def test_a_drag_goes_on_in_micrometres_when_the_slice_is_zoomed(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    view, was = roomy_views[2], box_of(boxed)
    start = hand.handle(boxed, view, "center")
    hand.drag(view, start, start + QPoint(10, 0), release=False)
    end_um = hand.position_um(view, start + QPoint(10, 0))
    hand.wheel(view, 240, start + QPoint(10, 0), Qt.KeyboardModifier.ControlModifier)

    hand.move(view, start + QPoint(30, 0))

    assert boxed.shown_document is not None
    moved_um = np.subtract(boxed.shown_document.placed_boxes["link0"].center_um, was.center_um)
    hand_um = np.subtract(hand.position_um(view, start + QPoint(30, 0)), end_um)
    first_um = 10 / roomy_views[2].viewport.scale * 1.44  # type: ignore[union-attr]
    assert moved_um[0] == pytest.approx(hand_um[0] + first_um)
