"""Where the projections lie."""

import hypothesis.strategies as st
import pytest
from hypothesis import given
from PySide6.QtCore import QRectF

from annotator.dialogs.live.live_layout import lie, panes

lengths = st.floats(1000.0, 50_000.0)


@given(
    st.tuples(lengths, lengths, lengths),
    st.sampled_from([0, 1, 2]),
    st.floats(300, 2000),
    st.floats(200, 1200),
)
def test_all_are_drawn_at_one_scale_apart_from_each_other_within_the_room(
    extent_um: tuple[float, float, float], depth_axis: int, width: float, height: float
) -> None:
    room = QRectF(8, 8, width, height)

    shown = panes((-10.0, 20.0, 30.0), extent_um, depth_axis, room, 10.0)

    assert [pane.axis for pane in shown] == [0, 1, 2]
    for pane in shown:
        assert pane.area.width() / extent_um[pane.horizontal] == pytest.approx(pane.scale)
        assert pane.area.height() / extent_um[pane.vertical] == pytest.approx(pane.scale)
        assert room.adjusted(-0.01, -0.01, 0.01, 0.01).contains(pane.area)
        corner = pane.pixel((-10.0, 20.0, 30.0))
        assert (corner.x(), corner.y()) == pytest.approx((pane.area.left(), pane.area.top()))
    for first in shown:
        for second in shown:
            if first is not second:
                assert not first.area.adjusted(0.1, 0.1, -0.1, -0.1).intersects(second.area)


def test_depth_runs_downwards_and_the_scanner_looks_along_it() -> None:
    assert [lie(axis, 2) for axis in range(3)] == [(1, 2), (0, 2), (0, 1)]
    assert [lie(axis, 0) for axis in range(3)] == [(1, 2), (2, 0), (1, 0)]
