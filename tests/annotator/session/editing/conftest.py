"""A session whose tool is posed, and what the status lines say."""

import pytest

from annotator.session import Session
from tests.annotator.session.editing.posed_tool import POSE
from tests.annotator.status_line import messages_of


@pytest.fixture
def messages(session: Session) -> list[str]:
    return messages_of(session)


@pytest.fixture
def box_messages(boxes_session: Session) -> list[str]:
    return messages_of(boxes_session)


@pytest.fixture
def posed(session: Session) -> Session:
    """A session in pose mode, with the tool posed."""
    session.set_mode("pose")
    session.pose_tool(POSE)
    return session
