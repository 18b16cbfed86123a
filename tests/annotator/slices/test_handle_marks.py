import math

import pytest

from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector
from annotator.session.editing.box_handles import box_handles
from annotator.session.editing.handles import Handle
from annotator.session.editing.solids import Solid
from annotator.session.viewing.view import View
from annotator.slices.handle_marks import COVER_PX, STEM_PX, HandleMark, handle_marks, handle_under
from annotator.slices.projection import Plane
from annotator.slices.viewport import Area, Viewport

SHAPE, SPACING_UM = (40, 60, 50), (430.0, 430.0, 215.0)
BOX = Box((8600.0, 12900.0, 5375.0), (9000.0, 4000.0, 2000.0), (1.0, 0.0, 0.0, 0.0))
PLACING = View(mode="place", active_part="link0")


def solid(*, active: bool = True) -> Solid:
    return Solid("link0", "box", BOX, is_round=False, color="#56b4e9", active=active)


def shown(axis: int, position_um: Vector, *, free: bool = True, size: float = 400.0) -> dict[str, HandleMark]:
    plane = Plane.across(axis, SHAPE, SPACING_UM, 2)
    viewport = Viewport.fitted(plane, Area(0, 0, size, 0.75 * size))
    handles = box_handles(BOX, "#56b4e9", free=free)
    made = handle_marks(handles, [solid()], PLACING, viewport, plane.index(position_um))
    return {mark.handle.name: mark for mark in made}


def test_in_a_slice_along_a_box_its_handles_can_be_taken() -> None:
    marks = shown(2, BOX.center_um)

    # The knob that rolls it and the faces above and below lie over and under its centre.
    assert set(marks) == {"center", "base", "tip", "swing", "+y", "-y"}
    assert all(mark.is_reachable for mark in marks.values())


def test_in_a_slice_across_a_box_only_the_nearest_of_centre_and_ends_is_shown() -> None:
    assert set(shown(0, BOX.center_um)) == {"center", "roll", "+y", "-y", "+z", "-z"}
    assert "base" in shown(0, BOX.base_um)
    assert "center" not in shown(0, BOX.base_um)


def test_handles_can_be_taken_wherever_the_slice_cuts_the_box() -> None:
    upper_um = (BOX.center_um[0], BOX.center_um[1], BOX.center_um[2] - 900)

    marks = shown(2, upper_um)

    assert abs(marks["tip"].distance_um) > 800
    assert marks["tip"].is_reachable
    assert marks["tip"].nearness < shown(2, BOX.center_um)["tip"].nearness


def test_beyond_the_box_handles_are_only_hinted_at() -> None:
    above_um = (BOX.center_um[0], BOX.center_um[1], BOX.center_um[2] - 2800)

    marks = shown(2, above_um)

    assert not marks["tip"].is_reachable
    assert handle_under(marks.values(), marks["tip"].x, marks["tip"].y, 8) is None
    # This one stands off the box, and the slice passes by it.
    assert marks["roll"].is_reachable


def test_no_two_handles_lie_on_each_other() -> None:
    for axis in range(3):
        for size in (150.0, 400.0, 1000.0):
            marks = list(shown(axis, BOX.center_um, size=size).values())
            for number, first in enumerate(marks):
                for second in marks[:number]:
                    assert math.hypot(first.x - second.x, first.y - second.y) > COVER_PX


@pytest.mark.parametrize("size", [150.0, 400.0, 3000.0])
def test_a_knob_stands_off_its_body_at_any_zoom(size: float) -> None:
    knob = shown(2, BOX.center_um, size=size)["swing"]

    assert knob.stem_px is not None
    assert math.hypot(knob.x - knob.stem_px[0], knob.y - knob.stem_px[1]) >= STEM_PX - 1e-6
    # Farther out, but in the same direction: that is all that turning asks for.
    assert knob.position_um[0] >= knob.handle.position_um[0]
    assert knob.position_um[1:] == knob.handle.position_um[1:]


def mark(name: str, x: float, y: float, *, is_reachable: bool = True) -> HandleMark:
    handle = Handle(name, "move", (0.0, 0.0, 0.0), "#ffffff", "")
    return HandleMark(handle, (0.0, 0.0, 0.0), x, y, 0.0, is_reachable, None)


def test_the_nearest_handle_within_the_radius_is_taken() -> None:
    marks = (mark("a", 10, 10), mark("b", 20, 10), mark("c", 17, 10, is_reachable=False))

    assert handle_under(marks, 16, 10, 8) is marks[1]
    assert handle_under(marks, 14, 10, 8) is marks[0]
    assert handle_under(marks, 40, 10, 8) is None


def test_handles_of_the_tool_sit_on_the_ghost_and_not_on_boxes() -> None:
    """Else the tool could not be taken where only its ghost is."""
    plane = Plane.across(2, SHAPE, SPACING_UM, 2)
    viewport = Viewport.fitted(plane, Area(0, 0, 400, 300))
    handle = Handle("move:link0", "move", (8600.0, 12900.0, 4500.0), "#56b4e9", "")
    index = plane.index(BOX.center_um)
    ghost = Solid("link0", "ghost", BOX, is_round=True, color="#56b4e9")
    posing = View(mode="pose")

    (on_ghost,) = handle_marks([handle], [ghost], posing, viewport, index)
    (on_box,) = handle_marks([handle], [solid()], posing, viewport, index)

    assert on_ghost.is_reachable
    assert not on_box.is_reachable
