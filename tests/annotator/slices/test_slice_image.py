import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PySide6.QtGui import QColor

from annotator.slices.slice_image import NAN_RGB, color_table, image, indices

GRAY = np.stack([np.arange(256, dtype=np.uint8)] * 3 + [np.full(256, 255, np.uint8)], axis=1)


def gray_values(data: np.ndarray, window: tuple[float, float]) -> np.ndarray:
    """The grey values with which a slice is drawn."""
    drawn = image(indices(data, window), color_table(GRAY, window, data.dtype))
    return np.array(
        [[QColor(drawn.pixel(x, y)).red() for x in range(drawn.width())] for y in range(drawn.height())]
    )


@pytest.mark.parametrize(
    "dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", ">u2", ">f4"]
)
def test_the_window_spans_black_to_white_for_every_type(dtype: str) -> None:
    data = np.array([[0, 10, 60, 110, 120]], dtype=dtype)

    grays = gray_values(data, (10, 110))

    assert grays[0, [0, 1, 3, 4]].tolist() == [0, 0, 255, 255]
    assert abs(int(grays[0, 2]) - 128) <= 1


def test_another_window_leaves_bytes_untouched() -> None:
    data = np.arange(6, dtype=np.uint8).reshape(2, 3)

    assert indices(data, (0, 5)) is data
    assert indices(data, (2, 3)) is data


def test_what_is_not_a_number_has_a_colour_of_its_own_and_infinities_are_ends() -> None:
    data = np.array([[np.nan, -np.inf, np.inf, 0.5]], np.float32)

    drawn = image(indices(data, (0, 1)), color_table(GRAY, (0, 1), data.dtype))

    assert QColor(drawn.pixel(0, 0)).getRgb()[:3] == NAN_RGB
    assert [QColor(drawn.pixel(x, 0)).red() for x in (1, 2)] == [0, 255]
    assert QColor(drawn.pixel(3, 0)).getRgb()[:3] == (128, 128, 128)


def test_rows_and_columns_stay_what_they_are_even_of_a_part() -> None:
    whole = np.zeros((5, 9), np.uint8)
    whole[3, 7] = 200

    part = image(whole[2:5, 4:9], color_table(GRAY, (0, 255), whole.dtype))

    assert (part.width(), part.height()) == (5, 3)
    assert QColor(part.pixel(3, 1)).red() == 200
    assert sum(QColor(part.pixel(x, y)).red() for x in range(5) for y in range(3)) == 200


@given(
    data=hnp.arrays(
        st.sampled_from([np.float32, np.float64, np.int32, np.uint16, np.uint8]),
        (3, 4),
    ),
    low=st.floats(-1e9, 1e9),
    width=st.floats(0, 1e9),
)
def test_no_slice_and_no_window_upsets_it(data: np.ndarray, low: float, width: float) -> None:
    window = (low, low + width)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = indices(data, window)
        table = color_table(GRAY, window, data.dtype)

    assert made.dtype == np.uint8
    assert made.shape == data.shape
    assert len(table) == 256
    if data.dtype.kind == "f":
        assert ((made == 255) == np.isnan(data)).all()


@given(
    values=st.lists(st.integers(0, 65535), min_size=2, max_size=20),
    window=st.tuples(st.integers(0, 30000), st.integers(30001, 65535)),
)
def test_brighter_is_never_drawn_darker(values: list[int], window: tuple[int, int]) -> None:
    data = np.sort(np.array([values], np.uint16))

    grays = gray_values(data, (float(window[0]), float(window[1])))

    assert (np.diff(grays) >= 0).all()
