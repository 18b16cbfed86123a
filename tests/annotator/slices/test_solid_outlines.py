import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotator.session.editing.solids import Solid
from annotator.slices.projection import Plane
from annotator.slices.solid_outlines import SolidOutline, section_um, solid_outlines
from annotator.slices.viewport import Area, Viewport

SHAPE, SPACING_UM = (40, 60, 50), (430.0, 430.0, 215.0)
CENTER_UM = (8600.0, 12900.0, 5375.0)
turns = st.builds(
    rotations.from_yaw_pitch_roll, st.floats(-180, 180), st.floats(-89, 89), st.floats(-180, 180)
)


def viewport(axis: int) -> Viewport:
    return Viewport.fitted(Plane.across(axis, SHAPE, SPACING_UM, 2), Area(0, 0, 400, 300))


def solid(
    rotation_wxyz: rotations.Quaternion = (1.0, 0.0, 0.0, 0.0),
    *,
    is_round: bool = False,
    kind: str = "box",
) -> Solid:
    box = Box(CENTER_UM, (9000.0, 4000.0, 2000.0), rotation_wxyz)
    return Solid("link0", kind, box, is_round, "#56b4e9")  # type: ignore[arg-type]


def middle(axis: int) -> int:
    return viewport(axis).plane.index(CENTER_UM)


def area(points: tuple[tuple[float, float], ...]) -> float:
    following = (*points[1:], points[0])
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, following, strict=True))) / 2


@pytest.mark.parametrize(
    ("axis", "sides_um"), [(0, (4000.0, 2000.0)), (1, (9000.0, 2000.0)), (2, (9000.0, 4000.0))]
)
def test_a_box_along_the_axes_is_cut_in_a_rectangle_of_its_sides(
    axis: int, sides_um: tuple[float, float]
) -> None:
    view = viewport(axis)

    (outline,) = solid_outlines([solid()], view, middle(axis))

    assert len(outline.points) == 4
    x, y = np.array(outline.points).T
    flat_um = {view.plane.horizontal: np.ptp(x), view.plane.vertical: np.ptp(y)}
    extents = [flat_um[other] / view.scale for other in range(3) if other != axis]
    assert extents == pytest.approx(sides_um)


@given(rotation_wxyz=turns, axis=st.integers(0, 2), offset=st.integers(-12, 12))
def test_an_outline_lies_on_the_surface_goes_round_once_and_has_no_corner_twice(
    rotation_wxyz: rotations.Quaternion, axis: int, offset: int
) -> None:
    body, view = solid(rotation_wxyz), viewport(axis)
    index = middle(axis) + offset

    corners_um = np.array(section_um(body, view.plane, index))

    assume(len(corners_um))
    assert corners_um[:, axis] == pytest.approx(view.plane.depth_um(index))
    share = np.abs((corners_um - CENTER_UM) @ body.box.axes) / np.array(body.box.size_um) * 2
    assert share.max(axis=1) == pytest.approx(1.0)
    assert 3 <= len(corners_um) <= 6
    flat = np.delete(corners_um, axis, axis=1)
    ways = np.roll(flat, -1, axis=0) - flat
    turned = ways[:, 0] * np.roll(ways, -1, axis=0)[:, 1] - ways[:, 1] * np.roll(ways, -1, axis=0)[:, 0]
    assert (turned > 0).all() or (turned < 0).all(), "convex, with a turn at every corner"
    headings = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
    assert abs(headings[-1] - headings[0]) < 2 * math.pi


@given(rotation_wxyz=turns, axis=st.integers(0, 2), index=st.integers(0, 39))
def test_a_body_that_the_plane_misses_has_no_outline(
    rotation_wxyz: rotations.Quaternion, axis: int, index: int
) -> None:
    body, view = solid(rotation_wxyz), viewport(axis)
    reach_um = float(np.abs(body.box.axes[axis]) @ np.array(body.box.size_um)) / 2
    distance_um = abs(view.plane.distance_um(CENTER_UM, index))
    assume(abs(distance_um - reach_um) > 1)

    outlines = solid_outlines([body], view, index)

    assert bool(outlines) == (distance_um < reach_um)


def test_a_round_link_is_cut_in_an_ellipse() -> None:
    view = viewport(0)

    (outline,) = solid_outlines([solid(is_round=True, kind="ghost")], view, middle(0))

    assert len(outline.points) == 32
    assert area(outline.points) == pytest.approx(math.pi * 2000 * 1000 * view.scale**2, rel=0.01)


# The hinge


def outline_of(rotation_wxyz: rotations.Quaternion, axis: int) -> SolidOutline:
    (outline,) = solid_outlines([solid(rotation_wxyz)], viewport(axis), middle(axis))
    return outline


def test_the_arrow_leaves_the_outline_where_the_hinge_does() -> None:
    hinge = outline_of((1.0, 0.0, 0.0, 0.0), 2).hinge
    view = viewport(2)

    assert hinge is not None
    assert (hinge.right, hinge.down, hinge.away) == (0.0, 1.0, 0.0)
    # At a quarter of the length from the base, where no handle is.
    foot_um = (CENTER_UM[0] - 2250, CENTER_UM[1] + 2000, 0.0)
    assert hinge.outer == pytest.approx(view.pixel(foot_um))


@pytest.mark.parametrize(("axis", "away"), [(0, 0.0), (1, -1.0), (2, 0.0)])
def test_a_hinge_along_y_looks_at_the_person_only_in_the_slice_across_y(axis: int, away: float) -> None:
    """With x to the right and depth downwards, y runs out of the screen."""
    hinge = outline_of((1.0, 0.0, 0.0, 0.0), axis).hinge

    assert hinge is not None
    assert hinge.away == pytest.approx(away)


@given(rotation_wxyz=turns, axis=st.integers(0, 2))
def test_turning_a_box_over_turns_its_arrow_round(rotation_wxyz: rotations.Quaternion, axis: int) -> None:
    there = outline_of(rotation_wxyz, axis)
    over = rotations.product(rotation_wxyz, (0.0, 1.0, 0.0, 0.0))
    back = outline_of(over, axis)

    assert there.hinge is not None
    assert back.hinge is not None
    assert np.hypot(there.hinge.right, there.hinge.down) <= 1 + 1e-9
    assert (back.hinge.right, back.hinge.down, back.hinge.away) == pytest.approx(
        (-there.hinge.right, -there.hinge.down, -there.hinge.away), abs=1e-9
    )
    assert area(back.points) == pytest.approx(area(there.points))


def test_only_boxes_of_the_document_show_a_hinge() -> None:
    (ghost,) = solid_outlines([solid(kind="ghost")], viewport(2), middle(2))

    assert ghost.hinge is None
