"""What a person types is read as meant, or refused with a reason."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotator.looks.typed_numbers import (
    NotUnderstood,
    parse_length_um,
    parse_number,
    parse_size_um,
    split_triple,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(FINITE)
def test_every_number_written_by_python_is_read_back(value: float) -> None:
    assert parse_number(f"  {value!r} ") == value


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "Type a number"),
        ("   ", "Type a number"),
        ("12,5", "point"),
        ("1,234.5", "point"),
        ("abc", "not a number"),
        ("1_000", "not a number"),
        ("12 5", "not a number"),
        ("nan", "finite"),
        ("1e999", "finite"),
        ("-inf", "finite"),
    ],
)
def test_wrong_text_is_refused_with_a_reason(text: str, reason: str) -> None:
    with pytest.raises(NotUnderstood, match=reason):
        parse_number(text)


@pytest.mark.parametrize(
    ("text", "unit", "expected_um"),
    [
        ("12.5", "um", 12.5),
        ("12.5", "voxel", 125.0),
        ("12.5 µm", "voxel", 12.5),
        ("9.35 mm", "um", 9350.0),
        ("2MM", "voxel", 2000.0),
        ("3 voxels", "um", 30.0),
        ("3vx", "um", 30.0),
        ("−4", "um", -4.0),
        ("1e3", "um", 1000.0),
    ],
)
def test_a_length_has_the_tables_unit_or_its_own(text: str, unit: str, expected_um: float) -> None:
    assert parse_length_um(text, unit, 10.0) == pytest.approx(expected_um)


@pytest.mark.parametrize("text", ["mm", "µm", "3 parsec", "voxel"])
def test_a_unit_alone_or_an_unknown_one_is_refused(text: str) -> None:
    with pytest.raises(NotUnderstood):
        parse_length_um(text, "um", 10.0)


@pytest.mark.parametrize(
    "text",
    [
        "9345.8 9865.5 2184.0",
        "9345.8, 9865.5, 2184.0",
        "[9345.8,9865.5,2184.0]",
        "(9345.8; 9865.5; 2184.0)",
        "9345.8\t9865.5\t2184.0",
    ],
)
def test_a_pasted_position_is_taken_apart(text: str) -> None:
    assert split_triple(text) == ("9345.8", "9865.5", "2184.0")


@pytest.mark.parametrize("text", ["1", "1 2", "1 2 3 4", "1,2,3", "9.35 mm", "a b c", ""])
def test_anything_else_is_no_position(text: str) -> None:
    assert split_triple(text) is None


@pytest.mark.parametrize(
    ("text", "unit", "expected_um"),
    [("12.5", "um", 12.5), ("12.5", "mm", 12500.0), ("12.5 µm", "mm", 12.5), ("1.1 cm", "um", 11000.0)],
)
def test_a_size_has_the_tables_unit_or_its_own(text: str, unit: str, expected_um: float) -> None:
    assert parse_size_um(text, unit) == pytest.approx(expected_um)


@pytest.mark.parametrize(
    ("text", "reason"),
    [("0", "more than zero"), ("-1 mm", "more than zero"), ("3 voxels", "not cubes"), ("mm", "number")],
)
def test_a_size_that_no_body_has_is_refused(text: str, reason: str) -> None:
    with pytest.raises(NotUnderstood, match=reason):
        parse_size_um(text, "um")
