"""Every change of a document: pure functions from one frozen document to the next.

An edit that would change nothing returns the document itself; one that the document does not allow
raises `EditRefused`, and nothing has changed.
"""

from typing import Any

from pydantic import ValidationError

from annotations.documents.annotation import (
    Annotation,
    Certainty,
    KeypointAnnotation,
    Source,
    State,
    Status,
    changed,
)
from annotations.errors import UserError, first_problem
from annotations.geometry.frames import Vector


class EditRefused(UserError):  # noqa: N818 - named for what happened
    """An edit that the document does not allow; it is unchanged."""


def place_keypoint(document: Annotation, name: str, position_um: Vector, source: Source) -> Annotation:
    """Give a keypoint a position in µm; an unplaced one becomes ``placed``, others keep their state."""
    keypoint = _unlocked(document, name)
    state = "placed" if keypoint.state == "unplaced" else keypoint.state
    return _with_keypoint(document, keypoint, state=state, position_um=position_um, source=source)


def set_state(document: Annotation, name: str, state: State) -> Annotation:
    """Say how a keypoint is seen. ``unplaced`` removes its position; every other state needs one."""
    if state == "unplaced":
        return clear_keypoint(document, name)
    keypoint = _unlocked(document, name)
    if keypoint.position_um is None:
        raise EditRefused(
            f"keypoint {name} has no position yet, so it cannot be {state.replace('_', ' ')}",
            remedy="Place it first; a position outside the volume is allowed",
        )
    return _with_keypoint(document, keypoint, state=state)


def set_certainty(document: Annotation, name: str, certainty: Certainty) -> Annotation:
    """Say whether the annotator is sure of a keypoint."""
    return _with_keypoint(document, _unlocked(document, name), certainty=certainty)


def clear_keypoint(document: Annotation, name: str) -> Annotation:
    """Remove a keypoint's position; it becomes ``unplaced`` and sure again."""
    keypoint = _unlocked(document, name)
    return _with_keypoint(
        document, keypoint, state="unplaced", position_um=None, source=None, certainty="sure"
    )


def lock_keypoint(document: Annotation, name: str, locked: bool) -> Annotation:
    """Protect a keypoint from every change, or release it."""
    return _with_keypoint(document, _keypoint(document, name), locked=locked)


def set_status(document: Annotation, status: Status) -> Annotation:
    """Mark the document as done or in progress."""
    return document if document.status == status else changed(document, status=status)


def _keypoint(document: Annotation, name: str) -> KeypointAnnotation:
    try:
        return document.keypoint(name)
    except KeyError:
        known = ", ".join(keypoint.name for keypoint in document.keypoints)
        raise EditRefused(f"there is no keypoint {name!r}; the document has {known}") from None


def _unlocked(document: Annotation, name: str) -> KeypointAnnotation:
    keypoint = _keypoint(document, name)
    if keypoint.locked:
        raise EditRefused(f"keypoint {name} is locked", remedy="Unlock it to change it")
    return keypoint


def _with_keypoint(document: Annotation, keypoint: KeypointAnnotation, **fields: Any) -> Annotation:
    try:
        replacement = changed(keypoint, **fields)
    except ValidationError as error:
        raise EditRefused(f"keypoint {keypoint.name}: {first_problem(error)}") from error
    if replacement == keypoint:
        return document
    keypoints = tuple(replacement if other is keypoint else other for other in document.keypoints)
    return changed(document, keypoints=keypoints)
