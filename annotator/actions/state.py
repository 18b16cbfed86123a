"""How the actions look for a state of the session: which make sense, which are on, what they are called."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from annotations.documents.annotation import KeypointAnnotation
from annotator.actions.action import When
from annotator.actions.table import KEYPOINT_KEYS
from annotator.session import Session
from annotator.settings import RECENT_FILES


@dataclass(frozen=True)
class ActionState:
    """Enough to draw every action; equal states need no drawing.

    Attributes
    ----------
    met : frozenset of str
        The conditions that hold.
    checked : frozenset of str
        Names of the checkable actions that are on.
    texts : tuple of (str, str)
        Names of actions and what they are called now; an empty text hides the action.
    """

    met: frozenset[When]
    checked: frozenset[str]
    texts: tuple[tuple[str, str], ...]


def state_of(session: Session, recent_paths: tuple[Path, ...]) -> ActionState:
    """Return how the actions look now, as far as the session decides it."""
    texts = (*_keypoint_texts(session), *_undo_texts(session), *_recent_texts(recent_paths))
    return ActionState(frozenset(_met(session)), frozenset(_checked(session)), texts)


def _active(session: Session) -> KeypointAnnotation | None:
    name = session.view.active_keypoint
    if session.document is None or name is None:
        return None
    return next((keypoint for keypoint in session.document.keypoints if keypoint.name == name), None)


def _met(session: Session) -> Iterator[When]:
    yield "always"
    if session.volume is not None:
        yield "volume"
    if session.document is not None:
        yield "document"
    active = _active(session)
    if active is not None:
        yield "active"
        if active.position_um is not None:
            yield "positioned"
    preview = session.view.preview
    if preview is not None:
        yield "preview"
    if session.undo_stack.canUndo():
        yield "undo"
    if session.undo_stack.canRedo():
        yield "redo"
    index = session.current_index
    if session.items:
        if index is None or index > 0:
            yield "previous"
        if index is None or index + 1 < len(session.items):
            yield "next"
    if session.jobs.running:
        yield "jobs"


def _checked(session: Session) -> Iterator[str]:
    view = session.view
    yield "place_mode" if view.mode == "place" else "navigate_mode"
    active = _active(session)
    if active is not None and session.document is not None:
        names = [keypoint.name for keypoint in session.document.keypoints]
        yield f"keypoint_{names.index(active.name) + 1}"
        yield f"state_{active.state}"
        if active.certainty == "unsure":
            yield "unsure"
        if active.locked:
            yield "lock"
    if session.document is not None and session.document.status == "done":
        yield "mark_done"
    for layer in view.layers:
        yield f"layer_{layer}"
    if view.maximized is not None:
        yield "maximize"
    if view.overlays_hidden:
        yield "hide_overlays"
    if view.detail:
        yield "detail"
    if view.rendering == "mip":
        yield "rendering"


def _keypoint_texts(session: Session) -> Iterator[tuple[str, str]]:
    keypoints = session.tool.keypoints if session.tool is not None else ()
    for number in range(1, KEYPOINT_KEYS + 1):
        text = ""
        if number <= len(keypoints):
            keypoint = keypoints[number - 1]
            text = f"{keypoint.name} – {keypoint.label}" if keypoint.label else keypoint.name
        yield f"keypoint_{number}", text


def _undo_texts(session: Session) -> Iterator[tuple[str, str]]:
    yield "undo", f"Undo: {session.undo_stack.undoText()}" if session.undo_stack.canUndo() else "Undo"
    yield "redo", f"Redo: {session.undo_stack.redoText()}" if session.undo_stack.canRedo() else "Redo"


def _recent_texts(recent_paths: tuple[Path, ...]) -> Iterator[tuple[str, str]]:
    for number in range(1, RECENT_FILES + 1):
        text = ""
        if number <= len(recent_paths):
            path = recent_paths[number - 1]
            text = f"{path.name} – {path.parent}"
        yield f"recent_{number}", text
