"""Sessions in which boxes are placed, and what they say."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from annotator.session import Session
from annotator.session.options import SessionOptions


@pytest.fixture
def boxes_session(qtbot: QtBot, options: SessionOptions, volume_path: Path) -> Iterator[Session]:
    """A session with the small volume open, to be annotated by boxes."""
    session = Session(replace(options, method="boxes"))
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        session.open_path(volume_path)
    qtbot.waitUntil(lambda: not session.jobs.running)
    yield session
    session.shut_down()
