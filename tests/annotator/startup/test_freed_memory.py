import pytest

from annotator.session import Session
from annotator.startup import freed_memory
from annotator.startup.freed_memory import FreedMemory


@pytest.fixture
def times_given_back(monkeypatch: pytest.MonkeyPatch, session: Session):
    """How often memory was given back so far, a moment after nothing is open any more."""
    monkeypatch.setattr(freed_memory, "_AFTER_MS", 20)
    times: list[None] = []
    kept = FreedMemory(session, lambda: times.append(None))
    yield times
    kept.deleteLater()


def test_memory_is_given_back_once_when_the_volume_is_closed(qtbot, session, times_given_back):
    session.type_position("k0", (100.0, 200.0, 188.0))
    session.save()
    assert times_given_back == []
    session.close_volume()
    # Not while everything is still being drawn with nothing open.
    assert times_given_back == []
    qtbot.waitUntil(lambda: bool(times_given_back))
    qtbot.wait(60)
    assert len(times_given_back) == 1


def test_memory_is_kept_where_another_volume_is_opened(qtbot, session, monkeypatch):
    given_back: list[None] = []
    monkeypatch.setattr(freed_memory, "_AFTER_MS", 60_000)
    kept = FreedMemory(session, lambda: given_back.append(None))
    path = session.volume.path
    session.close_volume()
    session.open_path(path)
    with qtbot.waitSignal(session.volume_changed):
        pass
    assert not kept._timer.isActive()
    assert given_back == []
    kept.deleteLater()
