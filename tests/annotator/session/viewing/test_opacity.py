"""What is seen along a ray is what is picked: haze is passed, the body behind it is met."""

import numpy as np
import pytest

from annotations.volumes import Level, Ray
from annotator.session.viewing.opacity import FAINT, OPAQUE, opacity, seen_surface
from annotator.session.viewing.view import View

VIEW = View(window=(0.0, 200.0), opacity_threshold=40.0)
DOWN = Ray((100.0, 100.0, -500.0), (0.0, 0.0, 1.0))


def level(data: np.ndarray) -> Level:
    return Level(data, (10.0, 10.0, 10.0), (0.0, 0.0, 0.0), "averaged", (1, 1, 1))


def slab(first: int = 50) -> np.ndarray:
    data = np.zeros((21, 21, 80), np.float32)
    data[:, :, first : first + 20] = 200
    return data


def test_opacity_rises_from_the_threshold_to_the_windows_end() -> None:
    values = opacity([0, 39.9, 40, 120, 200, 1000, np.nan, np.inf], VIEW)
    assert values == pytest.approx([0, 0, FAINT, (FAINT + OPAQUE) / 2, OPAQUE, OPAQUE, 0, OPAQUE])


def test_a_threshold_beyond_the_window_is_a_step() -> None:
    values = opacity([249, 251], View(window=(0.0, 200.0), opacity_threshold=250.0))
    assert values[0] == 0
    assert values[1] == pytest.approx(OPAQUE)


def test_a_clean_surface_is_where_the_threshold_is_crossed() -> None:
    found = seen_surface(level(slab()), DOWN, VIEW)
    assert found == pytest.approx((100, 100, 492), abs=0.1)


def test_a_speck_of_noise_before_the_body_is_passed() -> None:
    data = slab()
    data[10, 10, 5] = 60
    data[10, 10, 20] = 45
    assert seen_surface(level(data), DOWN, VIEW) == pytest.approx((100, 100, 492), abs=0.1)


def test_a_body_before_another_hides_it() -> None:
    data = slab()
    data[:, :, 20:26] = 180
    found = seen_surface(level(data), DOWN, VIEW)
    assert found is not None
    assert 190 < found[2] < 200


def test_nothing_is_met_where_nothing_is_seen() -> None:
    assert seen_surface(level(np.zeros((21, 21, 80), np.uint8)), DOWN, VIEW) is None
    beside = Ray((100.0, 100.0, -500.0), (1.0, 0.0, 0.0))
    assert seen_surface(level(slab()), beside, VIEW) is None
    faint = np.zeros((21, 21, 80), np.float32)
    faint[10, 10, 40] = 41
    assert seen_surface(level(faint), DOWN, VIEW) is None


def test_what_is_not_a_number_is_not_seen() -> None:
    data = slab()
    data[:, :, 10:30] = np.nan
    found = seen_surface(level(data), DOWN, VIEW)
    assert found == pytest.approx((100, 100, 492), abs=0.1)


def test_a_slanted_ray_meets_the_same_surface() -> None:
    slanted = Ray.through((20.0, 60.0, -300.0), (100.0, 100.0, 490.0))
    found = seen_surface(level(slab()), slanted, VIEW)
    assert found is not None
    assert found[2] == pytest.approx(492, abs=0.1)


def test_a_ray_that_starts_inside_the_body_meets_it_at_once() -> None:
    assert seen_surface(level(slab(0)), DOWN, VIEW) == pytest.approx((100, 100, 0))
