"""What is kept of each document that is compared, beside its points."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import PurePosixPath

import numpy as np

from annotations.agreement.compared import Compared
from annotations.agreement.part_table import PartTable
from annotations.agreement.results import Input
from annotations.documents.record import Method, Status
from annotations.documents.standing import STANDINGS
from annotations.geometry.frames import Vector

_NO_POSITION = STANDINGS.index("no_position")
# Digits of a fingerprint.
_TOLD_APART_BY = 8


@dataclass(frozen=True, slots=True)
class DocumentRead:
    """One document; its points are in a row of a `PartTable`.

    Attributes
    ----------
    path, sha256 : str
        Of its file, relative to what is compared.
    tool_key : (str, str)
        Name and fingerprint of its tool.
    volume : str
        What volumes are told apart by: the id in a study, else the fingerprint.
    volume_name : str
        What people may call the volume.
    fingerprint : str
    spacing_um : (float, float, float)
    annotator, method, repeat, status, modified, active_seconds, is_blind, is_flagged
        As in the document.
    is_from_prediction : bool
        Whether it was begun from a network's prediction.
    row : int
    """

    path: str
    sha256: str
    tool_key: tuple[str, str]
    volume: str
    volume_name: str
    fingerprint: str
    spacing_um: Vector
    annotator: str
    method: Method
    repeat: int
    status: Status
    modified: datetime
    active_seconds: float
    is_blind: bool
    is_flagged: bool
    is_from_prediction: bool
    row: int


def inputs(documents: Iterable[DocumentRead], names: Mapping[str, str]) -> tuple[Input, ...]:
    """Return what a report says of documents; ``names`` are those of the volumes."""
    fields = set(Input.model_fields)
    return tuple(
        # Every field is valid where it comes from, and there may be hundreds of thousands of them.
        Input.model_construct(
            fields,
            path=document.path,
            volume=names[document.volume],
            annotator=document.annotator,
            method=document.method,
            repeat=document.repeat,
            status=document.status,
            sha256=document.sha256,
        )
        for document in documents
    )


def compared(
    method: Method,
    documents: Sequence[DocumentRead],
    table: PartTable,
    annotators: Sequence[str],
    names: Mapping[str, str],
) -> Compared:
    """Return one pass as arrays.

    Parameters
    ----------
    documents : sequence of DocumentRead
        One at most of each annotator and volume, all of one method and pass.
    table : PartTable
        Which has their rows.
    annotators : sequence of str
        In the order of the arrays.
    names : mapping of str to str
        What the volumes are called, in the order of the arrays; those without a document are not in them.
    """
    present = {document.volume for document in documents}
    volumes = [volume for volume in names if volume in present]
    place_of = {volume: place for place, volume in enumerate(volumes)}
    column_of = {annotator: column for column, annotator in enumerate(annotators)}
    at = (
        np.array([place_of[document.volume] for document in documents], dtype=np.intp),
        np.array([column_of[document.annotator] for document in documents], dtype=np.intp),
    )
    rows = table.keypoints([document.row for document in documents])
    shape = (len(volumes), len(annotators))

    def spread(values: np.ndarray, absent: float) -> np.ndarray:
        array = np.full((*shape, *values.shape[1:]), absent, dtype=values.dtype)
        array[at] = values
        return array

    def truths(values: Iterable[bool]) -> np.ndarray:
        return spread(np.fromiter(values, np.bool_, len(documents)), False)

    seconds = np.fromiter((document.active_seconds for document in documents), np.float64, len(documents))
    return Compared(
        method=method,
        volumes=tuple(names[volume] for volume in volumes),
        annotators=tuple(annotators),
        positions_um=spread(rows.positions_um, np.nan),
        standing=spread(rows.standing, _NO_POSITION),
        doubtful=spread(rows.doubtful, False),
        rotations_wxyz=None if rows.rotations_wxyz is None else spread(rows.rotations_wxyz, np.nan),
        has_document=truths(True for _ in documents),
        is_done=truths(document.status == "done" for document in documents),
        is_blind=truths(document.is_blind for document in documents),
        is_flagged=truths(document.is_flagged for document in documents),
        is_from_prediction=truths(document.is_from_prediction for document in documents),
        active_seconds=spread(seconds, np.nan),
    )


def volume_names(documents: Iterable[DocumentRead]) -> dict[str, str]:
    """Return a name for each volume, after its file and each used once, in the order of the names."""
    stems: dict[str, str] = {}
    for document in documents:
        stems.setdefault(document.volume, document.volume_name)
    often: dict[str, int] = {}
    for stem in stems.values():
        often[stem] = often.get(stem, 0) + 1
    named = {
        volume: stem if often[stem] == 1 else f"{stem} ({volume[:_TOLD_APART_BY]})"
        for volume, stem in stems.items()
    }
    return dict(sorted(named.items(), key=lambda item: (item[1].casefold(), item[0])))


def name_of_volume(path: str, dataset: str | None) -> str:
    """Return what people call a volume in a file: the file's name without its suffix, and the dataset."""
    stem = PurePosixPath(PurePosixPath(path).name.removesuffix(".gz")).stem
    return stem if dataset is None else f"{stem}/{dataset}"
