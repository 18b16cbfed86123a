"""The scale bar's lengths are round, fit, and say their unit."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtGui import QColor, QFont

from annotator.scene.scale_bar_layer import bar_picture, length_text, round_length_um


@given(st.floats(1e-3, 1e6))
def test_the_length_is_round_and_the_longest_that_fits(longest_um: float) -> None:
    length_um = round_length_um(longest_um)
    assert length_um <= longest_um * (1 + 1e-6)
    assert length_um > longest_um / 2.5 * (1 - 1e-6)
    digit = length_um / 10 ** math.floor(math.log10(length_um) + 1e-9)
    assert digit == pytest.approx(round(digit))
    assert round(digit) in (1, 2, 5)


@pytest.mark.parametrize(
    ("length_um", "text"), [(5000.0, "5 mm"), (1000.0, "1 mm"), (500.0, "500 µm"), (0.2, "0.2 µm")]
)
def test_lengths_read_as_a_person_writes_them(length_um: float, text: str) -> None:
    assert length_text(length_um) == text


def test_the_bar_is_as_long_as_it_says(qapp: object) -> None:
    image = bar_picture(100.0, (140.0, 30.0), "5 mm", QFont(), 1.0)
    row = [image.pixelColor(x, 26) for x in range(image.width())]
    white = [x for x, color in enumerate(row) if color.alpha() == 255 and color.lightness() > 200]
    assert len(white) == pytest.approx(100, abs=1)
    assert QColor(row[0]).alpha() == 0
