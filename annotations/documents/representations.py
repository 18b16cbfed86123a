"""Both representations of a document: what is stored, and what follows from it for a reader."""

from collections.abc import Mapping

from annotations.documents.annotation import Annotation, KeypointAnnotation, State
from annotations.geometry.boxes import box_keypoints_um, hinge_axes
from annotations.geometry.frames import Vector
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification


def keypoints_of(document: Annotation, tool: ToolSpecification) -> tuple[KeypointAnnotation, ...]:
    """Return the keypoints of a document of either method, in the tool's order.

    Those of a document of boxes are the centres of the boxes' x faces, and have certainty, source and state
    of their box; a keypoint that ends no placed box is unplaced. A box may lie partly outside the volume: an
    end there is ``out_of_view``, and one inside, of a box that is out of view, is ``occluded``.
    """
    if document.method == "keypoints":
        return document.keypoints
    positions_um = box_keypoints_um(document.placed_boxes, tool)
    owner = {
        name: box
        for link in reversed(tool.links)
        for name in (link.base, link.tip)
        for box in document.boxes
        if box.link == link.name and box.state != "unplaced"
    }
    return tuple(
        KeypointAnnotation(
            name=name,
            state=_state_at(document, positions_um[name], owner[name].state),
            position_um=positions_um[name],
            certainty=owner[name].certainty,
            source=owner[name].source,
            adopted_from=owner[name].adopted_from,
            locked=owner[name].locked,
        )
        if name in owner
        else KeypointAnnotation(name=name)
        for name in tool.keypoint_names
    )


def _state_at(document: Annotation, end_um: Vector, state: State) -> State:
    """Return how the end of a box is seen that is itself seen in some way."""
    if not document.volume.contains(end_um):
        return "out_of_view"
    return "occluded" if state == "out_of_view" else state


def keypoint_positions_um(document: Annotation, tool: ToolSpecification) -> Mapping[str, Vector]:
    """Return the positions in µm of the keypoints that a document of either method gives, by name."""
    if document.method == "keypoints":
        return document.positions_um
    return box_keypoints_um(document.placed_boxes, tool)


def document_targets(document: Annotation, tool: ToolSpecification) -> PoseTargets:
    """Return the pose targets of a document of either method; signed angles where boxes give the hinges."""
    return pose_targets(keypoint_positions_um(document, tool), tool, hinge_axes(document.placed_boxes, tool))
