"""From a document of one method to a new one of the other, marked as derived; the original stays as it is."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    Certainty,
    KeypointAnnotation,
    Source,
    State,
    new_annotation,
)
from annotations.documents.files import ships
from annotations.documents.provenance import Derivation
from annotations.documents.record import Method, changed
from annotations.documents.representations import keypoints_of
from annotations.documents.study import AnnotationName, annotation_name
from annotations.documents.volume_link import referenced_path, relative_path
from annotations.errors import UserError
from annotations.geometry.box_conversion import boxes_from_keypoints
from annotations.geometry.boxes import Box
from annotations.geometry.tool import Link, ToolSpecification

# From what was seen best to what was seen least.
_STATES: tuple[State, ...] = ("placed", "occluded", "out_of_view")
_CERTAINTIES: tuple[Certainty, ...] = ("sure", "unsure")


class ConversionRefused(UserError):  # noqa: N818 - named for what happened
    """A document that is of the wanted method already, or of which nothing by that method follows."""


def to_keypoints(
    document: Annotation, tool: ToolSpecification, *, original: Path, derived: Path
) -> Annotation:
    """Return the document of keypoints that follows from one of boxes.

    Each keypoint is the centre of an x face of its box, and as `keypoints_of` says; its source is
    ``derived``, or still ``fitted``.

    Parameters
    ----------
    original, derived : Path
        Where the document is kept, and where the new one will be: the paths in it are relative to there.

    Raises
    ------
    ConversionRefused
        It is a document of keypoints, or no box is placed.
    """
    fresh = _begun(document, tool, "keypoints", original, derived)
    if not document.placed_boxes:
        raise _nothing_follows("keypoints", original, "Place a box first")
    keypoints = tuple(
        keypoint
        if keypoint.state == "unplaced"
        else changed(keypoint, source=_derived_source([keypoint]), locked=False)
        for keypoint in keypoints_of(document, tool)
    )
    return changed(fresh, keypoints=keypoints)


def to_boxes(
    document: Annotation,
    tool: ToolSpecification,
    *,
    original: Path,
    derived: Path,
    roll_deg: float | None = None,
) -> Annotation:
    """Return the document of boxes that follows from one of keypoints, by `boxes_from_keypoints`.

    A box has the worse state and certainty of its two keypoints, and the source ``derived``, or ``fitted``
    where one of them is. Keypoints that end no box (`keypoints_without_box`) are not in the new document.

    Parameters
    ----------
    original, derived : Path
        As for `to_keypoints`.
    roll_deg : float, optional
        As for `boxes_from_keypoints`; the new document says it in ``derived_from``.

    Raises
    ------
    ConversionRefused
        It is a document of boxes, or no link has both of its keypoints placed.
    RollUnknown
        No roll is given, and the keypoints do not show it.
    """
    fresh = _begun(document, tool, "boxes", original, derived, roll_deg)
    boxes = boxes_from_keypoints(document.positions_um, tool, roll_deg=roll_deg)
    if not boxes:
        raise _nothing_follows("boxes", original, "Place both keypoints of a link first")
    parts = tuple(
        _derived_box(document, tool.link(part.link), boxes[part.link]) if part.link in boxes else part
        for part in fresh.boxes
    )
    return changed(fresh, boxes=parts)


def keypoints_without_box(document: Annotation, derived: Annotation, tool: ToolSpecification) -> list[str]:
    """Return the keypoints with a position, of a document, that end no box of the one derived from it."""
    boxed = {name for link in derived.placed_boxes for name in (tool.link(link).base, tool.link(link).tip)}
    return [name for name in document.positions_um if name not in boxed]


def sibling_path(path: Path, method: Method) -> Path:
    """Return where the document of a method is kept beside the one of the other: ``v001.boxes.json``."""
    name = annotation_name(path) or AnnotationName(path.name.removesuffix(".json"), method)
    return path.with_name(replace(name, method=method).file_name)


def _begun(
    document: Annotation,
    tool: ToolSpecification,
    method: Method,
    original: Path,
    derived: Path,
    roll_deg: float | None = None,
) -> Annotation:
    if document.method == method:
        raise ConversionRefused(
            f"it is a document of {method} already",
            where=original,
            remedy="Convert it to the other method",
        )
    volume_path = relative_path(referenced_path(document.volume, original), derived)
    fresh = new_annotation(
        changed(document.volume, path=volume_path),
        tool,
        document.annotator,
        method,
        ships=ships(tool),
        repeat=document.repeat,
    )
    origin = Derivation(path=relative_path(original, derived), method=document.method, roll_deg=roll_deg)
    # What began with a network's prediction is no less its own because boxes are drawn around it.
    begun = document.predicted_from
    if begun is not None:
        begun = changed(begun, path=relative_path(referenced_path(begun, original), derived))
    return changed(fresh, derived_from=origin, predicted_from=begun)


def _nothing_follows(method: Method, original: Path, remedy: str) -> ConversionRefused:
    return ConversionRefused(f"no {method} follow from what is placed", where=original, remedy=remedy)


def _derived_source(origins: Iterable[KeypointAnnotation]) -> Source:
    """Return the source of what follows from keypoints: what nobody has seen stays known as that."""
    return "fitted" if any(origin.source == "fitted" for origin in origins) else "derived"


def _derived_box(document: Annotation, link: Link, box: Box) -> BoxAnnotation:
    ends = [document.keypoint(name) for name in (link.base, link.tip)]
    return BoxAnnotation(
        link=link.name,
        state=max((end.state for end in ends), key=_STATES.index),
        center_um=box.center_um,
        size_um=box.size_um,
        rotation_wxyz=box.rotation_wxyz,
        certainty=max((end.certainty for end in ends), key=_CERTAINTIES.index),
        source=_derived_source(ends),
    )
