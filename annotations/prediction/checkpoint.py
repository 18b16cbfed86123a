"""Checkpoints: one ONNX file with a trained network and everything that turns a volume into keypoints."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from annotations import __version__
from annotations.documents.json_text import JsonProblem, parse_strictly
from annotations.durable_files import replace_durably
from annotations.errors import UserError, first_problem
from annotations.prediction.checkpoint_description import SCHEMA, CheckpointDescription

if TYPE_CHECKING:
    from onnx import ModelProto

METADATA_KEY = "oct-checkpoint"
"""Under which the description stands in the metadata of the ONNX file, as JSON."""

LARGEST_FILE = 256 * 2**20

_FAMILY = f"{METADATA_KEY}/"
_LONGEST_DESCRIPTION = 4 * 2**20
_ANOTHER = "Choose another checkpoint, or get this one anew from where it was made"


class CheckpointError(UserError):
    """A file that is no checkpoint, or one that does not fit or cannot be run."""


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint that was checked; made by `load_checkpoint` or `save_checkpoint`.

    Attributes
    ----------
    description : CheckpointDescription
        What goes in, and what comes out.
    model : bytes
        The network as ONNX, of which nothing has run yet. What was checked and nothing else: parts of the
        file that ONNX does not know are left out.
    sha256 : str
        Of the file, in hexadecimal digits.
    path : Path
    """

    description: CheckpointDescription
    model: bytes = field(repr=False)
    sha256: str
    path: Path


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint, and check everything of it. No code from the file runs.

    Raises
    ------
    CheckpointError
        Absent, not readable, not ONNX; without a description, or with one that this program does not know;
        or with a network that the description does not fit, or that could do harm. The file is untouched.
    """
    content = _read(path)
    # Late, as in `save_checkpoint`: a window that only may open a checkpoint should not wait for onnx.
    from annotations.prediction.onnx_graph import GraphProblem, check_model, metadata_text, parse_model

    try:
        model = parse_model(content)
        text = metadata_text(model, METADATA_KEY)
        description = _parse_description(text, path)
        check_model(model, description.input_shape, description.output_shape)
    except GraphProblem as problem:
        raise CheckpointError(str(problem), where=path, remedy=problem.remedy or _ANOTHER) from problem
    return _checkpoint(model, description, content, path)


def save_checkpoint(path: Path, description: CheckpointDescription, model_bytes: bytes) -> Checkpoint:
    """Write a checkpoint, atomically and durably.

    Parameters
    ----------
    path : Path
        By convention ``*.onnx``; a file of that name is replaced.
    description : CheckpointDescription
    model_bytes : bytes
        The network as an exporter wrote it, for one volume and with fixed sizes. Its own metadata, and what
        else the exporter noted beside the network, are left out.

    Raises
    ------
    CheckpointError
        The network does not fit the description, or is none that `load_checkpoint` would take. Nothing is
        written.
    SaveError
        The file cannot be written; what stood there before is untouched.
    """
    from annotations.prediction.onnx_graph import GraphProblem, check_model, parse_model, set_metadata

    text = json.dumps(description.model_dump(mode="json"), ensure_ascii=False, allow_nan=False)
    try:
        model = parse_model(model_bytes)
        set_metadata(model, METADATA_KEY, text)
        model.producer_name, model.producer_version = "oct-annotator", __version__
        check_model(model, description.input_shape, description.output_shape)
    except GraphProblem as problem:
        remedy = problem.remedy or "Export a network that fits the description"
        raise CheckpointError(str(problem), where=path, remedy=remedy) from problem
    content = model.SerializeToString(deterministic=True)
    if len(content) > LARGEST_FILE:
        raise _too_large(path)
    replace_durably(path, content)
    return _checkpoint(model, description, content, path)


def _checkpoint(
    model: "ModelProto", description: CheckpointDescription, content: bytes, path: Path
) -> Checkpoint:
    checked = model.SerializeToString(deterministic=True)
    return Checkpoint(description, checked, hashlib.sha256(content).hexdigest(), path)


def _read(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise CheckpointError(
                "it is a folder", where=path, remedy="Choose a checkpoint, which is one file (.onnx)"
            )
        if path.exists() and not path.is_file():
            raise CheckpointError("it is not a file", where=path, remedy=_ANOTHER)
        # A volume that was taken for a checkpoint must not fill the memory.
        with path.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        # A path that no file can have is a ValueError.
        raise CheckpointError(
            f"it could not be read ({getattr(error, 'strerror', None) or error})",
            where=path,
            remedy="Check that it is a file, and that you may read it",
        ) from error
    if len(content) > LARGEST_FILE:
        raise _too_large(path)
    return content


def _too_large(path: Path) -> CheckpointError:
    return CheckpointError(
        f"it is too large for a checkpoint: more than {LARGEST_FILE >> 20} MiB", where=path, remedy=_ANOTHER
    )


def _parse_description(text: str | None, path: Path) -> CheckpointDescription:
    if text is None:
        raise CheckpointError(
            f"it is an ONNX file, but no checkpoint: its metadata have no {METADATA_KEY!r}",
            where=path,
            remedy="Choose a checkpoint; docs/checkpoints.md says how one is made of another network",
        )
    try:
        if len(text) > _LONGEST_DESCRIPTION:
            raise JsonProblem("it is too long", 1)
        fields = parse_strictly(text)
        # Halves of surrogate pairs can be escaped in JSON, and are no text.
        json.dumps(fields, ensure_ascii=False).encode()
    except JsonProblem as error:
        raise _wrong_description(f"line {error.line}: {error}", path) from error
    except (UnicodeEncodeError, RecursionError) as error:
        raise _wrong_description("it is not text", path) from error
    _check_schema(fields, path)
    try:
        return CheckpointDescription.model_validate(fields)
    except ValidationError as error:
        raise _wrong_description(first_problem(error), path) from error


def _check_schema(fields: Any, path: Path) -> None:
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if schema == SCHEMA:
        return
    if isinstance(schema, str) and schema.startswith(_FAMILY):
        raise CheckpointError(
            f"it was written by a newer program: its schema is {schema!r}, and this program ({__version__}) "
            f"knows {SCHEMA!r}",
            where=path,
            remedy="Update this program",
        )
    raise _wrong_description(f'"schema" is {schema!r}, not {SCHEMA!r}', path)


def _wrong_description(problem: str, path: Path) -> CheckpointError:
    return CheckpointError(f"its description is wrong: {problem}", where=path, remedy=_ANOTHER)
