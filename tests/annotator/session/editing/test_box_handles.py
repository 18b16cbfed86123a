"""What dragging a handle makes of a box: it follows as far as its constraint allows, and no farther."""

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given

from annotations.geometry.boxes import Box
from annotations.geometry.rotations import quaternion
from annotator.session.editing.box_handles import (
    KNOB_UM,
    SMALLEST_UM,
    box_dragged,
    box_handles,
    resized,
    roll_to_deg,
    rolled,
    smallest_turn,
    swung,
    turned,
)

positions = st.tuples(*[st.floats(-20_000, 20_000)] * 3)
sizes = st.tuples(*[st.floats(50, 20_000)] * 3)
rotations = (
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: math.hypot(*values) > 1e-3).map(quaternion)
)
boxes = st.builds(Box, positions, sizes, rotations)

LYING = Box((1000.0, 2000.0, 3000.0), (800.0, 400.0, 200.0), (1.0, 0.0, 0.0, 0.0))


def assert_same(box: Box, expected: Box) -> None:
    assert box.center_um == pytest.approx(expected.center_um, abs=1e-6)
    assert box.size_um == pytest.approx(expected.size_um, abs=1e-6)
    np.testing.assert_allclose(box.axes, expected.axes, atol=1e-9)


def test_only_a_free_box_has_handles_on_its_sides() -> None:
    held = {handle.name: handle.kind for handle in box_handles(LYING, "#000000", free=False)}
    free = {handle.name: handle.kind for handle in box_handles(LYING, "#000000", free=True)}
    assert held == {"center": "move", "base": "end", "tip": "end", "swing": "turn", "roll": "turn"}
    assert free == held | dict.fromkeys(("+y", "-y", "+z", "-z"), "face")


def test_handles_are_on_the_box_and_knobs_stand_off_it() -> None:
    at = {handle.name: handle for handle in box_handles(LYING, "#123456", free=True)}
    assert at["base"].position_um == (600.0, 2000.0, 3000.0)
    assert at["+z"].position_um == (1000.0, 2000.0, 3100.0)
    assert at["swing"].stem_um == at["tip"].position_um == (1400.0, 2000.0, 3000.0)
    assert at["swing"].position_um == (1400.0 + KNOB_UM, 2000.0, 3000.0)
    assert at["roll"].position_um == (1000.0, 2000.0, 2900.0 - KNOB_UM)
    assert all(handle.color == "#123456" and handle.hint for handle in at.values())
    assert all((handle.stem_um is not None) == (handle.kind == "turn") for handle in at.values())


@given(boxes)
def test_dragging_a_handle_to_where_it_is_changes_nothing(box: Box) -> None:
    for handle in box_handles(box, "#000000", free=True):
        assert_same(box_dragged(box, handle.name, handle.position_um), box)


@given(boxes, positions)
def test_the_centre_lands_where_it_is_dragged(box: Box, to_um: tuple[float, float, float]) -> None:
    dragged = box_dragged(box, "center", to_um)
    assert dragged.center_um == to_um
    assert (dragged.size_um, dragged.rotation_wxyz) == (box.size_um, box.rotation_wxyz)


@given(boxes, positions, st.booleans())
def test_an_end_lands_where_it_is_dragged_and_the_other_stays(
    box: Box, to_um: tuple[float, float, float], is_tip: bool
) -> None:
    other_um = box.base_um if is_tip else box.tip_um
    along = np.subtract(to_um, other_um) * (1 if is_tip else -1)
    assume(math.hypot(*along) > SMALLEST_UM)
    assume(smallest_turn(box.axes[:, 0], along) is not None)
    dragged = box_dragged(box, "tip" if is_tip else "base", to_um)
    moved_um, kept_um = (dragged.tip_um, dragged.base_um) if is_tip else (dragged.base_um, dragged.tip_um)
    assert moved_um == pytest.approx(to_um, abs=1e-6)
    assert kept_um == pytest.approx(other_um, abs=1e-6)
    assert dragged.size_um[1:] == box.size_um[1:]


def test_an_end_that_is_dragged_aside_takes_the_hinge_along_by_the_smallest_turn() -> None:
    dragged = box_dragged(LYING, "tip", (600.0, 2000.0, 3800.0))
    np.testing.assert_allclose(dragged.axes[:, 0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(dragged.axes[:, 1], LYING.axes[:, 1], atol=1e-12)


def test_ends_that_would_meet_stay_where_they_are() -> None:
    assert box_dragged(LYING, "tip", LYING.base_um) is LYING
    assert box_dragged(LYING, "swing", LYING.center_um) is LYING
    # Exactly the other way round there is no smallest turn.
    assert box_dragged(LYING, "tip", (0.0, 2000.0, 3000.0)) is LYING


@given(boxes, positions)
def test_swinging_points_the_box_and_keeps_centre_and_size(
    box: Box, to_um: tuple[float, float, float]
) -> None:
    towards = np.subtract(to_um, box.center_um)
    assume(smallest_turn(box.axes[:, 0], towards) is not None and math.hypot(*towards) > 1)
    swung_box = box_dragged(box, "swing", to_um)
    assert (swung_box.center_um, swung_box.size_um) == (box.center_um, box.size_um)
    np.testing.assert_allclose(swung_box.axes[:, 0], towards / math.hypot(*towards), atol=1e-6)


@given(boxes, positions)
def test_rolling_brings_the_knob_as_near_as_it_can_and_keeps_centre_size_and_axis(
    box: Box, to_um: tuple[float, float, float]
) -> None:
    towards = np.subtract(to_um, box.center_um)
    across = towards - (towards @ box.axes[:, 0]) * box.axes[:, 0]
    assume(math.hypot(*across) > 1)
    dragged = box_dragged(box, "roll", to_um)
    assert (dragged.center_um, dragged.size_um) == (box.center_um, box.size_um)
    np.testing.assert_allclose(dragged.axes[:, 0], box.axes[:, 0], atol=1e-9)
    np.testing.assert_allclose(-dragged.axes[:, 2], across / math.hypot(*across), atol=1e-6)


@given(boxes, positions, st.sampled_from(["+y", "-y", "+z", "-z"]))
def test_a_face_follows_along_its_axis_and_the_opposite_one_stays(
    box: Box, to_um: tuple[float, float, float], name: str
) -> None:
    axis, sense = "xyz".index(name[1]), 1.0 if name[0] == "+" else -1.0
    outwards = box.axes[:, axis] * sense
    share = np.eye(3)[axis] * sense / 2
    opposite_um = np.asarray(box.position_um(-share))
    dragged = box_dragged(box, name, to_um)
    np.testing.assert_allclose(dragged.position_um(-share), opposite_um, atol=1e-6)
    assert dragged.rotation_wxyz == box.rotation_wxyz
    wanted_um = (np.asarray(to_um) - opposite_um) @ outwards
    assert dragged.size_um[axis] == pytest.approx(max(wanted_um, SMALLEST_UM), abs=1e-6)
    others = [each for each in range(3) if each != axis]
    assert [dragged.size_um[each] for each in others] == [box.size_um[each] for each in others]


@given(boxes, st.integers(0, 2), st.floats(-360, 360))
def test_turning_keeps_centre_size_and_the_axis_that_it_turns_about(
    box: Box, axis: int, turn_deg: float
) -> None:
    once = turned(box, axis, turn_deg)
    assert (once.center_um, once.size_um) == (box.center_um, box.size_um)
    np.testing.assert_allclose(once.axes[:, axis], box.axes[:, axis], atol=1e-9)
    assert_same(turned(once, axis, -turn_deg), box)


def test_turns_are_right_handed() -> None:
    np.testing.assert_allclose(turned(LYING, 2, 90).axes[:, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(rolled(LYING, 90).axes[:, 1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(swung(LYING, (0, 0, 5)).axes[:, 0], [0, 0, 1], atol=1e-12)
    assert roll_to_deg(np.eye(3), 1.0, (7, 0, 0)) == 0.0


def test_resizing_never_turns_a_box_inside_out() -> None:
    small = resized(LYING, 1, -1.0, -1e6)
    assert small.size_um == (800.0, SMALLEST_UM, 200.0)
    assert small.position_um((0, 0.5, 0)) == pytest.approx(LYING.position_um((0, 0.5, 0)))


def test_there_is_no_smallest_turn_to_the_opposite_or_to_nothing() -> None:
    assert smallest_turn((1, 0, 0), (-2, 0, 0)) is None
    assert smallest_turn((1, 0, 0), (0, 0, 0)) is None
    assert smallest_turn((1, 0, 0), (3, 0, 0)) == pytest.approx((1, 0, 0, 0))
