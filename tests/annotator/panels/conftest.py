"""A session on the small volume that is annotated by boxes."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait


@pytest.fixture
def boxes_session(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> Iterator[Session]:
    """A session with the small volume open, its document one of boxes."""
    session = Session(replace(options, method="boxes"))
    open_and_wait(qtbot, session, volume_path)
    yield session
    session.shut_down()
