"""What a program and the process in which its network runs say to each other.

A message is a mark, the lengths of two parts, a header in JSON, and raw bytes. Either side notices at once
where anything else stands in the stream.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from annotations.documents.files import DocumentError
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.prediction.checkpoint import CheckpointError
from annotations.volumes import DatasetChoice, DatasetChoiceNeeded, VolumeError

_MARK = b"OCTM"
_PREFIX = struct.Struct("<4sIQ")
_LONGEST_HEADER = 64 << 20
_LONGEST_BODY = 1 << 32
_KINDS = {kind.__name__: kind for kind in (CheckpointError, DocumentError, SaveError, VolumeError, UserError)}


class Garbled(Exception):  # noqa: N818 - named for what happened
    """Something else than a message stands in the stream, or it ends within one."""


@dataclass(frozen=True, eq=False)
class Message:
    """One message.

    Attributes
    ----------
    header : mapping
        What JSON can hold.
    body : bytes
    """

    header: Mapping[str, Any]
    body: bytes = b""


def write_message(stream: IO[bytes], message: Message) -> None:
    """Write a message, and send it off; OSError where nobody reads any more."""
    header = json.dumps(message.header).encode()
    stream.write(_PREFIX.pack(_MARK, len(header), len(message.body)) + header + message.body)
    stream.flush()


def read_message(stream: IO[bytes]) -> Message | None:
    """Wait for the next message; None where the stream has ended.

    Raises
    ------
    Garbled
        What came is no message.
    """
    prefix = stream.read(_PREFIX.size)
    if not prefix:
        return None
    if len(prefix) < _PREFIX.size:
        raise Garbled("the stream ends within a message")
    mark, header_length, body_length = _PREFIX.unpack(prefix)
    if mark != _MARK or header_length > _LONGEST_HEADER or body_length > _LONGEST_BODY:
        raise Garbled(f"{prefix!r} is no beginning of a message")
    header, body = stream.read(header_length), stream.read(body_length)
    if len(header) < header_length or len(body) < body_length:
        raise Garbled("the stream ends within a message")
    try:
        fields = json.loads(header)
    except ValueError as error:
        raise Garbled(str(error)) from error
    if not isinstance(fields, dict):
        raise Garbled("a header is a table")
    return Message(fields, body)


def packed(arrays: Sequence[NDArray[Any]]) -> tuple[list[dict[str, Any]], bytes]:
    """Return how arrays are described in a header, and the body that has their values."""
    described = [{"dtype": array.dtype.str, "shape": list(array.shape)} for array in arrays]
    return described, b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


def unpacked(described: Sequence[Mapping[str, Any]], body: bytes) -> tuple[NDArray[Any], ...]:
    """Return the arrays of a message; they can only be read."""
    arrays, place = [], 0
    for one in described:
        dtype, shape = np.dtype(one["dtype"]), tuple(one["shape"])
        count = int(np.prod(shape))
        arrays.append(np.frombuffer(body, dtype, count, place).reshape(shape))
        place += count * dtype.itemsize
    return tuple(arrays)


def error_fields(error: UserError) -> dict[str, Any]:
    """Return what a header says of an error, so that `error_of` can raise it again on the other side."""
    fields: dict[str, Any] = {
        "kind": next(kind.__name__ for kind in type(error).__mro__ if kind.__name__ in _KINDS),
        "problem": error.problem,
        "where": None if error.where is None else str(error.where),
        "is_path": isinstance(error.where, Path),
        "remedy": error.remedy,
    }
    if isinstance(error, DatasetChoiceNeeded):
        fields["choices"] = [[one.name, list(one.shape), one.dtype] for one in error.choices]
    return fields


def error_of(fields: Mapping[str, Any]) -> UserError:
    """Return the error of which a header speaks: of the same kind, or the nearest one, and in its words."""
    where = Path(fields["where"]) if fields["is_path"] else fields["where"]
    if "choices" in fields:
        choices = [DatasetChoice(name, (*shape,), dtype) for name, shape, dtype in fields["choices"]]
        return DatasetChoiceNeeded(Path(where), choices)
    return _KINDS[fields["kind"]](fields["problem"], where=where, remedy=fields["remedy"])
