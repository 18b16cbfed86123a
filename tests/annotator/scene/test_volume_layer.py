"""Intensities as VTK gets them: nothing out of range, whatever the volume holds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from annotator.scene.volume_layer import MOVING_RAY_PX, next_moving_ray_px, stored_intensities


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_unsigned_integers_are_not_copied(dtype: type) -> None:
    data = np.arange(24, dtype=dtype).reshape(2, 3, 4)
    stored, scale = stored_intensities(data)
    assert np.shares_memory(stored, data)
    assert scale.of(17.0) == 17.0


@given(hnp.arrays(np.float32, (2, 3, 4), elements=st.floats(-(2.0**100), 2.0**100, width=32)))
def test_order_is_kept_and_the_scale_says_where_an_intensity_went(data: np.ndarray) -> None:
    stored, scale = stored_intensities(data)
    assert stored.dtype == np.uint16
    order = np.argsort(data, axis=None, kind="stable")
    assert np.all(np.diff(stored.ravel()[order].astype(int)) >= 0)
    for value, kept in zip(data.ravel(), stored.ravel(), strict=True):
        assert scale.of(float(value)) == pytest.approx(float(kept), abs=1.0)


def test_what_is_not_finite_is_kept_in_range() -> None:
    data = np.array([[[np.nan, -np.inf, np.inf, 5.0, 10.0]]], dtype=np.float32)
    stored, scale = stored_intensities(data)
    assert stored.ravel().tolist() == [0, 0, 65535, 0, 65535]
    assert (scale.of(5.0), scale.of(10.0)) == (0.0, 65535.0)


@pytest.mark.parametrize("value", [np.nan, 7.0])
def test_a_volume_of_one_value_is_drawn_too(value: float) -> None:
    stored, scale = stored_intensities(np.full((2, 2, 2), value, dtype=np.float32))
    assert np.all(stored == 0)
    assert np.isfinite(scale.of(3.0))


def test_signed_integers_keep_their_differences() -> None:
    data = np.array([[[-300, 0, 300]]], dtype=np.int16)
    stored, scale = stored_intensities(data)
    assert stored.ravel().tolist() == [0, 32768, 65535]
    assert scale.of(-300.0) == 0.0


def test_slow_frames_get_fewer_rays_and_fast_ones_get_them_back() -> None:
    slow = next_moving_ray_px(MOVING_RAY_PX, 0.3)
    assert slow > MOVING_RAY_PX
    assert next_moving_ray_px(slow, 0.05) == slow
    assert next_moving_ray_px(slow, 0.01) == MOVING_RAY_PX
    assert next_moving_ray_px(slow, 100.0) <= 8
    assert next_moving_ray_px(MOVING_RAY_PX, 0.001) == MOVING_RAY_PX
