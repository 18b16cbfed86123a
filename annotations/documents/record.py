"""Records: the frozen parts of which documents and studies are made, and the kinds of their fields."""

import re
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

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
    return kind(**(values | fields))


class Difference(NamedTuple):
    """One value in which two records of a kind differ.

    Attributes
    ----------
    field : str
    place : int or None
        Where in the field's tuple the value stands; None where it is all of the field.
    before, after : object
        What it is in the one and in the other.
    """

    field: str
    place: int | None
    before: Any
    after: Any


def differences(before: R, after: R) -> tuple[Difference, ...]:
    """Return in what two records differ; of tuples that are equally long, the values that do."""
    return tuple(
        each
        for name in type(after).model_fields
        for each in _differences_in(name, getattr(before, name), getattr(after, name))
    )


def amended(record: R, found: Iterable[Difference], *, backwards: bool) -> R:
    """Return a record with the values of one of two that differ: of the first if ``backwards``."""
    fields: dict[str, Any] = {}
    for name, place, before, after in found:
        value = before if backwards else after
        if place is not None:
            whole = fields.get(name, getattr(record, name))
            value = (*whole[:place], value, *whole[place + 1 :])
        fields[name] = value
    return changed(record, **fields)


def _differences_in(name: str, before: Any, after: Any) -> Iterator[Difference]:
    if before == after:
        return
    if isinstance(before, tuple) and isinstance(after, tuple) and len(before) == len(after):
        for place, (was, is_now) in enumerate(zip(before, after, strict=True)):
            if was != is_now:
                yield Difference(name, place, was, is_now)
    else:
        yield Difference(name, None, before, after)
