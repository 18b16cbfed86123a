"""Records: the frozen parts of which documents and studies are made, and the kinds of their fields."""

import re
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer

Method = Literal["keypoints", "boxes"]
"""What a person places: the tool's keypoints, or a box on each of its links."""

Status = Literal["in_progress", "done"]


def _written_moment(value: Any) -> datetime:
    # By itself pydantic would also take a number of seconds for a time.
    try:
        return value if isinstance(value, datetime) else datetime.fromisoformat(value)
    except (TypeError, ValueError):
        raise ValueError("a time is written like 2026-11-22T05:00:00Z") from None


def _utc_second(moment: datetime) -> datetime:
    if moment.tzinfo is None:
        raise ValueError("a time must say its zone, such as 2026-11-22T05:00:00Z")
    try:
        return moment.astimezone(UTC).replace(microsecond=0)
    except OverflowError:
        raise ValueError("a time must lie in the years 1 to 9999") from None


def _in_utc(moment: datetime) -> str:
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")


Moment = Annotated[
    datetime,
    BeforeValidator(_written_moment),
    AfterValidator(_utc_second),
    PlainSerializer(_in_utc, return_type=str, when_used="json"),
]


def _usable_path(value: str) -> str:
    # Halves of surrogate pairs are legal where Python puts them for the bytes of a name that is no Unicode.
    if not value or re.search("[\0\ud800-\udc7f\udd00-\udfff]", value):
        raise ValueError("a path is not empty, and holds nothing that no file's name can hold")
    return value


Truth = Annotated[bool, Field(strict=True)]
UsablePath = Annotated[str, AfterValidator(_usable_path)]


def now() -> datetime:
    """Return the present moment, UTC, to the second: the resolution that files keep."""
    return datetime.now(UTC).replace(microsecond=0)


class Record(BaseModel):
    """A frozen part of a document; unknown fields are refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_by_name=True, validate_by_alias=True, serialize_by_alias=True
    )


R = TypeVar("R", bound=Record)


def changed(record: R, **fields: Any) -> R:
    """Return a copy of a record with some fields changed, validated as if it were read from a file."""
    kind = type(record)
    values = {name: getattr(record, name) for name in kind.model_fields}
    copy = kind(**(values | fields))
    # Pydantic notes for each record which of its fields were given; here they all are. One note for all of
    # them: thousands of documents are kept to be undone, and half of what each takes were its notes. Nobody
    # may change it in place; pydantic itself copies it.
    object.__setattr__(copy, "__pydantic_fields_set__", _all_fields(kind))
    return copy


def differences(before: R, after: R) -> Mapping[str, tuple[Any, Any]]:
    """Return the fields in which two records differ, each with what it is in the one and in the other."""
    return {
        name: values
        for name in type(after).model_fields
        if (values := (getattr(before, name), getattr(after, name)))[0] != values[1]
    }


@cache
def _all_fields(kind: type[Record]) -> set[str]:
    return set(kind.model_fields)
