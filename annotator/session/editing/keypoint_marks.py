"""How each keypoint is marked in the scene and in the slices, from the document and the view: no painting."""

from dataclasses import dataclass

from annotations.documents.annotation import Annotation, State
from annotations.documents.representations import keypoints_of
from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.session.viewing.view import View

# Not the white of the active keypoint's ring.
_NO_LINK = "#d9dde3"


@dataclass(frozen=True, kw_only=True)
class KeypointMark:
    """How one keypoint is marked.

    Attributes
    ----------
    position_um : (float, float, float)
        Where it is drawn: the preview's position while there is one.
    color : str
        ``#rrggbb``, its link's.
    state, locked
        As in the document.
    active : bool
        Whether it is the keypoint that the next click places.
    preview : bool
        On its way: dragged, or proposed and waiting to be kept.
    """

    name: str
    position_um: Vector
    color: str
    state: State
    unsure: bool
    locked: bool
    active: bool
    preview: bool

    @property
    def text(self) -> str:
        """The name, with a question mark for what is unsure."""
        return f"{self.name} ?" if self.unsure else self.name


def keypoint_marks(
    document: Annotation | None, tool: ToolSpecification | None, view: View
) -> tuple[KeypointMark, ...]:
    """Return the marks of all keypoints that have a position or a preview, in the tool's order.

    Those of a document of boxes are the ends of the boxes. ``document`` is the shown one, drafts included.
    """
    marks = []
    begun = tool.link(view.active_part).base if tool and view.active_part and view.first_end_um else None
    keypoints = () if document is None else keypoints_of(document, tool) if tool else document.keypoints
    for keypoint in keypoints:
        preview = view.preview if view.preview and view.preview.keypoint == keypoint.name else None
        position_um = preview.position_um if preview else keypoint.position_um
        if keypoint.name == begun:
            position_um = view.first_end_um
        if position_um is None:
            continue
        link = tool.link_of(keypoint.name) if tool else None
        marks.append(
            KeypointMark(
                name=keypoint.name,
                position_um=position_um,
                color=link.color if link else _NO_LINK,
                state=keypoint.state,
                unsure=keypoint.certainty == "unsure",
                locked=keypoint.locked,
                active=keypoint.name == view.active_part,
                preview=preview is not None or keypoint.name == begun,
            )
        )
    return tuple(marks)
