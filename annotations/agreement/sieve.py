"""Which of the documents that were read can be compared with each other."""

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from annotations.agreement.documents_read import DocumentRead
from annotations.agreement.results import LeftOut

Sifted = tuple[list[DocumentRead], list[LeftOut]]
"""Those that stay, in their order, and those that do not, with the reason."""

H = TypeVar("H", bound=Hashable)

_SAME_SPACING = 1e-6


def sift(documents: Sequence[DocumentRead]) -> Sifted:
    """Keep what can be compared: one tool, for each volume one content and one spacing, no document twice.

    Where documents disagree, most of them are taken to be right, and of equally many those that come first.
    """
    left_out: list[LeftOut] = []
    kept = list(documents)
    for rule in (_of_one_tool, _of_one_content, _each_once, _of_one_spacing):
        kept, dropped = rule(kept)
        left_out += dropped
    return kept, left_out


def _of_one_tool(documents: Sequence[DocumentRead]) -> Sifted:
    if not documents:
        return [], []
    usual = _most_frequent(document.tool_key for document in documents)

    def reason(document: DocumentRead) -> str:
        if document.tool_key[0] != usual[0]:
            return f"its tool is {document.tool_key[0]!r}, that of most files {usual[0]!r}"
        return f"it was made with another version of the tool {usual[0]!r} than most files"

    return _split(documents, lambda document: document.tool_key == usual, reason)


def _of_one_content(documents: Sequence[DocumentRead]) -> Sifted:
    usual = {
        volume: _most_frequent(document.fingerprint for document in those)
        for volume, those in _by_volume(documents).items()
    }
    return _split(
        documents,
        lambda document: document.fingerprint == usual[document.volume],
        lambda document: (
            f"it was made on another volume than most annotations of {document.volume!r}: "
            "the fingerprint of the volume's content differs"
        ),
    )


def _each_once(documents: Sequence[DocumentRead]) -> Sifted:
    latest: dict[tuple[str, str, str, int], DocumentRead] = {}
    for document in documents:
        before = latest.get(_work(document))
        if before is None or document.modified > before.modified:
            latest[_work(document)] = document
    return _split(
        documents,
        lambda document: latest[_work(document)] is document,
        lambda document: (
            f"it is the same volume, annotator, method and pass as {latest[_work(document)].path}, "
            "which was modified later"
            if latest[_work(document)].modified > document.modified
            else f"it is the same volume, annotator, method and pass as {latest[_work(document)].path}"
        ),
    )


def _work(document: DocumentRead) -> tuple[str, str, str, int]:
    return document.volume, document.annotator, document.method, document.repeat


def _of_one_spacing(documents: Sequence[DocumentRead]) -> Sifted:
    usual = {
        volume: _most_frequent(document.spacing_um for document in those)
        for volume, those in _by_volume(documents).items()
    }

    def is_usual(document: DocumentRead) -> bool:
        spacing_um = usual[document.volume]
        return document.spacing_um == spacing_um or np.allclose(
            document.spacing_um, spacing_um, rtol=_SAME_SPACING, atol=0
        )

    return _split(
        documents,
        is_usual,
        lambda document: (
            f"it was made with the spacing {document.spacing_um} µm, most annotations of the volume with "
            f"{usual[document.volume]} µm: positions cannot be compared"
        ),
    )


def _most_frequent(values: Iterable[H]) -> H:
    return Counter(values).most_common(1)[0][0]


def _by_volume(documents: Iterable[DocumentRead]) -> dict[str, list[DocumentRead]]:
    groups: dict[str, list[DocumentRead]] = {}
    for document in documents:
        groups.setdefault(document.volume, []).append(document)
    return groups


def _split(
    documents: Iterable[DocumentRead],
    stays: Callable[[DocumentRead], bool],
    reason: Callable[[DocumentRead], str],
) -> Sifted:
    kept: list[DocumentRead] = []
    left_out: list[LeftOut] = []
    for document in documents:
        if stays(document):
            kept.append(document)
        else:
            left_out.append(LeftOut(path=document.path, reason=reason(document)))
    return kept, left_out
