"""What a click on a pane would do, in a few words: every pane says it alike."""

from annotator.session.state import SessionState


def is_active_locked(session: SessionState) -> bool:
    """Say whether the active keypoint or box refuses every change."""
    document, name = session.document, session.view.active_part
    return document is not None and any(part.name == name and part.locked for part in document.parts)


def click_meaning(session: SessionState) -> str:
    """Return what a click places, or why it places nothing; empty while clicks change no annotation."""
    document, view = session.document, session.view
    if view.mode == "navigate" or document is None:
        return ""
    if view.mode == "pose":
        return "move the tool"
    name = view.active_part or "—"
    if is_active_locked(session):
        return f"{name} is locked"
    if document.method == "keypoints":
        return f"place {name}"
    if view.active_part in document.placed_boxes:
        return f"adjust {name}"
    return f"{'tip' if view.first_end_um else 'base'} of {name}"
