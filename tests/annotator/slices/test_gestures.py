"""Placing, dragging and navigating with the mouse, on real views and a real session."""

from itertools import cycle
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from annotations.geometry.frames import Vector
from annotator.session import Session
from annotator.slices.slice_view import SliceView

Views = tuple[SliceView, SliceView, SliceView]
KEYPOINTS = ("k0", "k1", "k2", "k3", "k4", "k5")
MIDDLE_UM = (20 * 15.9, 30 * 13.5, 25 * 9.4)


def placed_um(session: Session, name: str) -> Vector:
    assert session.document is not None
    return session.document.positions_um[name]


@pytest.fixture
def placed(views: Views, session: Session) -> Session:
    """A session in place mode with k0 placed in the middle of every view, and k1 active."""
    session.set_mode("place")
    session.place(MIDDLE_UM, keypoint="k0")
    session.activate("k1")
    return session


def test_six_clicks_in_slices_across_different_axes_place_six_keypoints(
    views: Views, session: Session, hand: Any
) -> None:
    session.set_mode("place")
    session.activate("k0")
    for name, view, at in zip(
        KEYPOINTS,
        cycle(views),
        [
            QPoint(90, 100),
            QPoint(150, 90),
            QPoint(180, 60),
            QPoint(250, 200),
            QPoint(290, 110),
            QPoint(230, 240),
        ],
        strict=False,
    ):
        assert session.view.active_part == name
        wanted_um = hand.position_um(view, at)

        hand.click(view, at)

        assert placed_um(session, name) == pytest.approx(wanted_um)
        assert session.document is not None
        assert session.document.keypoint(name).source == "clicked"
        assert session.view.crosshair_um == pytest.approx(wanted_um)
        # The click was on a plane of voxels, and that is where the keypoint lies.
        index = wanted_um[view.axis] / (15.9, 13.5, 9.4)[view.axis]
        assert index == pytest.approx(round(index))
    assert session.undo_stack.count == 6


def test_a_click_beside_the_volume_places_outside(views: Views, session: Session, hand: Any) -> None:
    session.set_mode("place")
    session.activate("k0")
    at = QPoint(4, 150)

    hand.click(views[2], at)

    assert placed_um(session, "k0")[0] < 0
    assert placed_um(session, "k0") == pytest.approx(hand.position_um(views[2], at))


@pytest.mark.parametrize("axis", range(3))
def test_a_drag_previews_and_commits_once_on_release(
    placed: Session, views: Views, hand: Any, axis: int
) -> None:
    view = views[axis]
    start, end = hand.pixel(view, MIDDLE_UM), hand.pixel(view, MIDDLE_UM) + QPoint(31, -22)
    edits = placed.undo_stack.count

    hand.drag(view, start, start + QPoint(10, -10), end, release=False)

    assert placed.view.preview is not None
    assert placed.view.preview.keypoint == "k0"
    assert placed.undo_stack.count == edits
    assert placed_um(placed, "k0") == pytest.approx(MIDDLE_UM)

    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, end)

    assert placed.view.preview is None
    assert placed.undo_stack.count == edits + 1
    assert placed.document is not None
    assert placed.document.keypoint("k0").source == "dragged"
    assert view.viewport is not None
    moved = placed_um(placed, "k0")
    assert moved[axis] == MIDDLE_UM[axis], "a drag stays in its plane"
    shift_px = QPointF(*view.viewport.pixel(moved)) - QPointF(*view.viewport.pixel(MIDDLE_UM))
    assert (shift_px.x(), shift_px.y()) == pytest.approx((31, -22), abs=1e-6)


def test_dragging_takes_hold_of_a_keypoint_beside_the_plane_and_keeps_its_depth(
    placed: Session, views: Views, hand: Any
) -> None:
    placed.look(crosshair_um=(25 * 15.9, *MIDDLE_UM[1:]))
    start = hand.pixel(views[0], MIDDLE_UM)

    hand.drag(views[0], start, start + QPoint(40, 0))

    assert placed_um(placed, "k0")[0] == MIDDLE_UM[0]
    assert placed_um(placed, "k0")[1] > MIDDLE_UM[1]


def test_escape_takes_a_drag_back(placed: Session, views: Views, hand: Any) -> None:
    view, document = views[0], placed.document
    start = hand.pixel(view, MIDDLE_UM)
    hand.drag(view, start, start + QPoint(30, 30), release=False)
    view.setFocus()

    QTest.keyClick(view, Qt.Key.Key_Escape)

    assert placed.view.preview is None
    # The button is still down: neither moving on nor letting go brings the drag back.
    hand.move(view, start + QPoint(50, 50))
    assert placed.view.preview is None
    QTest.mouseRelease(
        view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start + QPoint(50, 50)
    )
    assert placed.document is document


def test_a_preview_dropped_by_somebody_else_ends_the_drag(placed: Session, views: Views, hand: Any) -> None:
    """The window's Esc action comes before the view's own key."""
    document = placed.document
    start = hand.pixel(views[1], MIDDLE_UM)
    hand.drag(views[1], start, start + QPoint(20, 0), release=False)

    placed.drop_preview()
    hand.move(views[1], start + QPoint(40, 0))
    QTest.mouseRelease(views[1], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)

    assert placed.view.preview is None
    assert placed.document is document


def test_leaving_place_mode_with_the_button_down_lets_go(placed: Session, views: Views, hand: Any) -> None:
    document = placed.document
    start = hand.pixel(views[0], MIDDLE_UM)
    QTest.mousePress(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)

    placed.set_mode("navigate")
    hand.move(views[0], start + QPoint(30, 0))
    QTest.mouseRelease(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)

    assert placed.view.preview is None
    assert placed.document is document


def test_a_locked_keypoint_does_not_move_and_says_why(placed: Session, views: Views, hand: Any) -> None:
    placed.set_locked("k0", True)
    document = placed.document
    said: list[str] = []
    placed.message_posted.connect(said.append)
    start = hand.pixel(views[0], MIDDLE_UM)

    hand.drag(views[0], start, start + QPoint(20, 10), start + QPoint(40, 20))

    assert placed.document is document
    assert placed.view.preview is None
    assert len(said) == 1
    assert "locked" in said[0]


def test_a_click_on_a_keypoint_chooses_it_and_moves_nothing(placed: Session, views: Views, hand: Any) -> None:
    document = placed.document

    hand.click(views[2], hand.pixel(views[2], MIDDLE_UM) + QPoint(2, 1))

    assert placed.view.active_part == "k0"
    assert placed.document is document


def test_a_click_close_beside_a_keypoint_still_places_the_active_one(
    placed: Session, views: Views, hand: Any
) -> None:
    """The tip of a link and the base of the next lie half a millimetre apart: a few pixels."""
    at = hand.pixel(views[2], MIDDLE_UM) + QPoint(7, 0)
    wanted_um = hand.position_um(views[2], at)

    hand.click(views[2], at)

    assert placed_um(placed, "k1") == pytest.approx(wanted_um)
    assert placed_um(placed, "k0") == pytest.approx(MIDDLE_UM)


@pytest.mark.parametrize(("offset", "meant"), [(2, "k0"), (5, "k1")])
def test_while_a_keypoint_is_awaited_only_a_clear_hit_chooses_its_neighbour(
    placed: Session, views: Views, hand: Any, offset: int, meant: str
) -> None:
    at = hand.pixel(views[2], MIDDLE_UM) + QPoint(offset, 0)
    wanted_um = hand.position_um(views[2], at)
    assert placed.view.active_part == "k1"

    hand.click(views[2], at)

    if meant == "k0":
        assert placed.view.active_part == "k0"
        assert placed.document is not None
        assert "k1" not in placed.document.positions_um
    else:
        assert placed_um(placed, "k1") == pytest.approx(wanted_um)


def test_an_unsteady_click_is_no_drag(placed: Session, views: Views, hand: Any) -> None:
    document = placed.document
    start = hand.pixel(views[0], MIDDLE_UM)

    hand.drag(views[0], start, start + QPoint(2, 2))

    assert placed.document is document


def test_a_double_click_places_once(views: Views, session: Session, hand: Any) -> None:
    session.set_mode("place")
    session.activate("k0")
    at = QPoint(100, 100)

    QTest.mouseClick(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)
    QTest.mouseDClick(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)

    assert session.undo_stack.count == 1
    assert session.view.active_part == "k1"


def test_navigating_never_edits(placed: Session, views: Views, hand: Any) -> None:
    placed.set_mode("navigate")
    document = placed.document
    for view in views:
        start = hand.pixel(view, MIDDLE_UM)
        hand.click(view, start)
        hand.drag(view, start, start + QPoint(30, 20), start + QPoint(60, 30))
        hand.click(view, QPoint(120, 90))
        hand.drag(view, QPoint(100, 100), QPoint(150, 140), button=Qt.MouseButton.RightButton)
        hand.drag(view, QPoint(100, 100), QPoint(150, 140), button=Qt.MouseButton.MiddleButton)
        QTest.mouseDClick(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)
        hand.wheel(view, -120)
        hand.wheel(view, 120, None, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClick(view, Qt.Key.Key_Escape)

    assert placed.document is document
    assert placed.undo_stack.count == 1
    assert placed.view.preview is None


def test_navigating_moves_the_crosshair_within_the_plane(views: Views, session: Session, hand: Any) -> None:
    wanted_um = hand.position_um(views[1], QPoint(150, 200))

    hand.click(views[1], QPoint(150, 200))

    assert session.view.crosshair_um == pytest.approx(wanted_um)
    assert views[1].index == 30

    end_um = hand.position_um(views[1], QPoint(180, 120))
    hand.drag(views[1], QPoint(150, 200), QPoint(160, 160), QPoint(180, 120))
    assert session.view.crosshair_um == pytest.approx(end_um)


def test_a_press_on_a_keypoint_while_navigating_makes_it_active(
    placed: Session, views: Views, hand: Any
) -> None:
    placed.set_mode("navigate")
    crosshair_um = placed.view.crosshair_um

    hand.click(views[0], hand.pixel(views[0], MIDDLE_UM) + QPoint(3, 0))

    assert placed.view.active_part == "k0"
    assert placed.view.crosshair_um == crosshair_um


def test_the_crosshair_stays_in_the_volume(views: Views, session: Session, hand: Any) -> None:
    hand.drag(views[0], QPoint(200, 150), QPoint(-300, 900))

    _, y_um, z_um = session.view.crosshair_um
    assert y_um == 0
    assert z_um == pytest.approx(49 * 9.4)


def test_right_drag_changes_window_and_level(views: Views, session: Session, hand: Any) -> None:
    session.look(window=(50.0, 150.0))

    hand.drag(
        views[0], QPoint(100, 100), QPoint(120, 100), QPoint(250, 100), button=Qt.MouseButton.RightButton
    )
    low, high = session.view.window
    assert (low + high) / 2 == pytest.approx(100)
    assert high - low == pytest.approx(271.8, abs=0.1), "sideways widens"

    session.look(window=(50.0, 150.0))
    hand.drag(views[0], QPoint(100, 150), QPoint(100, 50), button=Qt.MouseButton.RightButton)
    low, high = session.view.window
    assert high - low == pytest.approx(100)
    assert (low + high) / 2 == pytest.approx(50), "upwards brightens"


def test_a_second_button_does_not_disturb_a_drag(placed: Session, views: Views, hand: Any) -> None:
    start = hand.pixel(views[0], MIDDLE_UM)
    hand.drag(views[0], start, start + QPoint(20, 0), release=False)

    QTest.mousePress(views[0], Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier, start)
    QTest.mouseRelease(views[0], Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier, start)

    assert placed.view.preview is not None


def test_closing_the_volume_ends_a_drag(placed: Session, views: Views, hand: Any) -> None:
    start = hand.pixel(views[0], MIDDLE_UM)
    hand.drag(views[0], start, start + QPoint(20, 0), release=False)

    assert placed.close_volume()
    hand.move(views[0], start + QPoint(30, 0))
    QTest.mouseRelease(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, start)

    assert placed.document is None


def test_the_cursor_shows_the_mode(placed: Session, views: Views, hand: Any) -> None:
    at = hand.pixel(views[0], MIDDLE_UM)
    hand.move(views[0], QPoint(40, 40))
    assert views[0].cursor().shape() == Qt.CursorShape.CrossCursor
    hand.move(views[0], at)
    assert views[0].cursor().shape() == Qt.CursorShape.OpenHandCursor
    hand.drag(views[0], at, at + QPoint(20, 0), release=False)
    assert views[0].cursor().shape() == Qt.CursorShape.ClosedHandCursor
    QTest.mouseRelease(views[0], Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)
    placed.set_locked("k0", True)
    hand.move(views[0], hand.pixel(views[0], placed_um(placed, "k0")))
    assert views[0].cursor().shape() == Qt.CursorShape.ForbiddenCursor
    placed.set_mode("navigate")
    assert views[0].cursor().shape() == Qt.CursorShape.ArrowCursor


def test_hidden_keypoints_cannot_be_taken_hold_of(placed: Session, views: Views, hand: Any) -> None:
    placed.look(overlays_hidden=True)
    at = hand.pixel(views[0], MIDDLE_UM)

    assert views[0].mark_under(at.x(), at.y(), 8) is None
    placed.look(overlays_hidden=False)
    assert views[0].mark_under(at.x(), at.y(), 8) is not None


def test_arrow_keys_are_left_to_the_window(views: Views) -> None:
    left: list[int] = []
    parent = views[0].parentWidget()
    assert parent is not None
    parent.keyPressEvent = lambda event: left.append(event.key())  # type: ignore[method-assign]
    keys = [Qt.Key.Key_Left, Qt.Key.Key_PageDown, Qt.Key.Key_Escape]

    for key in keys:
        QTest.keyClick(views[0], key)

    assert left == keys
