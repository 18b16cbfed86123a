from typing import Any

import pytest
from pydantic import BaseModel, ConfigDict, ValidationError, field_validator

from annotations.errors import UserError, first_problem


class Point(BaseModel):
    model_config = ConfigDict(extra="forbid")
    x: float
    label: str = ""

    @field_validator("label")
    @classmethod
    def _short(cls, value: str) -> str:
        if len(value) > 3:
            raise ValueError("a label has three letters at most")
        return value


class Path(BaseModel):
    points: list[Point]


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (UserError("it is empty"), "it is empty."),
        (UserError("it is empty", where="v001.npy"), "v001.npy: it is empty."),
        (UserError("it is empty", remedy="Copy it again"), "it is empty. Copy it again."),
        (
            UserError("it is empty", where="v001.npy", remedy="Copy it again"),
            "v001.npy: it is empty. Copy it again.",
        ),
    ],
)
def test_an_error_says_what_where_and_what_to_do(error: UserError, text: str) -> None:
    assert str(error) == text


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({}, "the field 'points' is missing"),
        ({"points": [{}]}, "the field 'points.0.x' is missing"),
        ({"points": [{"x": 1, "y": 2}]}, "the field 'points.0.y' is unknown"),
        (
            {"points": [{"x": 1}, {"x": "east"}]},
            "points.1.x: Input should be a valid number, unable to parse",
        ),
        ({"points": [{"x": None}]}, "points.0.x: Input should be a valid number, found None"),
        ({"points": 5}, "points: Input should be a valid list, found 5"),
        (
            {"points": [{"x": 1, "label": "long"}]},
            "points.0.label: a label has three letters at most, found 'long'",
        ),
    ],
)
def test_what_a_model_refuses_is_said_in_words(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError) as refused:
        Path.model_validate(fields)
    assert first_problem(refused.value).startswith(words)


def test_long_findings_are_not_repeated() -> None:
    with pytest.raises(ValidationError) as refused:
        Path.model_validate({"points": [{"x": "9" * 50 + "x" * 50}]})
    assert "xxx" not in first_problem(refused.value)
