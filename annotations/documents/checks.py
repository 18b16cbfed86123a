"""Checks of annotation files: everything that is wrong, missing, stale or implausible, each in words."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.files import DocumentError, completed, load_annotation, tool_of
from annotations.documents.volume_link import compare, referenced_path
from annotations.errors import UserError
from annotations.geometry.frames import is_inside
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import find_tools
from annotations.volumes import fingerprint, open_volume

# A link's length on the nominal one: the specification's lengths are themselves estimates.
PLAUSIBLE_LENGTH_RATIO = (0.5, 2.0)


@dataclass(frozen=True)
class Finding:
    """Something about an annotation file that a person should look at.

    Attributes
    ----------
    kind : str
        ``file``, ``tool``, ``volume``, ``shape``, ``dtype``, ``fingerprint``, ``spacing``, ``keypoint``
        or ``link``.
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
            findings.append(Finding("keypoint", str(error)))
    findings.extend(_check_volume(annotation, path))
    return tuple(findings)


def check_annotation(annotation: Annotation, tool: ToolSpecification) -> Iterator[Finding]:
    """Check what a document says, without its volume: what is unfinished, contradictory or implausible."""
    unplaced = [keypoint.name for keypoint in annotation.keypoints if keypoint.state == "unplaced"]
    if annotation.method == "keypoints" and annotation.status == "done" and unplaced:
        yield Finding("keypoint", f"it is marked as done, but {', '.join(unplaced)} are unplaced")
    for keypoint in annotation.keypoints:
        if keypoint.position_um is None:
            continue
        inside = is_inside(keypoint.position_um, annotation.volume.shape, annotation.volume.spacing_um)
        if inside and keypoint.state == "out_of_view":
            yield Finding(
                "keypoint", f"{keypoint.name} is out of view, but its position is inside the volume"
            )
        if not inside and keypoint.state != "out_of_view":
            yield Finding(
                "keypoint", f"{keypoint.name} is {keypoint.state}, but its position is outside the volume"
            )
    positions_um = annotation.positions_um
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


def _check_volume(annotation: Annotation, path: Path) -> Iterator[Finding]:
    volume_path = referenced_path(annotation.volume, path)
    try:
        with open_volume(volume_path, dataset=annotation.volume.dataset) as volume:
            for finding in compare(annotation.volume, volume, fingerprint(volume)):
                yield Finding(finding.kind, finding.problem)
    except UserError as error:
        yield Finding("volume", str(error))
