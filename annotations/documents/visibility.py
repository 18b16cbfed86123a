"""Whether a part of a document is in view, which follows from where it lies."""

from collections.abc import Iterable

from annotations.documents.annotation import BoxAnnotation, Part, State, VolumeReference
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector


def box_extent_um(box: Box) -> tuple[Vector, ...]:
    """Return the positions in µm that say whether a box is in view: its ends and its centre."""
    return (box.base_um, box.center_um, box.tip_um)


def extent_um(part: Part) -> tuple[Vector, ...]:
    """Return the positions in µm that say whether a part is in view; none where it is unplaced."""
    if isinstance(part, BoxAnnotation):
        return () if part.box is None else box_extent_um(part.box)
    return () if part.position_um is None else (part.position_um,)


def moved_state(volume: VolumeReference, extent_um: Iterable[Vector], part: Part) -> State:
    """Return how a part is seen once it was moved, together with others, to where the tool has it.

    Outside the volume it is ``out_of_view``. Inside, one that was out of view or unplaced is ``placed``, but
    ``occluded`` where it was filled in from a fit: nobody has seen it. What was said of any other stays, and
    so it does of a box that lies partly outside.

    Parameters
    ----------
    extent_um : iterable of (3,)
        The positions in µm, after the move, that say whether it is in view.
    part : KeypointAnnotation or BoxAnnotation
        As it was before.
    """
    inside = [volume.contains(position_um) for position_um in extent_um]
    if not any(inside):
        return "out_of_view"
    if part.state == "unplaced" or (part.state == "out_of_view" and all(inside)):
        return "occluded" if part.source == "fitted" else "placed"
    return part.state
