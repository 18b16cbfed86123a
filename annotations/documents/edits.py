"""Every change of a document: pure functions from one frozen document to the next.

An edit that would change nothing returns the document itself; one that the document does not allow
raises `EditRefused`, and nothing has changed.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    Certainty,
    KeypointAnnotation,
    Part,
    Source,
    State,
)
from annotations.documents.provenance import Contribution
from annotations.documents.record import Status, changed
from annotations.documents.visibility import box_extent_um, moved_state
from annotations.errors import UserError, first_problem
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification


class EditRefused(UserError):  # noqa: N818 - named for what happened
    """An edit that the document does not allow; it is unchanged."""


def place_keypoint(document: Annotation, name: str, position_um: Vector, source: Source) -> Annotation:
    """Give a keypoint a position in µm; an unplaced one becomes ``placed``, others keep their state.

    One that was filled in from a fit, or predicted, has been judged by a person now, and is ``placed`` too.
    """
    keypoint = _unlocked(document, name)
    if not isinstance(keypoint, KeypointAnnotation):
        raise EditRefused(f"{name} is a box in this document, not a keypoint")
    state = "placed" if _is_unjudged(keypoint) else keypoint.state
    return _with_part(document, keypoint, state=state, position_um=position_um, source=source)


def place_box(document: Annotation, link: str, box: Box, source: Source) -> Annotation:
    """Give a link a box; one that no person has judged becomes ``placed``, others keep their state."""
    part = _unlocked(document, link)
    if not isinstance(part, BoxAnnotation):
        raise EditRefused(f"{link} is a keypoint in this document, not a box")
    return _with_part(
        document,
        part,
        state="placed" if _is_unjudged(part) else part.state,
        center_um=box.center_um,
        size_um=box.size_um,
        rotation_wxyz=box.rotation_wxyz,
        source=source,
    )


def pose_tool(document: Annotation, tool: ToolSpecification, pose: ToolPose) -> Annotation:
    """Put every keypoint or box where a tool in a pose has it, as a person moved it there (``posed``).

    How each is seen follows from where it comes to lie (`moved_state`): what is ``occluded`` stays so in the
    volume, and so does what was filled in from a fit, which nobody has seen.
    """
    locked = [part.name for part in document.parts if part.locked]
    if locked:
        raise EditRefused(
            f"{', '.join(locked)} {'is' if len(locked) == 1 else 'are'} locked",
            remedy=f"Unlock {'it' if len(locked) == 1 else 'them'} to move the tool as a whole",
        )
    positions_um, boxes = keypoints_um(pose, tool), link_boxes(pose, tool)
    for part in document.parts:
        if isinstance(part, BoxAnnotation):
            place: Box | Vector | None = boxes.get(part.link)
            if isinstance(place, Box) and part.box is not None:
                # A cross-section that a person has measured is not the specification's to change.
                place = replace(place, size_um=(place.size_um[0], *part.box.size_um[1:]))
        else:
            place = positions_um.get(part.name)
        document = _carried(document, part, place, "posed")
    return document


def fill_in(document: Annotation, fitted_um: Mapping[str, Vector]) -> Annotation:
    """Give unplaced keypoints the positions of a fit in µm, and those filled in before the new ones.

    They are ``occluded`` inside the volume and ``out_of_view`` outside of it, never ``placed``: nobody has
    seen them. Locked ones stay as they are.
    """
    for keypoint in document.keypoints:
        if is_left_to_fit(keypoint) and keypoint.name in fitted_um:
            position_um = fitted_um[keypoint.name]
            state: State = "occluded" if document.volume.contains(position_um) else "out_of_view"
            document = _with_part(document, keypoint, state=state, position_um=position_um, source="fitted")
    return document


def refine(document: Annotation, tool: ToolSpecification, pose: ToolPose) -> Annotation:
    """Move what is placed to where a pose that was polished against the volume has it (``refined``).

    Unplaced and locked parts stay as they are. How each is seen follows from where it comes to lie
    (`moved_state`); what was filled in from a fit moves along, and is ``fitted`` still.
    """
    positions_um, boxes = keypoints_um(pose, tool), link_boxes(pose, tool)
    for part in document.parts:
        if part.state == "unplaced" or part.locked:
            continue
        if isinstance(part, BoxAnnotation):
            place: Box | Vector | None = boxes.get(part.link)
            if isinstance(place, Box) and part.box is not None:
                place = replace(place, size_um=part.box.size_um)
        else:
            place = positions_um.get(part.name)
        document = _carried(document, part, place, "fitted" if part.source == "fitted" else "refined")
    return document


def accept_predicted(document: Annotation) -> Annotation:
    """Count the keypoints that are still where a network had them as judged: a person found them right.

    They are ``adopted`` from the checkpoint, as a reviewer adopts what an annotator placed; how each is seen
    stays. Locked ones stay as they are.
    """
    acceptance = _acceptance(document)
    for part in document.parts:
        if part.source == "predicted" and not part.locked:
            document = _with_part(document, part, **acceptance)
    return document


def propose_consensus(
    document: Annotation, parts: Mapping[str, Part], consensus_of: tuple[Contribution, ...]
) -> Annotation:
    """Put a proposed consensus where no reviewer has decided yet, and say what it was made from.

    A settled one that this changes is in progress again: nobody has accepted what it says now.

    Parameters
    ----------
    parts : mapping of str to KeypointAnnotation or BoxAnnotation
        By name, with the source ``consensus``; unplaced ones take a part away that was proposed before.
    consensus_of : tuple of Contribution
    """
    before = document
    if consensus_of != document.consensus_of:
        document = changed(document, consensus_of=consensus_of)
    for part in document.parts:
        proposed = parts.get(part.name)
        is_open = part.state == "unplaced" or part.source == "consensus"
        if proposed is not None and is_open and not part.locked:
            document = _with_part(document, part, **_said_of(proposed))
    return document if document is before else set_status(document, "in_progress")


def adopt(document: Annotation, part: Part, annotator: str) -> Annotation:
    """Take one annotator's keypoint or box, with all that was said of it, as it is."""
    mine = _unlocked(document, part.name)
    if part.state == "unplaced":
        raise EditRefused(f"{annotator} has not placed {part.name}")
    return _with_part(document, mine, **_said_of(part) | {"source": "adopted", "adopted_from": annotator})


def relabel(document: Annotation, right_names: Mapping[str, str]) -> Annotation:
    """Give parts that were taken for each other their right names, with all that was said of them.

    Parameters
    ----------
    right_names : mapping of str to str
        For each keypoint, or link of a box, that was taken for another one, by its present name, the name of
        that other one. They change places among themselves; each box keeps its cross-section, which is its
        link's.
    """
    if set(right_names) != set(right_names.values()):
        raise EditRefused(
            f"{', '.join(sorted(right_names))} cannot change places: "
            "each of them must get the name of exactly one other"
        )
    present = {name: _unlocked(document, name) for name in right_names}
    for name, right_name in right_names.items():
        moved, part = present[name], present[right_name]
        fields = _said_of(moved)
        if isinstance(part, BoxAnnotation) and isinstance(moved, BoxAnnotation) and part.size_um:
            fields["size_um"] = (moved.size_um[0], *part.size_um[1:]) if moved.size_um else None
        document = _with_part(document, part, **fields)
    return document


def set_state(document: Annotation, name: str, state: State) -> Annotation:
    """Say how a keypoint or a box is seen. ``unplaced`` removes it; every other state needs a place.

    Who calls a predicted one ``placed`` has accepted it.
    """
    if state == "unplaced":
        return clear(document, name)
    part = _unlocked(document, name)
    if state == "placed" and part.source == "predicted":
        return _with_part(document, part, state=state, **_acceptance(document))
    if part.anchor_um is None:
        raise EditRefused(
            f"{_called(part)} has no position yet, so it cannot be {state.replace('_', ' ')}",
            remedy="Place it first; a position outside the volume is allowed",
        )
    if state == "placed" and part.source == "fitted" and part.state != "placed":
        raise EditRefused(
            f"{_called(part)} was filled in from the fit, and nobody has seen it there",
            remedy="Place it yourself: click, drag, nudge or type its position",
        )
    return _with_part(document, part, state=state)


def set_certainty(document: Annotation, name: str, certainty: Certainty) -> Annotation:
    """Say whether the annotator is sure of a keypoint or a box."""
    return _with_part(document, _unlocked(document, name), certainty=certainty)


def clear(document: Annotation, name: str) -> Annotation:
    """Take a keypoint or a box away; it becomes ``unplaced`` and sure again."""
    part = _unlocked(document, name)
    places = (
        ("center_um", "size_um", "rotation_wxyz") if isinstance(part, BoxAnnotation) else ("position_um",)
    )
    fields: dict[str, Any] = {"state": "unplaced", "source": None, "certainty": "sure"}
    return _with_part(document, part, **fields, **dict.fromkeys(places))


def lock(document: Annotation, name: str, locked: bool) -> Annotation:
    """Protect a keypoint or a box from every change, or release it."""
    return _with_part(document, _part(document, name), locked=locked)


def set_status(document: Annotation, status: Status) -> Annotation:
    """Mark the document as done or in progress."""
    return document if document.status == status else changed(document, status=status)


def set_flag(document: Annotation, flag: str | None) -> Annotation:
    """Say in up to 500 characters why somebody should look at the volume; None or blank takes that back."""
    words = (flag or "").strip() or None
    if words == document.flag:
        return document
    try:
        return changed(document, flag=words)
    except ValidationError as error:
        raise EditRefused(first_problem(error), remedy="Say it in fewer words") from error


def is_left_to_fit(keypoint: KeypointAnnotation) -> bool:
    """Say whether `fill_in` may place a keypoint: no person has, and it is not locked."""
    is_open = keypoint.state == "unplaced" or (keypoint.source == "fitted" and keypoint.state != "placed")
    return is_open and not keypoint.locked


def _is_unjudged(part: Part) -> bool:
    """Say whether no person has said yet where a part is."""
    return part.state == "unplaced" or part.source in ("fitted", "predicted")


def _acceptance(document: Annotation) -> dict[str, Any]:
    """Return what becomes of a predicted keypoint that a person finds right."""
    origin = document.predicted_from
    return {"source": "adopted", "adopted_from": "a network" if origin is None else origin.checkpoint}


def _carried(document: Annotation, part: Part, place: Box | Vector | None, source: Source) -> Annotation:
    """Return the document with a part where the whole tool was moved to; what does not move along stays."""
    if place is None:
        return document
    if isinstance(place, Box):
        lies_um = box_extent_um(place)
        fields: dict[str, Any] = {
            "center_um": place.center_um,
            "size_um": place.size_um,
            "rotation_wxyz": place.rotation_wxyz,
        }
    else:
        lies_um, fields = (place,), {"position_um": place}
    state = moved_state(document.volume, lies_um, part)
    return _with_part(document, part, state=state, source=source, **fields)


def _said_of(part: Part) -> dict[str, Any]:
    """Return all that is said of a part, apart from which it is and whether it is locked."""
    return part.model_dump(exclude={"name", "link", "locked"})


def _called(part: Part) -> str:
    return f"{'The box of' if isinstance(part, BoxAnnotation) else 'Keypoint'} {part.name}"


def _part(document: Annotation, name: str) -> Part:
    try:
        return document.part(name)
    except KeyError:
        kind = "keypoint" if document.method == "keypoints" else "box"
        known = ", ".join(part.name for part in document.parts)
        raise EditRefused(f"There is no {kind} {name!r}; the document has {known}") from None


def _unlocked(document: Annotation, name: str) -> Part:
    part = _part(document, name)
    if part.locked:
        raise EditRefused(f"{_called(part)} is locked", remedy="Unlock it to change it")
    return part


def _with_part(document: Annotation, part: Part, **fields: Any) -> Annotation:
    if "source" in fields:
        # Whatever comes by another way is no longer as its annotator had it.
        fields.setdefault("adopted_from", None)
    try:
        replacement = changed(part, **fields)
    except ValidationError as error:
        raise EditRefused(f"{_called(part)}: {first_problem(error)}") from error
    if replacement == part:
        return document
    parts = tuple(replacement if other is part else other for other in document.parts)
    return changed(document, **{document.method: parts})
