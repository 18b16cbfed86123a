"""Writes the document of the other method beside the one that it follows from."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.conversion import keypoints_without_box, sibling_path, to_boxes, to_keypoints
from annotations.documents.files import DocumentError, save_annotation
from annotations.documents.record import Method
from annotations.geometry.box_conversion import RollUnknown, boxes_from_keypoints
from annotations.geometry.boxes import hinge_axes
from annotations.geometry.frames import Vector, vector
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification


@dataclass(frozen=True)
class Derived:
    """A document that was derived, and the keypoints that have no place in it."""

    path: Path
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class RollMeaning:
    """What boxes that are derived with a roll would say.

    Attributes
    ----------
    roll_deg : float
        Of the box of the first link.
    hinge_axis : (float, float, float)
        That box's own +y, a unit vector in the volume's frame.
    angles_deg : mapping of str to float
        The signed angles, by the names of their targets.
    """

    roll_deg: float
    hinge_axis: Vector
    angles_deg: Mapping[str, float]


def roll_meanings(
    document: Annotation, tool: ToolSpecification, unknown: RollUnknown
) -> tuple[RollMeaning, ...]:
    """Return what each of the rolls in question would mean; empty where nothing shows the roll."""
    meanings = []
    for roll_deg in unknown.candidates_deg:
        boxes = boxes_from_keypoints(document.positions_um, tool, roll_deg=roll_deg)
        targets = pose_targets(document.positions_um, tool, hinge_axes(boxes, tool))
        hinge_axis = vector(boxes[unknown.link].axes[:, 1])
        meanings.append(RollMeaning(roll_deg, hinge_axis, targets.signed_angles_deg))
    return tuple(meanings)


def write_derived(
    document: Annotation, tool: ToolSpecification, original: Path, method: Method, roll_deg: float | None
) -> Derived:
    """Write the derived document of a method.

    Raises
    ------
    DocumentError
        There is one of that method already, which is untouched.
    ConversionRefused
        Nothing of that method would follow.
    RollUnknown
        The keypoints do not show the boxes' roll, and none is given.
    SaveError
        It cannot be written.
    """
    path = sibling_path(original, method)
    if path.exists():
        raise DocumentError(
            f"this volume has an annotation by {method} already",
            where=path,
            remedy="Open it by that method, or move its file away to derive a new one",
        )
    if method == "boxes":
        derived = to_boxes(document, tool, original=original, derived=path, roll_deg=roll_deg)
    else:
        derived = to_keypoints(document, tool, original=original, derived=path)
    save_annotation(derived, path, expected="")
    left_out = keypoints_without_box(document, derived, tool) if method == "boxes" else []
    return Derived(path, tuple(left_out))
