"""JSON as people read it: where in a text a value stands, and a layout with one record a line."""

import json
from collections.abc import Sequence
from json.decoder import scanstring  # type: ignore[attr-defined]
from typing import Any


class JsonProblem(ValueError):
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
        return json.loads(text, object_pairs_hook=_without_repeats, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        cut_off = not text[error.pos :].strip()
        message = "the text ends too early: the file is truncated" if cut_off else error.msg
        raise JsonProblem(message, error.lineno) from error
    except _OpenToDoubt as error:
        raise JsonProblem(str(error), line_of_text(text, error.token)) from error


def line_of(text: str, location: Sequence[str | int]) -> int:
    """Return the line, from 1, of the value at a location such as ``("keypoints", 2, "state")`` in JSON text.

    Where the location leads to something that is not there, the line of the innermost part that is.
    """
    position = _skip_space(text, 0)
    for step in location:
        found = _enter(text, position, step)
        if found is None:
            break
        position = found
    return text.count("\n", 0, position) + 1


def line_of_text(text: str, token: str) -> int:
    """Return the line, from 1, on which a token stands last; 1 if it does not."""
    return text.count("\n", 0, max(text.rfind(token), 0)) + 1


def layout(fields: dict[str, Any]) -> str:
    """Write an object so that people and ``diff`` can read it: a line a field, and in lists a line a record."""
    lines = []
    for name, value in fields.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            records = ",\n".join(f"  {json.dumps(record, ensure_ascii=False)}" for record in value)
            lines.append(f"{json.dumps(name)}: [\n{records}\n ]")
        else:
            lines.append(f"{json.dumps(name)}: {json.dumps(value, ensure_ascii=False)}")
    return "{" + ",\n ".join(lines) + "}\n"


class _OpenToDoubt(Exception):  # noqa: N818 - internal signal, turned into JsonProblem
    def __init__(self, message: str, token: str) -> None:
        super().__init__(message)
        self.token = token


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for name, value in pairs:
        if name in fields:
            raise _OpenToDoubt(f"the field {name!r} stands twice in one object", json.dumps(name))
        fields[name] = value
    return fields


def _refuse_constant(token: str) -> None:
    raise _OpenToDoubt(f"{token} is not a number that a file may hold", token)


def _skip_space(text: str, position: int) -> int:
    while position < len(text) and text[position] in " \t\r\n":
        position += 1
    return position


def _enter(text: str, position: int, step: str | int) -> int | None:
    """Return where the member ``step`` of the object or list at ``position`` begins, or None."""
    if text[position : position + 1] != ("{" if isinstance(step, str) else "["):
        return None
    decoder = json.JSONDecoder()
    position = _skip_space(text, position + 1)
    count = 0
    while position < len(text) and text[position] not in "}]":
        name_position = position
        if isinstance(step, str):
            name, position = scanstring(text, position + 1)
            position = _skip_space(text, _skip_space(text, position) + 1)
            if name == step:
                # A field's own line, where its name stands, is what a person looks for.
                return position if text[position] in "{[" else name_position
        elif count == step:
            return position
        _, position = decoder.raw_decode(text, position)
        position = _skip_space(text, position)
        if text[position : position + 1] == ",":
            position = _skip_space(text, position + 1)
        count += 1
    return None
