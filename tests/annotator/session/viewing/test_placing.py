"""Where clicks in the scene put a keypoint, in numbers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from annotations.geometry.frames import is_inside
from annotations.volumes import Level, Ray
from annotator.session.viewing import placing
from annotator.session.viewing.view import View

unit_vectors = (
    hnp.arrays(float, 3, elements=st.floats(-1, 1))
    .filter(lambda values: np.linalg.norm(values) > 0.1)
    .map(lambda values: values / np.linalg.norm(values))
)
points_um = hnp.arrays(float, 3, elements=st.floats(-5000, 5000))


def slab_level() -> Level:
    """A level of 10 µm voxels, empty but for a slab of 100 at z 200–290 µm and a brighter plane at 250 µm."""
    data = np.zeros((30, 30, 50), np.uint8)
    data[:, :, 20:30] = 100
    data[:, :, 25] = 200
    return Level(
        data=data, spacing_um=(10.0, 10.0, 10.0), origin_um=(0.0, 0.0, 0.0), kind="strided", factors=(1, 1, 1)
    )


DOWN = Ray((100.0, 100.0, -500.0), (0.0, 0.0, 1.0))


def test_a_projection_takes_the_brightest_sample_and_a_volume_its_first_surface() -> None:
    level = slab_level()
    surface = placing.depth_along_ray(level, DOWN, View(opacity_threshold=50.0))
    brightest = placing.depth_along_ray(level, DOWN, View(rendering="mip"))
    assert surface == pytest.approx((100.0, 100.0, 195.0), abs=5.1)
    assert brightest == pytest.approx((100.0, 100.0, 250.0), abs=5.1)


def test_a_click_does_not_meet_what_is_cropped_away() -> None:
    view = View(opacity_threshold=50.0, cropping_um=((0.0, 0.0, 240.0), (290.0, 290.0, 490.0)))
    assert placing.depth_along_ray(slab_level(), DOWN, view) == pytest.approx((100.0, 100.0, 240.0), abs=0.1)
    beyond = View(opacity_threshold=50.0, cropping_um=((0.0, 0.0, 300.0), (290.0, 290.0, 490.0)))
    assert placing.depth_along_ray(slab_level(), DOWN, beyond) is None


@given(points_um, unit_vectors, unit_vectors)
def test_two_rays_through_one_point_settle_on_it(
    target_um: np.ndarray, first: np.ndarray, second: np.ndarray
) -> None:
    rays = [Ray(tuple(target_um - 9000 * direction), tuple(direction)) for direction in (first, second)]
    angle_deg = np.degrees(np.arccos(np.clip(abs(first @ second), 0, 1)))
    settled = placing.settle(rays[0], rays[1])
    if angle_deg > placing.SMALLEST_ANGLE_DEG + 0.1:
        assert settled.position_um == pytest.approx(tuple(target_um), abs=1e-3)
    elif angle_deg < placing.SMALLEST_ANGLE_DEG - 0.1:
        assert settled.position_um is None


def test_two_rays_of_one_picture_in_perspective_settle_nothing_at_the_eye() -> None:
    aside = Ray(DOWN.origin_um, (0.4, 0.0, 1.0))
    assert placing.is_seen_alike(DOWN, aside)
    assert placing.settle(DOWN, aside).position_um is None


def test_rays_that_miss_each_other_settle_nothing_and_say_by_how_much() -> None:
    second = Ray((-500.0, 100.0 + placing.WIDEST_GAP_UM + 1, 0.0), (1.0, 0.0, 0.0))
    settled = placing.settle(DOWN, second)
    assert settled.position_um is None
    assert "501 µm" in settled.reason


@given(points_um)
def test_the_crosshair_stays_in_the_volume_and_where_it_can(position_um: np.ndarray) -> None:
    shape, spacing_um = (40, 60, 50), (15.9, 13.5, 9.4)
    clipped = placing.clipped_crosshair(tuple(position_um), shape, spacing_um)
    assert is_inside(clipped, shape, spacing_um)
    assert placing.clipped_crosshair(clipped, shape, spacing_um) == pytest.approx(clipped)
