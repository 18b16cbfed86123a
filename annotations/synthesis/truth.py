"""What is true of a synthetic volume, as an annotation document like a person's."""

from collections.abc import Mapping

import numpy as np

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    KeypointAnnotation,
    State,
    VolumeReference,
    new_annotation,
)
from annotations.documents.files import ships
from annotations.documents.record import changed
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, is_inside
from annotations.geometry.kinematics import keypoints_um, link_boxes, link_frames
from annotations.synthesis.scene import Scene

ANNOTATOR = "truth"
"""In whose name the exact annotations stand."""

_INSET_SHARE = 0.1
"""How far inside its link's end, as a share of the link's length, a keypoint is looked for from above: at the
end itself the light just misses the link or just meets it."""


def truth_annotation(scene: Scene, volume: VolumeReference) -> Annotation:
    """Return the document with the exact keypoints of a scene, marked as done.

    Their source is ``synthesized``: exact, and not judged by a person. A keypoint is ``out_of_view`` outside
    the volume; ``occluded`` where the light ends more than the link's thickness above it (another link or
    other body lies over it, or its own stands upright) or the signal ends before; ``placed`` otherwise; and
    ``unplaced`` where it ends no link.
    """
    document = new_annotation(volume, scene.tool, ANNOTATOR, "keypoints", ships=ships(scene.tool))
    positions_um = keypoints_um(scene.pose, scene.tool)
    keypoints = tuple(
        KeypointAnnotation(
            name=keypoint.name,
            state=_state(scene, keypoint.name, positions_um[keypoint.name]),
            position_um=positions_um[keypoint.name],
            source="synthesized",
        )
        if keypoint.name in positions_um
        else keypoint
        for keypoint in document.keypoints
    )
    return changed(document, keypoints=keypoints, status="done")


def truth_boxes(scene: Scene, volume: VolumeReference) -> Annotation:
    """Return the document with the exact boxes of a scene, marked as done; see `truth_annotation`.

    A box is ``out_of_view`` where its centre is outside the volume, and ``occluded`` where both keypoints of
    its link are.
    """
    document = new_annotation(volume, scene.tool, ANNOTATOR, "boxes", ships=ships(scene.tool))
    positions_um = keypoints_um(scene.pose, scene.tool)
    exact = link_boxes(scene.pose, scene.tool)
    boxes = tuple(
        BoxAnnotation(
            link=name,
            state=_box_state(scene, name, exact[name], positions_um),
            center_um=exact[name].center_um,
            size_um=exact[name].size_um,
            rotation_wxyz=exact[name].rotation_wxyz,
            source="synthesized",
        )
        if (name := box.link) in exact
        else box
        for box in document.boxes
    )
    return changed(document, boxes=boxes, status="done")


def _box_state(scene: Scene, name: str, box: Box, positions_um: Mapping[str, Vector]) -> State:
    if not is_inside(box.center_um, scene.grid.shape, scene.grid.spacing_um):
        return "out_of_view"
    link = scene.tool.link(name)
    ends = [_state(scene, end, positions_um[end]) for end in (link.base, link.tip)]
    return "occluded" if all(state == "occluded" for state in ends) else "placed"


def _state(scene: Scene, name: str, position_um: Vector) -> State:
    if not is_inside(position_um, scene.grid.shape, scene.grid.spacing_um):
        return "out_of_view"
    link = scene.tool.link_of(name)
    frames = link_frames(scene.pose, scene.tool)
    if link is None or link.name not in frames:
        raise KeyError(name)
    inwards = frames[link.name].axes[:, 0] * link.length_um * _INSET_SHARE
    column_um = np.asarray(position_um) + (inwards if name == link.base else -inwards)
    met_um = scene.surface_at(column_um[:1], column_um[1:2]).depth_um.item()
    buried = column_um[2] - met_um > max(link.cross_section_um)
    # A mesh need not lie around its link's axis; where light passes it by, the place itself counts.
    return "occluded" if buried or min(met_um, column_um[2]) > scene.scanner.signal_end_um else "placed"
