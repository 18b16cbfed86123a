import json
import sys

import hypothesis.strategies as st
import pytest
from hypothesis import given

from annotations.documents.json_text import JsonProblem, layout, line_of, parse_strictly

TEXT = """{"schema": "x",
 "volume": {"path": "\\"keypoints\\": [",
   "shape": [1,
    2, 3]},
 "keypoints": [
  {"name": "k0", "state": "placed"},
  {
    "name": "k1",
    "state": "unplaced"
  }
 ]
}
"""

scalars = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text()
)
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3)
)


@pytest.mark.parametrize(
    ("location", "line"),
    [
        ((), 1),
        (("schema",), 1),
        (("volume",), 2),
        (("volume", "path"), 2),
        (("volume", "shape"), 3),
        (("volume", "shape", 0), 3),
        (("volume", "shape", 2), 4),
        (("keypoints",), 5),
        (("keypoints", 0), 6),
        (("keypoints", 0, "state"), 6),
        (("keypoints", 1), 7),
        (("keypoints", 1, "name"), 8),
        (("keypoints", 1, "state"), 9),
        (("keypoints", 1, "absent"), 7),
        (("keypoints", 5, "state"), 5),
        (("absent", "state"), 1),
        (("schema", "state"), 1),
    ],
)
def test_the_line_of_a_value(location: tuple[str | int, ...], line: int) -> None:
    parse_strictly(TEXT)
    assert line_of(TEXT, location) == line


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("", "the file is empty", 1),
        ("  ", "the file is empty", 1),
        ('{"a": 1,\n "b": 2,\n "a": 3}', "the field 'a' stands twice in one object", 3),
        ('{"k": [{"name": 1},\n{"name": 2,\n"name": 3}],\n"name": 4}', "the field 'name' stands twice", 3),
        ('{"a": "NaN",\n "b": [0,\n NaN]}', "NaN is not a number", 3),
        ('{"a": "Infinity",\n "b": Infinity}', "Infinity is not a number", 2),
        ('{"b":\n -Infinity}', "-Infinity is not a number", 2),
        ('{"a": 1,\n "b": 1%s}' % ("0" * sys.get_int_max_str_digits()), "digits is too long", 2),
        ("[" * 200_000, "nested too deeply", 1),
        ('{"a": 1,\n "b', "the file is truncated", 2),
        ('{"a": 1,\n', "the file is truncated", 2),
        ('{"a": 1,\n "b": 2', "the file is truncated", 2),
        ('{"a": 1\n "b": 2}', "it is not valid JSON (Expecting ',' delimiter)", 2),
        ('{"a": 1}\n{"a": 1}', "it is not valid JSON (Extra data)", 2),
        ('{"a": True}', "it is not valid JSON (Expecting value)", 1),
    ],
)
def test_doubtful_text_is_refused_with_its_line(text: str, message: str, line: int) -> None:
    with pytest.raises(JsonProblem) as refused:
        parse_strictly(text)
    assert message in str(refused.value)
    assert refused.value.line == line


@given(value=values)
def test_sound_text_is_read_as_it_stands(value: object) -> None:
    assert parse_strictly(json.dumps(value)) == value
    assert parse_strictly(json.dumps(value, indent=1, ensure_ascii=False)) == value


@given(fields=st.dictionaries(st.text(), values, max_size=4))
def test_a_layout_says_what_it_was_given(fields: dict[str, object]) -> None:
    assert parse_strictly(layout(fields)) == fields


def test_a_layout_has_a_line_a_field_and_a_line_a_record() -> None:
    fields = {
        "schema": "x",
        "volume": {"shape": [1, 2]},
        "keypoints": [{"name": "k0"}, {"name": "ké"}],
        "tool_copy": {"name": "probe", "keypoints": [{"name": "tip"}], "targets": {"angles": []}},
        "boxes": [],
    }
    assert layout(fields) == (
        '{"schema": "x",\n'
        ' "volume": {"shape": [1, 2]},\n'
        ' "keypoints": [\n'
        '  {"name": "k0"},\n'
        '  {"name": "ké"}\n'
        " ],\n"
        ' "tool_copy": {"name": "probe",\n'
        '  "keypoints": [\n'
        '   {"name": "tip"}\n'
        "  ],\n"
        '  "targets": {"angles": []}},\n'
        ' "boxes": []}\n'
    )


def test_a_layout_holds_no_number_that_no_reader_takes() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        layout({"position_um": [float("nan"), 0.0, 0.0]})
