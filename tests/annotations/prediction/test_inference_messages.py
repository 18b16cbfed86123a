"""What is said between a program and its network's process."""

import io
from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.prediction.checkpoint import CheckpointError
from annotations.prediction.inference_messages import (
    Garbled,
    Message,
    error_fields,
    error_of,
    packed,
    read_message,
    unpacked,
    write_message,
)
from annotations.volumes import VolumeError

values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**40), 2**40) | st.text(),
    lambda inner: st.lists(inner, max_size=3),
)
headers = st.dictionaries(st.text(), values, max_size=4)


def written(message: Message) -> bytes:
    stream = io.BytesIO()
    write_message(stream, message)
    return stream.getvalue()


@given(st.lists(st.tuples(headers, st.binary(max_size=200)), max_size=3))
def test_messages_arrive_as_they_were_sent(messages: list[tuple[dict, bytes]]) -> None:
    stream = io.BytesIO(b"".join(written(Message(*message)) for message in messages))

    for header, body in messages:
        message = read_message(stream)
        assert message is not None
        assert (message.header, message.body) == (header, body)
    assert read_message(stream) is None


@given(headers, st.binary(max_size=50), st.data())
def test_a_stream_that_ends_within_a_message_is_no_message(
    header: dict, body: bytes, data: st.DataObject
) -> None:
    whole = written(Message(header, body))
    cut = data.draw(st.integers(1, len(whole) - 1))

    with pytest.raises(Garbled):
        read_message(io.BytesIO(whole[:cut]))


@given(st.binary(min_size=16, max_size=80).filter(lambda content: not content.startswith(b"OCTM")))
def test_anything_else_is_noticed_at_once(content: bytes) -> None:
    with pytest.raises(Garbled):
        read_message(io.BytesIO(content))


def test_arrays_of_any_type_and_shape_share_a_body() -> None:
    arrays = [
        np.arange(6, dtype=np.float32).reshape(1, 2, 3),
        np.asfortranarray(np.arange(12, dtype=np.uint8).reshape(3, 4)),
        np.zeros((0, 3)),
    ]

    described, body = packed(arrays)

    for array, found in zip(arrays, unpacked(described, body), strict=True):
        assert found.dtype == array.dtype
        np.testing.assert_array_equal(found, array)


@pytest.mark.parametrize("kind", [UserError, VolumeError, CheckpointError, SaveError])
@pytest.mark.parametrize("where", [None, "line 3", Path("folder/volume.npy")])
def test_errors_stay_what_they_are(kind: type[UserError], where: object) -> None:
    error = kind("it is broken", where=where, remedy="Mend it")

    found = error_of(error_fields(error))

    assert (type(found), str(found), found.where) == (kind, str(error), where)


def test_an_error_of_a_kind_that_the_other_side_does_not_know_is_of_the_nearest_one() -> None:
    class TooDarkError(VolumeError):
        pass

    assert type(error_of(error_fields(TooDarkError("it is too dark")))) is VolumeError
