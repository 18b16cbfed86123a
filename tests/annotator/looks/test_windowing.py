"""A drag changes window and level so that dragging back undoes it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.looks.windowing import E_FOLD_PX, LEVEL_WIDTH_PX, dragged_window

WINDOW = (20.0, 120.0)


def test_sideways_is_width_and_up_is_brighter() -> None:
    low, high = dragged_window(WINDOW, E_FOLD_PX, 0)
    assert (high - low, (low + high) / 2) == pytest.approx((271.8281828, 70.0))
    assert dragged_window(WINDOW, 0, -LEVEL_WIDTH_PX) == pytest.approx((-80.0, 20.0))


@given(st.floats(-500, 500), st.floats(-500, 500))
def test_a_window_keeps_its_order(right_px: float, down_px: float) -> None:
    low, high = dragged_window(WINDOW, right_px, down_px)
    assert low < high


@given(st.floats(-500, 500))
def test_dragging_back_undoes(px: float) -> None:
    assert dragged_window(dragged_window(WINDOW, px, 0), -px, 0) == pytest.approx(WINDOW)
    assert dragged_window(dragged_window(WINDOW, 0, px), 0, -px) == pytest.approx(WINDOW)
