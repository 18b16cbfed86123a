"""Checks of annotation files: everything that is wrong, missing, stale or implausible, each in words."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.files import DocumentError, completed, load_annotation, tool_of
from annotations.documents.representations import keypoint_positions_um
from annotations.documents.seen_volumes import SeenVolumes
from annotations.documents.visibility import extent_um
from annotations.documents.volume_link import compare, referenced_path
from annotations.errors import UserError
from annotations.geometry.angles import angle_deg
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import find_tools

# A link's length on the nominal one: the specification's lengths are themselves estimates.
PLAUSIBLE_LENGTH_RATIO = (0.5, 2.0)
# How far apart the boxes at a joint may show its hinge: both are turned about their own x by eye.
_PLAUSIBLE_HINGE_DEG = 25.0


@dataclass(frozen=True)
class Finding:
    """Something about an annotation file that a person should look at.

    Attributes
    ----------
    kind : str
        ``file``, ``tool``, ``volume``, ``shape``, ``dtype``, ``fingerprint``, ``spacing``, ``keypoint``,
        ``box``, ``link`` or ``original``; where the tool's fit is asked as well, also ``plausibility``. Those
        of a whole study: see `annotations.documents.study_checks`.
    problem : str
        What was found.
    """

    kind: str
    problem: str


def check_file(path: Path, tool_folders: Sequence[Path] = ()) -> tuple[Finding, ...]:
    """Check an annotation file and the volume that it names; no finding is good news.

    Parameters
    ----------
    tool_folders : sequence of Path
        Where tool specifications are looked for before the shipped ones.
    """
    try:
        annotation, _ = load_annotation(path)
    except DocumentError as error:
        return (Finding("file", str(error)),)
    return check_document(annotation, path, tool_folders, SeenVolumes())


def check_document(
    annotation: Annotation, path: Path, tool_folders: Sequence[Path], volumes: SeenVolumes
) -> tuple[Finding, ...]:
    """Check the document that was read from a file, likewise; volumes that were seen are not read again."""
    findings: list[Finding] = []
    try:
        tool = tool_of(annotation, tool_folders)
    except (ToolError, DocumentError) as error:
        findings.append(Finding("tool", str(error)))
    else:
        findings.extend(_check_copy(annotation, tool_folders))
        try:
            findings.extend(check_annotation(completed(annotation, tool), tool))
        except DocumentError as error:
            findings.append(Finding(_kind(annotation), str(error)))
    findings.extend(_check_original(annotation, path))
    findings.extend(_check_volume(annotation, path, volumes))
    return tuple(findings)


def check_annotation(annotation: Annotation, tool: ToolSpecification) -> Iterator[Finding]:
    """Check what a document says, without its volume: what is unfinished, contradictory or implausible."""
    kind = _kind(annotation)
    unplaced = [part.name for part in annotation.parts if part.state == "unplaced"]
    if annotation.status == "done" and unplaced:
        yield Finding(kind, f"it is marked as done, but {', '.join(unplaced)} are unplaced")
    for part in annotation.parts:
        if part.state == "unplaced":
            continue
        inside = [annotation.volume.contains(each_um) for each_um in extent_um(part)]
        called = "its position" if kind == "keypoint" else "its box, from end to end,"
        if all(inside) and part.state == "out_of_view":
            yield Finding(kind, f"{part.name} is out of view, but {called} is inside the volume")
        if not any(inside) and part.state != "out_of_view":
            yield Finding(kind, f"{part.name} is {part.state}, but {called} is outside the volume")
    positions_um = keypoint_positions_um(annotation, tool)
    low, high = PLAUSIBLE_LENGTH_RATIO
    for link in tool.links:
        if link.base not in positions_um or link.tip not in positions_um:
            continue
        length_um = math.dist(positions_um[link.tip], positions_um[link.base])
        if not low * link.length_um <= length_um <= high * link.length_um:
            yield Finding(
                "link",
                f"{link.name} is {length_um:.0f} µm long from {link.base} to {link.tip}, "
                f"nominal are {link.length_um:.0f} µm",
            )
    yield from _check_hinges(annotation, tool)


def _check_hinges(annotation: Annotation, tool: ToolSpecification) -> Iterator[Finding]:
    """Check that the boxes at each joint agree about its hinge, from which signed angles follow."""
    boxes = annotation.placed_boxes
    for joint in tool.joints:
        if joint.parent in boxes and joint.child in boxes:
            # A turn about the hinge leaves its own direction: it is the same in both links' frames.
            shown = [boxes[link].axes @ joint.hinge_axis for link in (joint.parent, joint.child)]
            apart_deg = angle_deg(*shown)
            if apart_deg > _PLAUSIBLE_HINGE_DEG:
                yield Finding(
                    "box",
                    f"{joint.parent} and {joint.child} show the hinge of {joint.name} in directions that are "
                    f"{apart_deg:.0f}° apart: one of them is turned wrongly",
                )


def _kind(annotation: Annotation) -> str:
    return "keypoint" if annotation.method == "keypoints" else "box"


def _check_original(annotation: Annotation, path: Path) -> Iterator[Finding]:
    """Check that what a document was derived from is as it was, until a person has gone over each part."""
    if annotation.derived_from is None or all(part.source != "derived" for part in annotation.parts):
        return
    original_path = referenced_path(annotation.derived_from, path)
    try:
        original, _ = load_annotation(original_path)
    except DocumentError as error:
        yield Finding("original", f"what it was derived from is not to be read: {error}")
        return
    if original.modified > annotation.created:
        yield Finding("original", f"it was derived from {original_path}, which has been saved since then")


def _check_copy(annotation: Annotation, tool_folders: Sequence[Path]) -> Iterator[Finding]:
    if annotation.tool_copy is None:
        return
    try:
        found = find_tools(tool_folders).get(annotation.tool)
    except ToolError as error:
        yield Finding("tool", str(error))
        return
    if found is not None and found.fingerprint != annotation.tool_copy.fingerprint:
        yield Finding(
            "tool", f"its copy of the tool {annotation.tool!r} is not the one found here under that name"
        )


def _check_volume(annotation: Annotation, path: Path, volumes: SeenVolumes) -> Iterator[Finding]:
    volume_path = referenced_path(annotation.volume, path)
    try:
        volume, fingerprint = volumes.look(volume_path, annotation.volume.dataset)
    except UserError as error:
        yield Finding("volume", str(error))
        return
    for finding in compare(annotation.volume, volume, fingerprint):
        yield Finding(finding.kind, finding.problem)
