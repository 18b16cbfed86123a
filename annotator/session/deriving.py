"""Writes the document of the other method beside the one that it follows from."""

from pathlib import Path

from annotations.documents.annotation import Annotation, Method
from annotations.documents.conversion import sibling_path, to_boxes, to_keypoints
from annotations.documents.files import DocumentError, save_annotation
from annotations.geometry.tool import ToolSpecification


def write_derived(
    document: Annotation, tool: ToolSpecification, original: Path, method: Method, roll_deg: float | None
) -> Path:
    """Write the derived document of a method, and return its path.

    Raises
    ------
    DocumentError
        There is one of that method already; it is untouched.
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
    return path
