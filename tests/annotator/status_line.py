"""What the status line says."""

from annotator.session import Session


def messages_of(session: Session) -> list[str]:
    """Return a list to which whatever the status line says from now on is added."""
    said: list[str] = []
    session.message_posted.connect(said.append)
    return said
