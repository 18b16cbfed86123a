"""JSON as people read it: where in a text a value stands, and a layout with one record a line."""

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

_WHOLE_NUMBER = re.compile("-?[0-9]+")


class JsonProblem(ValueError):  # noqa: N818 - turned into a DocumentError, which is what a user meets
    """A text that is not the JSON it should be; ``line`` counts from 1."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message)
        self.line = line


def parse_strictly(text: str) -> Any:
    """Parse JSON, refusing what the standard leaves open: repeated names, NaN and infinities.

    Raises
    ------
    JsonProblem
        With the line; for a truncated text it says so.
    """
    try:
        return json.loads(
            text, object_pairs_hook=_without_repeats, parse_constant=_refuse, parse_int=_whole_number
        )
    except json.JSONDecodeError as error:
        raise JsonProblem(_in_words(error, text), error.lineno) from error
    except _Doubt as error:
        message, position = _first_doubt(text, _skip_space(text, 0)) or ("it cannot be read", 0)
        raise JsonProblem(message, _line_at(text, position)) from error
    except RecursionError as error:
        raise JsonProblem("its brackets are nested too deeply", 1) from error


def line_of(text: str, location: Sequence[str | int]) -> int:
    """Return the line, from 1, of the value at a location such as ``("keypoints", 2, "state")`` in JSON text.

    Where the location leads to something that is not there, the line of the innermost part that is.
    """
    value = found = _skip_space(text, 0)
    for step in location:
        # A field is found where its name stands: that is where a person looks for it.
        member = next(((name, inner) for key, name, inner in _members(text, value) if key == step), None)
        if member is None:
            break
        found, value = member
    return _line_at(text, found)


def layout(fields: dict[str, Any]) -> str:
    """Write an object as people and ``diff`` read it: a line a field, and in lists a line an object."""
    return _object(fields, 1) + "\n"


def _object(fields: dict[str, Any], indent: int) -> str:
    margin = "\n" + " " * indent
    members = (f"{_in_one_line(name)}: {_member(value, indent)}" for name, value in fields.items())
    return "{" + f",{margin}".join(members) + "}"


def _member(value: Any, indent: int) -> str:
    margin = "\n" + " " * indent
    if _is_records(value):
        return f"[{margin} " + f",{margin} ".join(map(_in_one_line, value)) + f"{margin}]"
    if _holds_records(value):
        return _object(value, indent + 1)
    return _in_one_line(value)


def _in_one_line(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _is_records(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _holds_records(value: Any) -> bool:
    return isinstance(value, dict) and any(
        _is_records(member) or _holds_records(member) for member in value.values()
    )


class _Doubt(Exception):  # noqa: N818 - ends the parser, which does not know where it is
    pass


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        raise _Doubt
    return fields


def _refuse(_token: str) -> None:
    raise _Doubt


def _whole_number(digits: str) -> int:
    try:
        return int(digits)
    except ValueError:
        # Python converts no number of thousands of digits.
        raise _Doubt from None


def _in_words(error: json.JSONDecodeError, text: str) -> str:
    if not text.strip():
        return "the file is empty"
    if not text[error.pos :].strip() or error.msg.startswith("Unterminated string"):
        return "the text ends too early: the file is truncated"
    return f"it is not valid JSON ({error.msg})"


def _line_at(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _skip_space(text: str, position: int) -> int:
    while position < len(text) and text[position] in " \t\r\n":
        position += 1
    return position


def _members(text: str, position: int) -> Iterator[tuple[str | int, int, int]]:
    """Yield the key of each member of the object or list at a position, and where it and its value begin."""
    if text[position : position + 1] not in ("{", "["):
        return
    is_object = text[position] == "{"
    read = json.JSONDecoder(parse_int=str).raw_decode
    position = _skip_space(text, position + 1)
    count = 0
    while text[position] not in "}]":
        begin, key = position, count
        if is_object:
            key, position = read(text, position)
            position = _skip_space(text, _skip_space(text, position) + 1)
        yield key, begin, position
        _, position = read(text, position)
        position = _skip_space(text, position)
        if text[position] == ",":
            position = _skip_space(text, position + 1)
        count += 1


def _first_doubt(text: str, position: int) -> tuple[str, int] | None:
    """Find the first repeated name or doubtful number of a text that is JSON otherwise, and say where."""
    if text[position] in "{[":
        seen: set[str | int] = set()
        for key, begin, value in _members(text, position):
            if key in seen:
                return f"the field {key!r} stands twice in one object", begin
            seen.add(key)
            if doubt := _first_doubt(text, value):
                return doubt
        return None
    for token in ("NaN", "Infinity", "-Infinity"):
        if text.startswith(token, position):
            return f"{token} is not a number that a file may hold", position
    if number := _WHOLE_NUMBER.match(text, position):
        try:
            _whole_number(number.group())
        except _Doubt:
            return f"a number of {len(number.group())} digits is too long", position
    return None
