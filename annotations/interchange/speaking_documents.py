"""Which annotation speaks for each volume of a study, and which volumes are left without one."""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from annotations.documents.annotation import Annotation
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.documents.record import Method
from annotations.documents.standing import standing
from annotations.documents.study import (
    CONSENSUS,
    AnnotationName,
    Study,
    StudyVolume,
    annotation_files,
    annotation_name,
)
from annotations.documents.volume_link import referenced_path
from annotations.errors import Cancelled, UserError
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class Choice:
    """Whose annotations are wanted.

    Attributes
    ----------
    method : str
        ``keypoints`` or ``boxes``.
    annotator : str or None
        The one who speaks for every volume, whoever or whatever placed the parts; None for the consensus,
        else the only person who is done.
    every : bool
        All annotations, repeats and consensus included, instead of one per volume.
    unfinished : bool
        Those that are not done count as well.
    """

    method: Method
    annotator: str | None = None
    every: bool = False
    unfinished: bool = False


@dataclass(frozen=True)
class SpeakingDocument:
    """An annotation that speaks for a volume.

    Attributes
    ----------
    volume : StudyVolume
    annotator : str
        Whose folder it lies in.
    repeat : int
        Which of the annotator's passes it is.
    path : Path
    sha256 : str
        Of the file's bytes as they were read.
    annotation : Annotation
        With every part of its tool.
    tool : ToolSpecification
        With which it was made.
    stale : str
        Of a consensus, why it is to be settled again, as a sentence without its full stop; else empty.
    """

    volume: StudyVolume
    annotator: str
    repeat: int
    path: Path
    sha256: str
    annotation: Annotation
    tool: ToolSpecification
    stale: str = ""


@dataclass(frozen=True)
class LeftOut:
    """A volume, or one of its annotations, that gets no row.

    Attributes
    ----------
    volume_id : str
    kind : str
        Of a volume ``unannotated``: there is nothing by this method; and ``several``: nobody said who speaks
        for it. Of an annotation ``unplaced``: nobody placed anything in it; ``unfinished``: it is not done;
        and ``unusable``: it cannot be read, or is of another tool; its volume has no row then, unless every
        annotation has one.
    reason : str
        In words, as a sentence without its full stop.
    annotator : str or None
        Whose annotation it is; None of a volume.
    """

    volume_id: str
    kind: Literal["unannotated", "unfinished", "unplaced", "several", "unusable"]
    reason: str
    annotator: str | None = None


_Found = SpeakingDocument | LeftOut


@dataclass(frozen=True)
class _Candidate:
    annotator: str
    name: AnnotationName
    path: Path


def speaking_documents(
    study: Study,
    folder: Path,
    tool: ToolSpecification,
    tool_folders: Sequence[Path],
    choice: Choice,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[tuple[SpeakingDocument, ...], tuple[LeftOut, ...]]:
    """Find the annotations that speak for a study's volumes, in the study's order.

    Where no annotator is named, only annotations count in which a person placed something. A study in which
    no person has done anything by this method, but a simulation has, is a synthetic one: there it speaks.

    Parameters
    ----------
    tool : ToolSpecification
        The study's: annotations with other keypoints or targets are left out.
    tool_folders : sequence of Path
        Where the tools of annotations are looked for before the shipped ones.
    choice : Choice
    progress, cancelled : callable, optional
        Told the share that is done, and asked whether to stop, before each volume.

    Raises
    ------
    Cancelled
        `cancelled` returned true.
    """
    alone = study.volumes[0].id if len(study.volumes) == 1 else None
    by_volume = _candidates(folder, choice, alone)
    found: list[tuple[StudyVolume, tuple[_Found, ...]]] = []
    for number, volume in enumerate(study.volumes):
        if cancelled():
            raise Cancelled
        progress(number / len(study.volumes))
        found.append((volume, tuple(_found(volume, by_volume[volume.id], tool, tool_folders, choice))))
    progress(1.0)
    counts = _rule(choice, [one for _, of_volume in found for one in of_volume])
    chosen = [one for volume, of_volume in found for one in _chosen(volume, of_volume, choice, counts)]
    return (
        tuple(one for one in chosen if isinstance(one, SpeakingDocument)),
        tuple(one for one in chosen if isinstance(one, LeftOut)),
    )


def _candidates(folder: Path, choice: Choice, volume_id: str | None) -> defaultdict[str, list[_Candidate]]:
    by_volume: defaultdict[str, list[_Candidate]] = defaultdict(list)
    for path in annotation_files(folder, volume_id):
        name, annotator = annotation_name(path), path.parent.name
        if (
            name is not None
            and name.method == choice.method
            and choice.annotator in (None, annotator)
            and (choice.every or not name.repeat)
        ):
            by_volume[name.volume_id].append(_Candidate(annotator, name, path))
    return by_volume


def _found(
    volume: StudyVolume,
    candidates: Sequence[_Candidate],
    tool: ToolSpecification,
    tool_folders: Sequence[Path],
    choice: Choice,
) -> Iterator[_Found]:
    """Read what may speak for a volume: the consensus alone, where it can be had, whatever the others say."""
    if not choice.every:
        settled = [
            _read(volume, one, tool, tool_folders, choice) for one in candidates if one.annotator == CONSENSUS
        ]
        yield from settled
        if any(isinstance(one, SpeakingDocument) and _has_placed(one) for one in settled):
            return
        candidates = [one for one in candidates if one.annotator != CONSENSUS]
    for one in candidates:
        yield _read(volume, one, tool, tool_folders, choice)


def _rule(choice: Choice, found: Iterable[_Found]) -> Callable[[SpeakingDocument], bool]:
    """Return what says whether a document counts."""
    if choice.annotator is not None:
        return _has_positions
    if any(one.kind == "unfinished" if isinstance(one, LeftOut) else _has_placed(one) for one in found):
        return _has_placed
    return _is_simulated


def _has_positions(document: SpeakingDocument) -> bool:
    return any(part.anchor_um is not None for part in document.annotation.parts)


def _has_placed(document: SpeakingDocument) -> bool:
    return _any_counted(document.annotation)


def _any_counted(annotation: Annotation) -> bool:
    return any(standing(part) == "counted" for part in annotation.parts)


def _is_simulated(document: SpeakingDocument) -> bool:
    return any(standing(part) == "synthesized" for part in document.annotation.parts)


def _chosen(
    volume: StudyVolume,
    found: Sequence[_Found],
    choice: Choice,
    counts: Callable[[SpeakingDocument], bool],
) -> Iterator[_Found]:
    """Choose who speaks for a volume; yields also what is left out of it."""
    documents: list[SpeakingDocument] = []
    left_out: list[LeftOut] = []
    for one in found:
        if isinstance(one, LeftOut):
            left_out.append(one)
        elif counts(one):
            documents.append(one)
        else:
            left_out.append(_unplaced(volume, one.annotator))
    if not found:
        who = "nobody has" if choice.annotator is None else f"{choice.annotator} has not"
        yield LeftOut(volume.id, "unannotated", f"{who} annotated it by {choice.method}")
    if not choice.every and len(documents) > 1:
        names = ", ".join(document.annotator for document in documents)
        why = next((one.reason for one in left_out if one.annotator == CONSENSUS), "there is no consensus")
        yield LeftOut(volume.id, "several", f"{names} have annotated it, and {why}")
        documents, left_out = [], [one for one in left_out if one.annotator != CONSENSUS]
    elif not choice.every and any(one.kind == "unusable" for one in left_out):
        # Whose it would have been, and whether it is done, nobody can tell.
        documents = []
    yield from documents
    yield from left_out


def _read(
    volume: StudyVolume,
    candidate: _Candidate,
    tool: ToolSpecification,
    tool_folders: Sequence[Path],
    choice: Choice,
) -> SpeakingDocument | LeftOut:
    try:
        annotation, sha256 = load_annotation(candidate.path)
        if annotation.status != "done" and not choice.unfinished:
            # Opening a volume, or looking at a prediction, begins an annotation: that is no work yet.
            if not _any_counted(annotation):
                return _unplaced(volume, candidate.annotator)
            return LeftOut(
                volume.id, "unfinished", f"{_whose(candidate.annotator)} is not done", candidate.annotator
            )
        own_tool = _tool_of(annotation, tool, tool_folders)
        annotation = completed(annotation, own_tool)
    except UserError as error:
        return LeftOut(
            volume.id,
            "unusable",
            f"{candidate.path.name} of {candidate.annotator} cannot be used: {error}",
            candidate.annotator,
        )
    if annotation.method != choice.method or _meaning(own_tool) != _meaning(tool):
        return LeftOut(
            volume.id,
            "unusable",
            f"{candidate.path.name} of {candidate.annotator} cannot be used: it is of {annotation.method} of "
            f"the tool {own_tool.name!r}, whose targets are not those of the study's tool {tool.name!r}",
            candidate.annotator,
        )
    return SpeakingDocument(
        volume,
        candidate.annotator,
        candidate.name.repeat,
        candidate.path,
        sha256,
        annotation,
        own_tool,
        stale=_staleness(candidate.path, annotation),
    )


def _unplaced(volume: StudyVolume, annotator: str) -> LeftOut:
    return LeftOut(volume.id, "unplaced", f"nobody placed anything in {_whose(annotator)}", annotator)


def _whose(annotator: str) -> str:
    return "the consensus" if annotator == CONSENSUS else f"{annotator}'s annotation"


def _staleness(path: Path, annotation: Annotation) -> str:
    """Return why a consensus is to be settled again; empty where what it was made from is as it was."""
    said = []
    for source in annotation.consensus_of:
        try:
            content = referenced_path(source, path).read_bytes()
        except OSError:
            said.append(f"from an annotation of {source.annotator}'s that cannot be read any more")
            continue
        if hashlib.sha256(content).hexdigest() != source.sha256:
            said.append(f"before {source.annotator}'s annotation changed")
    return f"the consensus was settled {', and '.join(said)}: settle it again" if said else ""


def _tool_of(
    annotation: Annotation, usual: ToolSpecification, tool_folders: Sequence[Path]
) -> ToolSpecification:
    # Nearly all documents are of the study's tool, and looking for one reads every specification there is.
    said = (annotation.tool, annotation.tool_copy)
    if said == (usual.name, None) and annotation.tool_fingerprint in (None, usual.fingerprint):
        return usual
    return tool_of(annotation, tool_folders)


def _meaning(tool: ToolSpecification) -> object:
    """Return what a tool's targets are made of; lengths and colours may differ, as after a calibration."""
    ends = {link.name: (link.base, link.tip) for link in tool.links}
    return tool.keypoint_names, ends, tool.targets, frozenset(joint.name for joint in tool.joints)
