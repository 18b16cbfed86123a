"""The histogram: honest counts, and limits that are dragged."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as numpy_st
from PySide6.QtCore import QPoint, Qt
from pytestqt.qtbot import QtBot

from annotator.panels.display.histogram import EMPTY, HistogramView, IntensityHistogram, intensity_histogram

LEFT = Qt.MouseButton.LeftButton


@given(
    numpy_st.arrays(
        st.sampled_from([np.uint8, np.int8, np.uint16, np.int16, np.float32]),
        numpy_st.array_shapes(min_dims=3, max_dims=3, max_side=6),
    )
)
def test_every_finite_intensity_is_counted_once(data: np.ndarray) -> None:
    histogram = intensity_histogram(data)
    assert histogram.counts.sum() == np.isfinite(data).sum()
    assert histogram.low < histogram.high
    assert histogram.step > 0


def test_bytes_have_the_range_of_their_type() -> None:
    histogram = intensity_histogram(np.full((3, 3, 3), 7, np.uint8))
    assert (histogram.low, histogram.high, histogram.step) == (0.0, 255.0, 1.0)


def test_other_types_have_the_range_of_the_data() -> None:
    histogram = intensity_histogram(np.linspace(-2, 3, 27, dtype=np.float32).reshape(3, 3, 3))
    assert (histogram.low, histogram.high) == (-2.0, 3.0)
    assert not histogram.integral


def test_nothing_finite_gives_an_empty_histogram() -> None:
    assert intensity_histogram(np.full((2, 2, 2), np.nan, np.float32)) is EMPTY


def test_a_large_array_is_sampled() -> None:
    histogram = intensity_histogram(np.zeros((200, 100, 100), np.uint8))
    assert 0 < histogram.counts.sum() <= 1_000_000


@pytest.fixture
def view(qtbot: QtBot) -> HistogramView:
    view = HistogramView()
    qtbot.addWidget(view)
    view.resize(268, 60)
    view.set_histogram(IntensityHistogram(np.arange(128), 0.0, 256.0, True))
    view.set_limits((50.0, 200.0), 120.0)
    view.show()
    return view


def drag(qtbot: QtBot, view: HistogramView, begin: float, end: float) -> None:
    first, last = (QPoint(round(view.x_of(value)), 30) for value in (begin, end))
    qtbot.mousePress(view, LEFT, pos=first)
    qtbot.mouseMove(view, last)
    qtbot.mouseRelease(view, LEFT, pos=last)


def test_an_intensity_is_where_it_is_drawn(view: HistogramView) -> None:
    for intensity in (0.0, 13.0, 200.0, 256.0):
        assert view.intensity_at(view.x_of(intensity)) == pytest.approx(intensity)


@pytest.mark.parametrize(
    ("begin", "end", "expected"),
    [
        (50.0, 20.0, (20.0, 200.0)),
        (200.0, 230.0, (50.0, 230.0)),
        (80.0, 100.0, (70.0, 220.0)),
        (50.0, 240.0, (199.0, 200.0)),
        (200.0, 10.0, (50.0, 51.0)),
    ],
)
def test_limits_and_the_part_between_them_are_dragged(
    qtbot: QtBot, view: HistogramView, begin: float, end: float, expected: tuple[float, float]
) -> None:
    with qtbot.waitSignal(view.window_requested) as asked:
        drag(qtbot, view, begin, end)
    assert asked.args == pytest.approx(expected, abs=1)


def test_the_threshold_is_dragged(qtbot: QtBot, view: HistogramView) -> None:
    with qtbot.waitSignal(view.threshold_requested) as asked:
        drag(qtbot, view, 120.0, 150.0)
    assert asked.args == pytest.approx([150.0], abs=1)


def test_nothing_happens_beside_the_window_or_without_a_press(qtbot: QtBot, view: HistogramView) -> None:
    with qtbot.assertNotEmitted(view.window_requested), qtbot.assertNotEmitted(view.threshold_requested):
        drag(qtbot, view, 240.0, 220.0)
        qtbot.mouseMove(view, QPoint(round(view.x_of(100.0)), 30))
        qtbot.mousePress(view, Qt.MouseButton.RightButton, pos=QPoint(round(view.x_of(50.0)), 30))


def test_the_cursor_says_what_can_be_dragged(qtbot: QtBot, view: HistogramView) -> None:
    for intensity, shape in (
        (50.0, Qt.CursorShape.SizeHorCursor),
        (85.0, Qt.CursorShape.OpenHandCursor),
        (240.0, Qt.CursorShape.ArrowCursor),
    ):
        qtbot.mouseMove(view, QPoint(round(view.x_of(intensity)), 30))
        qtbot.waitUntil(lambda wanted=shape: view.cursor().shape() == wanted)


def test_common_intensities_stand_higher(view: HistogramView) -> None:
    image = view.grab().toImage()
    background = image.pixelColor(260, 3)

    def height(intensity: float) -> int:
        x = round(view.x_of(intensity))
        return sum(image.pixelColor(x, y) != background for y in range(4, 58))

    assert height(250.0) > height(215.0) > 0
