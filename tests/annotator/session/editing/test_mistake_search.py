"""Likely mistakes are looked for beside the window, a moment after each edit; the last document counts."""

import threading
from collections.abc import Callable
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import Annotation
from annotations.errors import Cancelled, UserError
from annotator.session import Session
from annotator.session.editing import mistake_search
from annotator.session.jobs import Job


class Searcher:
    """Stands in for the search: finds the number of placed keypoints, when the test lets it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.go_on = threading.Event()
        self.go_on.set()
        self.error: Exception | None = None
        self.searched: list[tuple[Annotation, bool]] = []
        self.threads: set[str] = set()
        monkeypatch.setattr(mistake_search, "likely_mistakes", self._search)

    def _search(
        self, document: Annotation, _tool: Any, *, every_relabelling: bool, cancelled: Callable[[], bool]
    ) -> Any:
        self.searched.append((document, every_relabelling))
        self.threads.add(threading.current_thread().name)
        while not self.go_on.wait(0.01):
            if cancelled():
                raise Cancelled
        if self.error is not None:
            raise self.error
        return (len(document.positions_um),)


@pytest.fixture
def searcher(monkeypatch: pytest.MonkeyPatch) -> Searcher:
    return Searcher(monkeypatch)


@pytest.fixture
def ready(qtbot: QtBot, searcher: Searcher, session: Session) -> Session:
    """A session whose first document has been looked at."""
    qtbot.waitUntil(lambda: not session.is_searching_mistakes)
    searcher.searched.clear()
    return session


def thorough_jobs(session: Session) -> list[Job]:
    return [job for job in session.jobs.running if job.shown]


def test_edits_in_a_row_are_looked_at_once_and_off_the_gui_thread(
    qtbot: QtBot, ready: Session, searcher: Searcher
) -> None:
    with qtbot.waitSignal(ready.mistakes_changed):
        for x_um in (1.0, 2.0, 3.0):
            ready.place((x_um, 1.0, 1.0))
        assert ready.is_searching_mistakes
        assert searcher.searched == []
    assert ready.mistakes == (3,)
    assert not ready.is_searching_mistakes
    assert searcher.searched == [(ready.document, False)]
    assert searcher.threads.isdisjoint({"MainThread"})


def test_what_was_found_in_an_older_document_is_dropped(
    qtbot: QtBot, ready: Session, searcher: Searcher
) -> None:
    searcher.go_on.clear()
    found: list[Any] = []
    ready.mistakes_changed.connect(lambda: found.append(ready.mistakes))
    ready.place((1.0, 1.0, 1.0))
    qtbot.waitUntil(lambda: len(searcher.searched) == 1)
    ready.place((2.0, 1.0, 1.0))
    searcher.go_on.set()
    qtbot.waitUntil(lambda: not ready.is_searching_mistakes)
    assert found == [(2,)]


def test_every_relabelling_is_tried_on_demand_with_a_progress_bar(
    qtbot: QtBot, ready: Session, searcher: Searcher
) -> None:
    searcher.go_on.clear()
    ready.search_every_relabelling()
    qtbot.waitUntil(lambda: len(thorough_jobs(ready)) == 1)
    searcher.go_on.set()
    qtbot.waitUntil(lambda: not ready.is_searching_mistakes)
    assert searcher.searched == [(ready.document, True)]


def test_a_search_that_a_person_cancels_has_ended(qtbot: QtBot, ready: Session, searcher: Searcher) -> None:
    searcher.go_on.clear()
    ready.search_every_relabelling()
    qtbot.waitUntil(lambda: len(thorough_jobs(ready)) == 1)
    ready.jobs.cancel(thorough_jobs(ready)[0])
    qtbot.waitUntil(lambda: not ready.is_searching_mistakes)


def test_closing_forgets_what_was_found(qtbot: QtBot, ready: Session, searcher: Searcher) -> None:
    ready.place((1.0, 1.0, 1.0))
    qtbot.waitUntil(lambda: ready.mistakes == (1,))
    ready.place((2.0, 1.0, 1.0))
    ready.abandon()
    assert ready.mistakes == ()
    assert not ready.is_searching_mistakes
    ready.search_every_relabelling()
    assert not ready.is_searching_mistakes


def test_a_search_that_fails_ends_and_is_said(qtbot: QtBot, ready: Session, searcher: Searcher) -> None:
    searcher.error = UserError("no such order")
    with qtbot.waitSignal(ready.error_raised) as raised:
        ready.search_every_relabelling()
    assert "no such order" in str(raised.args[0])
    assert not ready.is_searching_mistakes
