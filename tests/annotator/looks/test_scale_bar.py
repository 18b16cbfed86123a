"""The scale bar's lengths are round, fit, and say their unit."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.looks.scale_bar import length_text, round_length_um


@pytest.mark.parametrize(
    ("longest_um", "length_um"),
    [(1, 1), (1.99, 1), (2, 2), (4.9, 2), (5, 5), (9.9, 5), (740, 500), (0.013, 0.01)],
)
def test_lengths_are_round(longest_um: float, length_um: float) -> None:
    assert round_length_um(longest_um) == pytest.approx(length_um)


@given(st.floats(1e-3, 1e6))
def test_the_length_is_round_and_the_longest_that_fits(longest_um: float) -> None:
    length_um = round_length_um(longest_um)
    assert longest_um / 2.5 * (1 - 1e-6) < length_um <= longest_um * (1 + 1e-6)
    digit = length_um / 10 ** math.floor(math.log10(length_um) + 1e-9)
    assert digit == pytest.approx(round(digit))
    assert round(digit) in (1, 2, 5)


@pytest.mark.parametrize(
    ("length_um", "text"), [(5000.0, "5 mm"), (1000.0, "1 mm"), (500.0, "500 µm"), (0.2, "0.2 µm")]
)
def test_lengths_read_as_a_person_writes_them(length_um: float, text: str) -> None:
    assert length_text(length_um) == text
