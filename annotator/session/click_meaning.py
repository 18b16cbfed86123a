"""What a click on a pane would do, in a few words: every pane says it alike."""

from annotator.session import Session


def is_active_locked(session: Session) -> bool:
    """Say whether the active keypoint refuses every change."""
    document, name = session.document, session.view.active_keypoint
    return document is not None and any(
        keypoint.name == name and keypoint.locked for keypoint in document.keypoints
    )


def click_meaning(session: Session) -> str:
    """Return what a click places, or why it places nothing; empty while clicks change no annotation."""
    if session.view.mode != "place" or session.document is None:
        return ""
    name = session.view.active_keypoint or "—"
    return f"{name} is locked" if is_active_locked(session) else f"place {name}"
