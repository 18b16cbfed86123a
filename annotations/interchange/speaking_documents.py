"""Which annotation speaks for each volume of a study, and which volumes are left without one."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from annotations.documents.annotation import Annotation
from annotations.documents.files import completed, load_annotation, tool_of
from annotations.documents.record import Method
from annotations.documents.study import (
    CONSENSUS,
    AnnotationName,
    Study,
    StudyVolume,
    annotation_files,
    annotation_name,
)
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
        The one who speaks for every volume; None for the consensus, else the only one who is done.
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
    """

    volume: StudyVolume
    annotator: str
    repeat: int
    path: Path
    sha256: str
    annotation: Annotation
    tool: ToolSpecification


@dataclass(frozen=True)
class LeftOut:
    """A volume, or one of its annotations, that gets no row.

    Attributes
    ----------
    volume_id : str
    kind : str
        Of a volume ``unannotated``: there is nothing by this method; and ``several``: nobody said who speaks
        for it. Of an annotation ``unfinished``: it is not done; and ``unusable``: it cannot be read, or is of
        another tool; its volume has no row then, unless every annotation has one.
    reason : str
        In words, as a sentence without its full stop.
    """

    volume_id: str
    kind: Literal["unannotated", "unfinished", "several", "unusable"]
    reason: str


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
    by_volume = _candidates(folder, choice)
    documents: list[SpeakingDocument] = []
    left_out: list[LeftOut] = []
    for number, volume in enumerate(study.volumes):
        if cancelled():
            raise Cancelled
        progress(number / len(study.volumes))
        for found in _of_volume(volume, by_volume[volume.id], tool, tool_folders, choice):
            if isinstance(found, LeftOut):
                left_out.append(found)
            else:
                documents.append(found)
    progress(1.0)
    return tuple(documents), tuple(left_out)


def _candidates(folder: Path, choice: Choice) -> defaultdict[str, list[_Candidate]]:
    by_volume: defaultdict[str, list[_Candidate]] = defaultdict(list)
    for path in annotation_files(folder):
        name, annotator = annotation_name(path), path.parent.name
        if (
            name is not None
            and name.method == choice.method
            and choice.annotator in (None, annotator)
            and (choice.every or not name.repeat)
        ):
            by_volume[name.volume_id].append(_Candidate(annotator, name, path))
    return by_volume


def _of_volume(
    volume: StudyVolume,
    candidates: Sequence[_Candidate],
    tool: ToolSpecification,
    tool_folders: Sequence[Path],
    choice: Choice,
) -> Iterator[SpeakingDocument | LeftOut]:
    found: list[SpeakingDocument | LeftOut] = []
    if not choice.every:
        # The consensus alone, where it can be had, whatever the annotators' own documents say.
        settled = [one for one in candidates if one.annotator == CONSENSUS]
        candidates = [one for one in candidates if one.annotator != CONSENSUS]
        found += [_read(volume, one, tool, tool_folders, choice) for one in settled]
        if any(isinstance(one, SpeakingDocument) for one in found):
            yield from found
            return
    found += [_read(volume, one, tool, tool_folders, choice) for one in candidates]
    if not found:
        who = "nobody has" if choice.annotator is None else f"{choice.annotator} has not"
        yield LeftOut(volume.id, "unannotated", f"{who} annotated it by {choice.method}")
    documents = [one for one in found if isinstance(one, SpeakingDocument)]
    if not choice.every and len(documents) > 1:
        names = ", ".join(document.annotator for document in documents)
        reason = f"{names} have annotated it, and there is no consensus"
        yield LeftOut(volume.id, "several", reason)
        found = [one for one in found if isinstance(one, LeftOut)]
    elif not choice.every and any(isinstance(one, LeftOut) and one.kind == "unusable" for one in found):
        # Whose it would have been, and whether it is done, nobody can tell.
        found = [one for one in found if isinstance(one, LeftOut)]
    yield from found


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
            return LeftOut(volume.id, "unfinished", f"{candidate.annotator}'s annotation is not done")
        own_tool = _tool_of(annotation, tool, tool_folders)
        annotation = completed(annotation, own_tool)
    except UserError as error:
        return LeftOut(
            volume.id, "unusable", f"{candidate.path.name} of {candidate.annotator} cannot be used: {error}"
        )
    if annotation.method != choice.method or _meaning(own_tool) != _meaning(tool):
        return LeftOut(
            volume.id,
            "unusable",
            f"{candidate.path.name} of {candidate.annotator} cannot be used: it is of {annotation.method} of "
            f"the tool {own_tool.name!r}, whose targets are not those of the study's tool {tool.name!r}",
        )
    return SpeakingDocument(
        volume, candidate.annotator, candidate.name.repeat, candidate.path, sha256, annotation, own_tool
    )


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
