"""How each keypoint is marked in the scene, from the document and the view."""

from dataclasses import dataclass

from annotations.documents.annotation import Annotation, State
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.view import View

SPHERE_PX = 14.0
"""Diameter of a keypoint's sphere, at every zoom."""

_NO_LINK = "#d9dde3"


@dataclass(frozen=True)
class Mark:
    """How one keypoint is drawn.

    Attributes
    ----------
    color : str
        ``#rrggbb``, its link's.
    preview : bool
        On its way: dragged, or proposed and waiting to be kept.
    """

    name: str
    position_um: Vector
    color: str
    state: State
    unsure: bool
    active: bool
    preview: bool

    @property
    def text(self) -> str:
        """The name, with a question mark for what is unsure, and dots for what is on its way."""
        return self.name + (" ?" if self.unsure else "") + (" …" if self.preview else "")


def keypoint_marks(
    document: Annotation | None, tool: ToolSpecification | None, view: View
) -> tuple[Mark, ...]:
    """Return the marks of all keypoints that have a position or a preview, in the document's order."""
    marks = []
    for keypoint in document.keypoints if document else ():
        preview = view.preview if view.preview and view.preview.keypoint == keypoint.name else None
        position_um = preview.position_um if preview else keypoint.position_um
        if position_um is None:
            continue
        link = tool.link_of(keypoint.name) if tool else None
        marks.append(
            Mark(
                name=keypoint.name,
                position_um=position_um,
                color=link.color if link else _NO_LINK,
                state=keypoint.state,
                unsure=keypoint.certainty == "unsure",
                active=keypoint.name == view.active_keypoint,
                preview=preview is not None,
            )
        )
    return tuple(marks)
