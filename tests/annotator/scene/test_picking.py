"""Pixels and micrometres: rays and projections undo each other, and agree with VTK's own matrices."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.scene.camera import VIEW_ANGLE_DEG, preset, turned, zoomed
from annotator.scene.picking import Picture

LOW, HIGH = (0.0, 0.0, 0.0), (17400.0, 26100.0, 10800.0)
WIDTH_PX, HEIGHT_PX = 801.0, 600.0

positions = st.tuples(*(st.floats(low, high) for low, high in zip(LOW, HIGH, strict=True)))
parts = st.floats(-1, 1)


def picture(
    right: float = 0.1, down: float = -0.05, factor: float = 1.0, *, parallel: bool = True
) -> Picture:
    camera = replace(preset("home", LOW, HIGH, 2, WIDTH_PX / HEIGHT_PX), parallel=parallel)
    return Picture(zoomed(turned(camera, right, down), factor), WIDTH_PX, HEIGHT_PX)


@given(positions, parts, parts, st.floats(0.3, 2), st.booleans())
def test_the_ray_through_a_projected_position_passes_through_it(
    position: tuple[float, float, float], right: float, down: float, factor: float, parallel: bool
) -> None:
    seen = picture(right, down, factor, parallel=parallel)
    x_px, y_px, _ = seen.project([position])[0]
    if np.isnan(x_px):
        return  # behind the eye
    ray = seen.ray(x_px, y_px)
    along = (np.asarray(position) - ray.origin_um) @ ray.direction
    assert ray.at(float(along)) == pytest.approx(position, abs=1e-3)
    assert along > 0


@given(positions, parts, parts, st.booleans())
def test_projection_agrees_with_vtk(
    position: tuple[float, float, float], right: float, down: float, parallel: bool
) -> None:
    from vtkmodules.vtkRenderingCore import vtkCamera

    seen = picture(right, down, parallel=parallel)
    camera = vtkCamera()
    camera.SetFocalPoint(seen.camera.focal_um)
    camera.SetPosition(seen.camera.eye_um)
    camera.SetViewUp(seen.camera.up)
    camera.SetParallelProjection(parallel)
    camera.SetParallelScale(seen.camera.height_um / 2)
    camera.SetViewAngle(VIEW_ANGLE_DEG)
    camera.SetClippingRange(seen.camera.clipping_um)
    matrix = camera.GetCompositeProjectionTransformMatrix(WIDTH_PX / HEIGHT_PX, -1, 1)
    x, y, _, w = matrix.MultiplyPoint((*position, 1.0))
    expected = (WIDTH_PX * (1 + x / w) / 2, HEIGHT_PX * (1 - y / w) / 2)
    assert seen.project([position])[0, :2] == pytest.approx(expected, abs=1e-3)


def test_what_is_behind_the_eye_is_nowhere() -> None:
    seen = picture(parallel=False)
    behind = np.asarray(seen.camera.eye_um) - 100 * np.asarray(seen.camera.forward)
    assert np.isnan(seen.project([behind])[0, :2]).all()
    assert seen.nearest({"k0": tuple(behind)}, WIDTH_PX / 2, HEIGHT_PX / 2, 1e9) is None


def test_depth_grows_away_from_the_eye() -> None:
    seen = picture()
    near, far = (
        np.asarray(seen.camera.focal_um) + step * np.asarray(seen.camera.forward) for step in (-10, 20)
    )
    assert seen.project([near, far])[:, 2] == pytest.approx((-10, 20))


def test_the_nearest_keypoint_within_the_radius_is_found() -> None:
    seen = picture()
    positions_um = {"k0": (1000.0, 2000.0, 3000.0), "k1": (9000.0, 20000.0, 5000.0)}
    x_px, y_px, _ = seen.project([positions_um["k1"]])[0]
    assert seen.nearest(positions_um, x_px + 5, y_px, 6) == "k1"
    assert seen.nearest(positions_um, x_px + 7, y_px, 6) is None
    assert seen.nearest({}, x_px, y_px, 6) is None


def test_a_scale_holds_at_every_depth_in_parallel_projection() -> None:
    seen = picture()
    step = 1000 * np.asarray(seen.camera.right)
    for depth in (-5000, 0, 5000):
        start = np.asarray(seen.camera.focal_um) + depth * np.asarray(seen.camera.forward)
        first, second = seen.project([start, start + step])
        assert (second[0] - first[0]) * seen.um_per_px == pytest.approx(1000)
