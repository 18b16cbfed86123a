"""Handles go where the cursor pulls them, as far as what they do allows: in both projections."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from annotations.geometry.frames import vector
from annotator.scene.camera import Camera, preset, turned
from annotator.scene.handle_paths import CirclePath, LinePath, PlanePath, SpherePath, handle_path
from annotator.scene.picking import Picture
from annotator.session.editing.handles import Handle

HOME = preset("home", (0, 0, 0), (17_400, 26_100, 10_800), 2, 1.4)
HERE_UM = (8000.0, 12_000.0, 5000.0)

cameras = st.builds(
    lambda right, down, parallel: replace(turned(HOME, right, down), parallel=parallel),
    st.floats(-1, 1),
    st.floats(-0.4, 0.4),
    st.booleans(),
)
pixels = st.tuples(st.floats(60, 640), st.floats(60, 440))
units = (
    st.tuples(*[st.floats(-1, 1)] * 3)
    .filter(lambda way: math.hypot(*way) > 0.1)
    .map(lambda way: vector(np.array(way) / math.hypot(*way)))
)


def picture_of(camera: Camera) -> Picture:
    return Picture(camera, 700, 500)


def place(picture: Picture, position_um) -> np.ndarray:
    return picture.project([position_um])[0]


@given(cameras, pixels)
def test_what_is_free_goes_to_the_cursor_and_keeps_its_depth(camera: Camera, to) -> None:
    picture = picture_of(camera)
    at = place(picture, PlanePath(HERE_UM).follow(picture, *to))
    assert at == pytest.approx((*to, place(picture, HERE_UM)[2]), abs=1e-3)


@given(cameras, units, st.floats(-5000, 5000))
def test_what_slides_goes_to_the_cursor_on_its_line(camera: Camera, axis, along_um: float) -> None:
    picture = picture_of(camera)
    assume(abs(np.dot(axis, picture.ray(350, 250).direction)) < 0.9)
    there_um = np.array(HERE_UM) + along_um * np.array(axis)
    x, y, _ = place(picture, there_um)
    assert LinePath(HERE_UM, axis).follow(picture, x, y) == pytest.approx(tuple(there_um), abs=1e-3)


@given(cameras, units, pixels)
def test_what_slides_leaves_its_line_for_no_cursor(camera: Camera, axis, to) -> None:
    there_um = LinePath(HERE_UM, axis).follow(picture_of(camera), *to)
    assert np.cross(np.subtract(there_um, HERE_UM), axis) == pytest.approx((0, 0, 0), abs=1e-3)


def test_a_line_that_is_seen_from_its_end_leads_nowhere() -> None:
    assert LinePath(HERE_UM, HOME.forward).follow(picture_of(HOME), 400, 300) == HERE_UM


@given(cameras, units, st.floats(-170, 170))
def test_what_turns_goes_to_the_cursor_on_its_circle(camera: Camera, axis, turn_deg: float) -> None:
    picture = picture_of(camera)
    # Seen nearly edge-on, two places lie under the cursor.
    assume(abs(np.dot(axis, picture.ray(350, 250).direction)) > 0.4)
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    aside = np.cross(axis, across)
    pivot_um, radius_um = np.array(HERE_UM), 4000.0
    path = CirclePath(vector(pivot_um + radius_um * across), HERE_UM, axis)
    turn = math.radians(turn_deg)
    there_um = pivot_um + radius_um * (math.cos(turn) * across + math.sin(turn) * aside)
    found_um = np.array(path.follow(picture, *place(picture, there_um)[:2]))
    assert np.linalg.norm(found_um - pivot_um) == pytest.approx(radius_um)
    # A pull towards where it was, and steps of half a degree.
    assert np.linalg.norm(place(picture, found_um)[:2] - place(picture, there_um)[:2]) < 9


def test_a_circle_that_is_seen_edge_on_is_followed_on_one_side() -> None:
    camera = preset("+x", (0, 0, 0), (17_400, 26_100, 10_800), 2, 1.4)
    picture = picture_of(camera)
    near_um = np.array(HERE_UM) + 4000 * np.array((-0.8, 0.6, 0.0))
    path = CirclePath(vector(near_um), HERE_UM, (0.0, 0.0, 1.0))
    x, y, _ = place(picture, near_um)
    for step in range(5):
        found_um = path.follow(picture, x - 4 * step, y)
        assert found_um[0] < HERE_UM[0]
        assert place(picture, found_um)[0] == pytest.approx(x - 4 * step, abs=0.5)


@given(cameras, units, st.tuples(st.floats(-20, 20), st.floats(-20, 20)))
def test_what_swings_goes_to_the_cursor_on_its_sphere(camera: Camera, towards, way) -> None:
    picture = picture_of(camera)
    begin_um = np.array(HERE_UM) + 4000 * np.array(towards)
    found_um = np.array(
        SpherePath(vector(begin_um), HERE_UM).follow(picture, *(place(picture, begin_um)[:2] + way))
    )
    assert np.linalg.norm(found_um - HERE_UM) == pytest.approx(4000)
    to = place(picture, begin_um)[:2] + way
    ray = picture.ray(*to)
    apart = np.linalg.norm(np.cross(np.subtract(HERE_UM, ray.origin_um), ray.direction))
    if apart < 3990:
        assert place(picture, found_um)[:2] == pytest.approx(to, abs=1e-3)


def test_far_beside_a_sphere_the_cursor_leads_to_its_outline() -> None:
    path = SpherePath(vector(np.add(HERE_UM, (0.0, 0.0, 4000.0))), HERE_UM)
    found_um = path.follow(picture_of(HOME), 5, 250)
    outwards = np.subtract(found_um, HERE_UM)
    assert np.linalg.norm(outwards) == pytest.approx(4000)
    assert outwards @ np.array(HOME.forward) == pytest.approx(0, abs=1e-6)


def test_each_handle_has_the_path_of_what_it_does() -> None:
    free = Handle("center", "move", HERE_UM, "#ffffff", "")
    aside_um, axis = (8000.0, 13_000.0, 5000.0), (1.0, 0.0, 0.0)
    assert isinstance(handle_path(free), PlanePath)
    assert isinstance(handle_path(replace(free, axis=axis)), LinePath)
    assert isinstance(handle_path(replace(free, pivot_um=aside_um)), SpherePath)
    assert isinstance(handle_path(replace(free, pivot_um=aside_um, axis=axis)), CirclePath)
