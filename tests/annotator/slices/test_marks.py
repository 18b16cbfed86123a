import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.session import Session
from annotator.slices.marks import NEAR_UM, Mark, mark_under, marks, nearness
from annotator.slices.projection import Plane
from annotator.slices.viewport import Area, Viewport


def viewport_of(session: Session, axis: int) -> Viewport:
    assert session.volume is not None
    assert session.spacing_um is not None
    plane = Plane.across(axis, session.volume.shape, session.spacing_um, session.volume.depth_axis)
    return Viewport.fitted(plane, Area(0, 0, 400, 300))


def mark(name: str, x: float, y: float, distance_um: float = 0.0) -> Mark:
    return Mark(
        name=name,
        position_um=(0.0, 0.0, 0.0),
        x=x,
        y=y,
        distance_um=distance_um,
        nearness=nearness(distance_um, 5.0),
        color="#ffffff",
        state="placed",
        unsure=False,
        locked=False,
        active=False,
        preview=False,
    )


def test_marks_say_what_the_document_says(session: Session) -> None:
    session.place((5 * 15.9, 100.0, 200.0), keypoint="k0")
    session.place((15 * 15.9, 50.0, 60.0), keypoint="k3")
    session.set_state("k3", "occluded")
    session.set_certainty("k3", "unsure")
    session.set_locked("k3", True)
    session.activate("k3")
    viewport = viewport_of(session, 0)

    first, second = marks(session, viewport, 5)

    assert (first.name, first.state, first.active, first.preview) == ("k0", "placed", False, False)
    assert first.is_on_plane
    assert (first.x, first.y) == viewport.pixel((0, 100.0, 200.0))
    assert first.color == "#56b4e9"
    assert (second.state, second.unsure, second.locked, second.active) == (
        "occluded",
        True,
        True,
        True,
    )
    assert second.distance_um == pytest.approx(10 * 15.9)
    assert second.is_near
    assert not second.is_on_plane
    assert second.radius_px < first.radius_px


def test_a_preview_is_drawn_where_it_is_and_remembers_where_it_was(session: Session) -> None:
    session.place((0.0, 100.0, 200.0), keypoint="k0")
    session.begin_preview("k0", (0.0, 150.0, 220.0), "dragged")
    viewport = viewport_of(session, 0)

    (only,) = marks(session, viewport, 0)

    assert only.preview
    assert (only.x, only.y) == viewport.pixel((0.0, 150.0, 220.0))
    assert only.origin_px == viewport.pixel((0.0, 100.0, 200.0))


def test_nothing_open_has_no_marks(empty_session: Session) -> None:
    plane = Plane.across(0, (2, 2, 2), (1.0, 1.0, 1.0), 2)

    assert marks(empty_session, Viewport.fitted(plane, Area(0, 0, 10, 10)), 0) == ()


@given(distance_um=st.floats(-5000, 5000), half_um=st.floats(0.5, 350))
def test_nearness_falls_from_one_on_the_plane_to_nothing_far_away(distance_um: float, half_um: float) -> None:
    value = nearness(distance_um, half_um)

    assert 0 <= value <= 1
    assert (value == 1) == (abs(distance_um) <= half_um * (1 + 1e-9))
    if abs(distance_um) > NEAR_UM + 1e-3:
        assert value == 0
    assert value == nearness(-distance_um, half_um)


def test_the_nearest_mark_within_the_radius_is_under_the_cursor() -> None:
    shown = (mark("a", 10, 10), mark("b", 16, 10), mark("c", 100, 100))

    assert mark_under(shown, 14, 10, 8) == shown[1]
    assert mark_under(shown, 30, 30, 8) is None


def test_of_two_at_one_place_the_one_nearer_to_the_plane_is_taken() -> None:
    shown = (mark("far", 10, 10, 200.0), mark("near", 10, 10, -20.0))

    assert mark_under(shown, 10, 10, 8) == shown[1]


def test_what_is_far_from_the_plane_cannot_be_taken_hold_of() -> None:
    assert mark_under((mark("a", 10, 10, NEAR_UM + 1),), 10, 10, 8) is None
