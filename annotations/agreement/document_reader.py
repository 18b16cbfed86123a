"""Reads the documents that are to be compared, one by one, and says which cannot be, and why."""

import unicodedata
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import TypeVar, cast

from annotations.agreement.documents_read import DocumentRead, name_of_volume
from annotations.agreement.found_files import begins_like_annotation, plain_text
from annotations.agreement.part_table import PartTable
from annotations.agreement.results import LeftOut
from annotations.documents.annotation import Annotation
from annotations.documents.files import load_annotation, tool_of
from annotations.documents.record import Method
from annotations.documents.study import CONSENSUS, AnnotationName, Study, annotation_name
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification

H = TypeVar("H", bound=Hashable)

ToolKey = tuple[str, str]
"""Name and fingerprint of a tool."""

_OTHER_NAME = "it is not named like an annotation of a study, <volume id>.<method>.json"
_CONSENSUS = "it is a consensus, not an annotator's own work"


class _Unsuited(Exception):  # noqa: N818 - ends the reading of one file
    """A document that cannot be compared; says why."""


class DocumentReader:
    """Keeps of each document what a comparison needs.

    Parameters
    ----------
    folder : Path
        Of what is compared.
    study : Study or None
        What its ``study.toml`` says, where there is one.
    tool_folders : sequence of Path
        Where tools are looked for besides the shipped ones.
    done_only : bool
        Whether documents in progress are left out.

    Attributes
    ----------
    documents : list of DocumentRead
    left_out : list of LeftOut
    tools : dict of ToolKey to ToolSpecification
        Those of the documents.
    tables : dict of (ToolKey, method) to PartTable
        The points of the documents.
    """

    def __init__(
        self, folder: Path, study: Study | None, tool_folders: Sequence[Path], *, done_only: bool
    ) -> None:
        self._folder = folder
        self._study = study
        self._tool_folders = tool_folders
        self._done_only = done_only
        self._volume_ids = {volume.id for volume in study.volumes} if study else set()
        self._found_tools: dict[tuple[str, str | None, bool], ToolKey | str] = {}
        # Many documents say the same, which is kept once.
        self._kept: dict[object, object] = {}
        self.documents: list[DocumentRead] = []
        self.left_out: list[LeftOut] = []
        self.tools: dict[ToolKey, ToolSpecification] = {}
        self.tables: dict[tuple[ToolKey, Method], PartTable] = {}

    def read(self, relative: str) -> None:
        """Read a file, given relative to the folder; one that is no annotation at all is passed over."""
        path = self._folder / relative
        name = annotation_name(path)
        if name is None and not begins_like_annotation(path):
            return
        try:
            if self._study is not None:
                self._check_name(name, path)
            document, sha256 = load_annotation(path)
            self._check(document)
            if self._study is None or name is None:
                volume = document.volume.fingerprint
            else:
                _check_place(document, path, name)
                volume = name.volume_id
            self.documents.append(self._read(document, relative, sha256, volume))
        except _Unsuited as reason:
            self._leave_out(relative, str(reason))
        except UserError as error:
            self._leave_out(relative, _in_words(error, path))

    def _leave_out(self, relative: str, reason: str) -> None:
        self.left_out.append(LeftOut(path=plain_text(relative), reason=plain_text(reason)))

    def _check_name(self, name: AnnotationName | None, path: Path) -> None:
        """Say of some of a study's files that they need not be opened."""
        if name is None:
            raise _Unsuited(_OTHER_NAME)
        if path.parent.name == CONSENSUS:
            raise _Unsuited(_CONSENSUS)
        if name.volume_id not in self._volume_ids:
            raise _Unsuited(f"the study has no volume {name.volume_id!r}")

    def _check(self, document: Annotation) -> None:
        if document.annotator == CONSENSUS or document.consensus_of:
            raise _Unsuited(_CONSENSUS)
        if self._done_only and document.status != "done":
            raise _Unsuited("it is not marked as done")

    def _read(self, document: Annotation, relative: str, sha256: str, volume_key: str) -> DocumentRead:
        tool_key = self._tool_key(document)
        table = self.tables.get((tool_key, document.method))
        if table is None:
            table = self.tables[tool_key, document.method] = PartTable(document.method, self.tools[tool_key])
        volume = document.volume
        return DocumentRead(
            path=plain_text(relative),
            sha256=sha256,
            tool_key=tool_key,
            volume=self._once(volume_key),
            volume_name=self._once(plain_text(name_of_volume(volume.path, volume.dataset))),
            fingerprint=self._once(volume.fingerprint),
            spacing_um=self._once(volume.spacing_um),
            annotator=self._once(plain_text(document.annotator)),
            method=document.method,
            repeat=document.repeat,
            status=document.status,
            modified=document.modified,
            active_seconds=document.active_seconds,
            is_blind=document.is_blind,
            is_flagged=document.flag is not None,
            is_from_prediction=document.predicted_from is not None,
            row=table.add(document),
        )

    def _tool_key(self, document: Annotation) -> ToolKey:
        copy = document.tool_copy
        fingerprint = document.tool_fingerprint or (copy.fingerprint if copy else None)
        wanted = (document.tool, fingerprint, copy is not None)
        if wanted not in self._found_tools:
            try:
                tool = tool_of(document, self._tool_folders)
            except UserError as error:
                self._found_tools[wanted] = _in_words(error)
            else:
                key = (tool.name, tool.fingerprint)
                self._found_tools[wanted] = key
                self.tools.setdefault(key, tool)
        found = self._found_tools[wanted]
        if isinstance(found, str):
            raise _Unsuited(found)
        return found

    def _once(self, value: H) -> H:
        return cast("H", self._kept.setdefault(value, value))


def _check_place(document: Annotation, path: Path, name: AnnotationName) -> None:
    """Say of a document that it is not what a study has at its place."""
    person = path.parent.name
    if document.annotator != person and _folded(document.annotator) != _folded(person):
        raise _Unsuited(f"it lies in the folder of {person!r}, and its annotator is {document.annotator!r}")
    if (document.method, document.repeat) != (name.method, name.repeat):
        raise _Unsuited(
            f"its name says {name.method}, repeat {name.repeat}, "
            f"and its content {document.method}, repeat {document.repeat}"
        )


def _folded(name: str) -> str:
    # Some systems take the accents in the name of a folder apart.
    return unicodedata.normalize("NFC", name)


def _in_words(error: UserError, path: Path | None = None) -> str:
    """Return what was wrong, and in which line; the file is named beside it."""
    where = "" if error.where is None else str(error.where)
    if path is not None and where.startswith(str(path)):
        where = where.removeprefix(str(path)).removeprefix(", ")
    return f"{where}: {error.problem}" if where else error.problem
