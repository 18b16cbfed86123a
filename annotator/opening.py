"""Opening a volume with its annotation: everything that reads files, done before anything is shown."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from annotations.documents.annotation import Annotation, new_annotation
from annotations.documents.files import (
    DocumentError,
    FileIdentity,
    completed,
    load_annotation,
    ships,
    tool_of,
)
from annotations.documents.volume_link import compare, reference_to
from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotations.volumes import Level, Volume, fingerprint, intensity_window, open_volume, strided_preview
from annotator.spacing_answer import SpacingAnswer
from annotator.worklist import WorkItem

_SOURCES = {
    "file": "from the volume's file",
    "sidecar": "from the file beside the volume",
    "folder": "as answered for this folder",
}


@dataclass(frozen=True)
class Found:
    """A volume and its annotation file as they stand on disk, before the spacing is settled.

    Attributes
    ----------
    document : Annotation or None
        None where there is no annotation file yet.
    identity : str
        Of the annotation file's content, "" where there is none.
    fingerprint : str
        The volume's.
    """

    item: WorkItem
    volume: Volume
    fingerprint: str
    document: Annotation | None
    identity: FileIdentity
    tool: ToolSpecification


@dataclass(frozen=True)
class Opened:
    """A volume ready to be shown.

    Attributes
    ----------
    spacing_note : str
        Where the spacing comes from, in words.
    window : (float, float)
        Intensities that make a good first picture.
    warnings : tuple of UserError
        What the annotator must know before going on.
    """

    found: Found
    document: Annotation
    spacing_um: Vector
    spacing_note: str
    level: Level
    window: tuple[float, float]
    warnings: tuple[UserError, ...]


def find(item: WorkItem, dataset: str | None, tool_name: str, tool_folders: tuple[Path, ...]) -> Found:
    """Open a volume and read its annotation file, if there is one.

    Raises
    ------
    UserError
        The volume or the annotation cannot be read, or do not belong together; both are untouched.
    """
    volume = open_volume(item.volume_path, dataset=dataset or item.dataset)
    if not item.annotation_path.exists():
        return Found(item, volume, fingerprint(volume), None, "", find_tool(tool_name, tool_folders))
    document, identity = load_annotation(item.annotation_path)
    try:
        tool = tool_of(document, tool_folders)
        document = completed(document, tool)
    except UserError as error:
        raise DocumentError(
            error.problem, where=error.where or item.annotation_path, remedy=error.remedy
        ) from error
    found = Found(item, volume, fingerprint(volume), document, identity, tool)
    _refuse_other_volume(found, document)
    return found


def known_spacing(
    found: Found, said: Vector | None, remembered: Callable[[str], SpacingAnswer | None]
) -> tuple[Found, Vector, str] | None:
    """Return what was found, its spacing in µm and where that comes from; None where a person must say it.

    An annotation's own spacing comes first: its positions were made with it.

    Parameters
    ----------
    said : (float, float, float) or None
        Given when the program was started.
    remembered : callable
        From a volume's fingerprint to what a person answered before.
    """
    if found.document is not None:
        return found, found.document.volume.spacing_um, "from the annotation"
    if said is not None:
        return found, said, "as given at the start"
    if found.volume.spacing_um is not None and found.volume.spacing_source is not None:
        return found, found.volume.spacing_um, _SOURCES[found.volume.spacing_source]
    if found.item.spacing_um is not None:
        return found, found.item.spacing_um, "from the study"
    answer = remembered(found.fingerprint)
    if answer is None:
        return None
    return with_depth_axis(found, answer.depth_axis), answer.spacing_um, "as answered before"


def with_depth_axis(found: Found, depth_axis: int) -> Found:
    """Return what was found with the depth along another axis, as a person said."""
    return replace(found, volume=replace(found.volume, depth_axis=depth_axis))


def prepare(found: Found, spacing_um: Vector, spacing_note: str, annotator: str) -> Opened:
    """Read the preview and begin a document where there is none; takes a fraction of a second."""
    document = found.document or new_annotation(
        reference_to(found.volume, spacing_um, found.item.annotation_path, found.fingerprint),
        found.tool,
        annotator,
        "keypoints",
        ships=ships(found.tool),
    )
    level = strided_preview(found.volume, spacing_um)
    warnings = tuple(
        UserError(
            finding.problem,
            where=found.item.annotation_path,
            remedy="Positions stay as they were made; check that this is the right volume",
        )
        for finding in compare(document.volume, found.volume, found.fingerprint)
    )
    return Opened(found, document, spacing_um, spacing_note, level, intensity_window(level), warnings)


def _refuse_other_volume(found: Found, document: Annotation) -> None:
    for finding in compare(document.volume, found.volume, found.fingerprint):
        if finding.kind in ("shape", "dtype"):
            raise DocumentError(
                finding.problem,
                where=found.item.annotation_path,
                remedy="Put the right volume back, or move the annotation file away to begin a new one",
            )
