"""Intensities as VTK gets them: nothing out of range, whatever the volume holds."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from annotations.volumes.stored_intensities import stored_intensities


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_unsigned_integers_are_not_copied(dtype: type) -> None:
    data = np.arange(24, dtype=dtype).reshape(2, 3, 4)
    stored = stored_intensities(data)
    assert stored.values is data
    assert stored.of(17.0) == 17.0


@pytest.mark.parametrize("values", [[np.nan, np.nan], [7.0, np.nan], [7.0, 9.0]])
@pytest.mark.parametrize("order", ["C", "F"])
def test_the_order_in_memory_stays(order: Literal["C", "F"], values: list[float]) -> None:
    data = np.array(np.resize(values, (2, 3, 4)), np.float32, order=order)
    stored = stored_intensities(data).values
    assert (stored.flags.c_contiguous, stored.flags.f_contiguous) == (order == "C", order == "F")


@given(hnp.arrays(np.float32, (2, 3, 4), elements=st.floats(-(2.0**100), 2.0**100, width=32)))
def test_order_is_kept_and_the_scale_says_where_an_intensity_went(data: np.ndarray) -> None:
    stored = stored_intensities(data)
    assert stored.values.dtype == np.uint16
    order = np.argsort(data, axis=None, kind="stable")
    assert np.all(np.diff(stored.values.ravel()[order].astype(int)) >= 0)
    for value, kept in zip(data.ravel(), stored.values.ravel(), strict=True):
        assert stored.of(float(value)) == pytest.approx(float(kept), abs=1.0)


def test_what_is_not_finite_is_kept_in_range() -> None:
    stored = stored_intensities(np.array([[[np.nan, -np.inf, np.inf, 5.0, 10.0]]], dtype=np.float32))
    assert stored.values.ravel().tolist() == [0, 0, 65535, 0, 65535]
    assert (stored.of(5.0), stored.of(10.0)) == (0.0, 65535.0)


@pytest.mark.parametrize("value", [np.nan, 7.0])
def test_a_volume_of_one_value_is_drawn_too(value: float) -> None:
    stored = stored_intensities(np.full((2, 2, 2), value, dtype=np.float32))
    assert np.all(stored.values == 0)
    assert np.isfinite(stored.of(3.0))


def test_signed_integers_keep_their_differences() -> None:
    stored = stored_intensities(np.array([[[-300, 0, 300]]], dtype=np.int16))
    assert stored.values.ravel().tolist() == [0, 32768, 65535]
    assert stored.of(-300.0) == 0.0
