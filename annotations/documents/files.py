"""Annotation files: read with every doubt named by its line, written so that nothing is ever lost."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Generic, Protocol

from pydantic import ValidationError

from annotations import __version__
from annotations.documents.annotation import SCHEMA, Annotation, with_all_parts
from annotations.documents.json_text import JsonProblem, layout, line_of, parse_strictly
from annotations.documents.record import R, changed, now
from annotations.documents.write_guard import writing_beside
from annotations.durable_files import SaveError, replace_durably
from annotations.errors import UserError, first_problem
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool, shipped_tools

FileIdentity = str
"""SHA-256 of a file's bytes, by which a change by another program is noticed; "" for an absent file."""

_LARGEST_FILE = 64 * 2**20


class DocumentError(UserError):
    """A file that cannot be read as the kind of document that it should be; the file is untouched."""


class ChangedOnDisk(SaveError):  # noqa: N818 - named for what happened
    """The file is no longer what was read: another program has written it meanwhile."""


@dataclass(frozen=True)
class DocumentFile(Generic[R]):
    """How a kind of document is read from a file, with every doubt named by its line.

    Attributes
    ----------
    model : type
        What is read.
    schema : str
        Such as ``oct-annotation/1``; a newer one has another number.
    name : str
        What such a file is called, with its article: ``an annotation file``.
    mend : str
        What the user can do about a wrong one, as a sentence without its full stop.
    """

    model: type[R]
    schema: str
    name: str
    mend: str

    def read(self, path: Path) -> bytes:
        """Return the bytes of a file; DocumentError where it is absent, not readable or far too large."""
        try:
            # A volume that was taken for a document must not fill the memory.
            if path.stat().st_size > _LARGEST_FILE:
                raise DocumentError(f"it is too large for {self.name}", where=path, remedy=self._choose)
            return path.read_bytes()
        except (OSError, ValueError) as error:
            # A path that no file can have is a ValueError.
            raise DocumentError(
                f"it could not be read ({getattr(error, 'strerror', None) or error})",
                where=path,
                remedy="Check that it is a file, and that you may read it",
            ) from error

    def parse(self, content: bytes, where: object) -> R:
        """Return what the bytes of a file say; ``where`` is named in a DocumentError."""
        try:
            # Some editors begin a file with a byte order mark.
            text = content.decode("utf-8-sig")
            fields = parse_strictly(text)
        except UnicodeDecodeError as error:
            raise DocumentError("it is not text (UTF-8)", where=where, remedy=self.mend) from error
        except JsonProblem as error:
            raise DocumentError(str(error), where=f"{where}, line {error.line}", remedy=self.mend) from error
        self._check_schema(fields, where)
        try:
            return self.model.model_validate(fields)
        except ValidationError as error:
            problem = error.errors(include_url=False)[0]
            repeated = [problem["ctx"]["index"]] if problem["type"] == "repeated" else []
            line = line_of(text, [*problem["loc"], *repeated])
            raise DocumentError(
                first_problem(error), where=f"{where}, line {line}", remedy=self.mend
            ) from error

    def _check_schema(self, fields: Any, where: object) -> None:
        schema = fields.get("schema") if isinstance(fields, dict) else None
        if schema == self.schema:
            return
        if isinstance(schema, str) and schema.startswith(f"{self.schema.partition('/')[0]}/"):
            raise DocumentError(
                f"it has the schema {schema!r}, and this program ({__version__}) knows {self.schema!r}",
                where=where,
                remedy="Open it with the newer version of the program that wrote it",
            )
        raise DocumentError(
            f'it is not {self.name}: "schema" is {schema!r}, not {self.schema!r}',
            where=where,
            remedy=self._choose,
        )

    @property
    def _choose(self) -> str:
        return f"Choose {self.name}"


ANNOTATION_FILE = DocumentFile(
    Annotation, SCHEMA, "an annotation file", "Correct the file, or take its backup (.bak) beside it"
)


def load_annotation(path: Path) -> tuple[Annotation, FileIdentity]:
    """Read an annotation file.

    Returns
    -------
    Annotation
        As it stands in the file.
    str
        Identity of the file's content, for `save_annotation`.

    Raises
    ------
    DocumentError
        Absent, not readable, truncated, of a newer schema, or with a field that is unknown, missing or wrong;
        with the line. The file is untouched.
    """
    content = ANNOTATION_FILE.read(path)
    return parse_annotation(content, path), hashlib.sha256(content).hexdigest()


def parse_annotation(content: bytes, where: object) -> Annotation:
    """Read an annotation from the bytes of a file; ``where`` is named in a DocumentError."""
    return ANNOTATION_FILE.parse(content, where)


def annotation_bytes(annotation: Annotation) -> bytes:
    """Return the bytes of an annotation file: UTF-8 JSON, a keypoint or box a line, absent fields absent."""
    fields = annotation.model_dump(mode="json", exclude_none=True)
    for part in (*fields["keypoints"], *fields["boxes"]):
        if not part["locked"]:
            del part["locked"]
    for name in ("repeat", "consensus_of", "viewings"):
        # What says nothing is left out: most documents are of a first pass that nobody looked around in.
        if not fields[name]:
            del fields[name]
    return document_bytes(fields)


def document_bytes(fields: dict[str, Any]) -> bytes:
    """Return the bytes of a document's file: UTF-8 JSON, a field a line, and a line a record."""
    # A path that is not Unicode (Linux has such) stands in Python's text as lone surrogates; escaped in this
    # way they are legal JSON, and are read back as they were.
    return layout(fields).encode("utf-8", "backslashreplace")


def file_identity(path: Path) -> FileIdentity:
    """Return the identity of the file's present content; "" if there is no file."""
    return _identity(_present_content(path))


def _identity(content: bytes | None) -> FileIdentity:
    return "" if content is None else hashlib.sha256(content).hexdigest()


def _present_content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise SaveError(
            f"what is there could not be compared ({error.strerror or error})",
            where=path,
            remedy="Nothing was written; save to another folder",
        ) from error


def save_annotation(
    annotation: Annotation,
    path: Path,
    *,
    expected: FileIdentity,
    overwrite: bool = False,
) -> tuple[Annotation, FileIdentity]:
    """Write an annotation file atomically and durably; the previous version is kept beside it as ``.bak``.

    The next save replaces that backup. A version that did not come from here, and is overwritten on demand,
    is also kept beside the file under a name of its own (`theirs_path`), which no save touches again.

    Parameters
    ----------
    expected : str
        Identity of the content that this annotation came from ("" for a file that did not exist). If the file
        is another one by now, nothing is written unless ``overwrite`` is true.
    overwrite : bool
        Write the file even then.

    Returns
    -------
    Annotation
        As it was written.
    str
        Identity of the file's new content.

    Raises
    ------
    ChangedOnDisk
        Another program wrote the file meanwhile, and ``overwrite`` is false.
    SaveError
        The file, or the backup of another program's version, cannot be written, or another program has been
        writing in the folder for long (see `writing_beside`); what was there is whole.
    """
    written = changed(annotation, modified=now(), program=__version__)
    content = annotation_bytes(written)
    # Nobody writes between the look at what is there and the new content.
    with writing_beside(path):
        present = _present_content(path)
        is_theirs = _identity(present) != expected
        if is_theirs and not overwrite:
            raise ChangedOnDisk(
                "another program has changed it since it was read",
                where=path,
                remedy="Reload it, overwrite it (a backup is kept), or save under another name",
            )
        if is_theirs and present is not None:
            replace_durably(theirs_path(path), present)
        replace_durably(path, content, backup=backup_path(path))
    return written, hashlib.sha256(content).hexdigest()


def backup_path(path: Path) -> Path:
    """Return where the previous version of an annotation file is kept."""
    return path.with_name(path.name + ".bak")


def theirs_path(path: Path) -> Path:
    """Return a new name, with the time in UTC, under which another program's version of a file is kept."""
    while True:
        kept = path.with_name(f"{path.name}.{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}.theirs.bak")
        if not kept.exists():
            return kept


class MadeWithTool(Protocol):
    """What a document says of the tool that it was made with."""

    @property
    def tool(self) -> str:
        """Its name."""

    @property
    def tool_fingerprint(self) -> str | None:
        """Of its content, if the document says it."""

    @property
    def tool_copy(self) -> ToolSpecification | None:
        """The tool itself, where it does not ship with the program."""


def tool_of(document: MadeWithTool, folders: Sequence[Path] = ()) -> ToolSpecification:
    """Return the tool that a document was made with: its own copy, or the one that `find_tool` finds.

    Raises
    ------
    ToolError
        There is no such tool.
    DocumentError
        The tool found by that name is not the one with which the document was made.
    """
    if document.tool_copy is not None:
        return document.tool_copy
    tool = find_tool(document.tool, folders)
    if document.tool_fingerprint not in (None, tool.fingerprint):
        raise DocumentError(
            f"it was made with another version of the tool {tool.name!r} than the one found here",
            remedy="Give that version of the specification a name of its own, in the study's folder 'tools'",
        )
    return tool


def ships(tool: ToolSpecification) -> bool:
    """Say whether a tool, with this content, comes with the program, so that documents need no copy of it."""
    shipped = shipped_tools().get(tool.name)
    return shipped is not None and shipped.fingerprint == tool.fingerprint


def completed(annotation: Annotation, tool: ToolSpecification) -> Annotation:
    """Return the document with every keypoint, or every link's box, of the tool; absent ones are unplaced.

    Raises
    ------
    DocumentError
        The document has a keypoint, or a box on a link, that the tool does not.
    """
    _require(tool, "keypoint", [keypoint.name for keypoint in annotation.keypoints], tool.keypoint_names)
    _require(tool, "link", [box.link for box in annotation.boxes], [link.name for link in tool.links])
    return with_all_parts(annotation, tool)


def _require(tool: ToolSpecification, kind: str, wanted: Sequence[str], known: Sequence[str]) -> None:
    for name in wanted:
        if name not in known:
            raise DocumentError(
                f"{kind} {name!r} is unknown to the tool {tool.name!r}, "
                f"which has {', '.join(known) or 'none'}",
                remedy="Correct the name or the tool in the file",
            )
