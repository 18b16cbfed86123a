"""The camera's motions: pure functions, each a promise about what stays and what moves."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.scene.camera import (
    PRESETS,
    Camera,
    aimed,
    fitted,
    preset,
    shifted,
    turned,
    zoomed,
)
from annotator.scene.picking import Picture
from annotator.session.viewing.view import Preset

LOW, HIGH = (0.0, 0.0, 0.0), (17400.0, 26100.0, 10800.0)
WIDTH_PX, HEIGHT_PX = 800.0, 600.0
parts = st.floats(-2, 2)


def home(*, parallel: bool = True) -> Camera:
    return replace(preset("home", LOW, HIGH, 2, WIDTH_PX / HEIGHT_PX), parallel=parallel)


def corners_px(camera: Camera) -> np.ndarray:
    corners = list(product(*zip(LOW, HIGH, strict=True)))
    return Picture(camera, WIDTH_PX, HEIGHT_PX).project(corners)[:, :2]


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("depth_axis", [0, 1, 2])
@pytest.mark.parametrize("parallel", [True, False])
def test_presets_fit_the_whole_box_and_little_more(name: Preset, depth_axis: int, parallel: bool) -> None:
    camera = replace(preset(name, LOW, HIGH, depth_axis, WIDTH_PX / HEIGHT_PX), parallel=parallel)
    places = corners_px(fitted(camera, LOW, HIGH, WIDTH_PX / HEIGHT_PX))
    size = np.array((WIDTH_PX, HEIGHT_PX))
    assert np.all(places > 0)
    assert np.all(places < size)
    used = np.ptp(places, axis=0) / size
    assert used.max() > 0.8


@pytest.mark.parametrize(("name", "axis", "sign"), [("+x", 0, 1), ("-x", 0, -1), ("+z", 2, 1), ("-y", 1, -1)])
def test_a_preset_looks_along_its_axis(name: Preset, axis: int, sign: int) -> None:
    forward = np.zeros(3)
    forward[axis] = sign
    assert preset(name, LOW, HIGH, 2, 1.0).forward == pytest.approx(forward)


def test_depth_runs_down_in_the_picture() -> None:
    for name in ("home", "+x", "-x", "+y", "-y"):
        picture = Picture(preset(name, LOW, HIGH, 2, 1.0), WIDTH_PX, HEIGHT_PX)
        shallow, deep = picture.project([(1000, 1000, 0), (1000, 1000, 5000)])
        assert deep[1] > shallow[1]
        assert deep[0] == pytest.approx(shallow[0], abs=0.01)


@given(parts, parts)
def test_turning_keeps_the_focal_point_and_right_angles(right: float, down: float) -> None:
    camera = turned(home(), right, down)
    axes = np.array((camera.right, camera.up, camera.forward))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-9)
    assert (camera.focal_um, camera.height_um) == (home().focal_um, home().height_um)


@given(st.floats(-0.2, 0.2))
def test_turning_follows_the_mouse(right: float) -> None:
    camera = home()
    nearest = np.asarray(camera.focal_um) - 3000 * np.asarray(camera.forward)
    before, after = (
        Picture(seen, WIDTH_PX, HEIGHT_PX).project([nearest])[0]
        for seen in (camera, turned(camera, right, 0))
    )
    assert np.sign(after[0] - before[0]) == np.sign(right) or abs(right) < 1e-6


@given(st.floats(-300, 300), st.floats(-300, 300), st.booleans())
def test_shifting_moves_the_focal_plane_with_the_mouse(
    right_px: float, down_px: float, parallel: bool
) -> None:
    camera = home(parallel=parallel)
    picture = Picture(camera, WIDTH_PX, HEIGHT_PX)
    moved = shifted(camera, right_px * picture.um_per_px, down_px * picture.um_per_px)
    place = Picture(moved, WIDTH_PX, HEIGHT_PX).project([camera.focal_um])[0]
    assert place[:2] == pytest.approx((WIDTH_PX / 2 + right_px, HEIGHT_PX / 2 + down_px), abs=1e-6)


@given(st.floats(0.2, 5), st.floats(0, WIDTH_PX), st.floats(0, HEIGHT_PX), st.booleans())
def test_zooming_keeps_the_point_under_the_cursor(
    factor: float, x_px: float, y_px: float, parallel: bool
) -> None:
    camera = home(parallel=parallel)
    picture = Picture(camera, WIDTH_PX, HEIGHT_PX)
    ray = picture.ray(x_px, y_px)
    along = (np.asarray(camera.focal_um) - ray.origin_um) @ camera.forward
    under_cursor = ray.at(along / float(np.dot(ray.direction, camera.forward)))
    closer = zoomed(camera, factor, *picture.from_middle_um(x_px, y_px))
    place = Picture(closer, WIDTH_PX, HEIGHT_PX).project([under_cursor])[0]
    assert place[:2] == pytest.approx((x_px, y_px), abs=1e-5)
    assert closer.height_um == pytest.approx(camera.height_um / factor)


def test_zooming_ends_before_nothing_can_be_seen() -> None:
    assert zoomed(home(), 1e12).height_um == pytest.approx(10.0)
    assert zoomed(home(), 1e-12).height_um == pytest.approx(20 * home().scope_um)


def test_aiming_brings_a_position_to_the_middle_without_turning() -> None:
    camera = aimed(home(), (1000.0, 2000.0, 3000.0), 4000.0)
    place = Picture(camera, WIDTH_PX, HEIGHT_PX).project([(1000.0, 2000.0, 3000.0)])[0]
    assert place[:2] == pytest.approx((WIDTH_PX / 2, HEIGHT_PX / 2))
    assert (camera.forward, camera.up) == (home().forward, home().up)


@given(st.floats(-1, 1), st.floats(-1, 1), st.booleans(), st.floats(0.05, 20))
def test_nothing_of_the_volume_is_clipped(right: float, down: float, parallel: bool, factor: float) -> None:
    camera = zoomed(turned(home(parallel=parallel), right, down), factor)
    near_um, far_um = camera.clipping_um
    corners = np.array(list(product(*zip(LOW, HIGH, strict=True))))
    depths_um = (corners - camera.eye_um) @ camera.forward
    assert 0 < near_um < far_um
    assert depths_um.max() < far_um
    if parallel:
        assert depths_um.min() > near_um
