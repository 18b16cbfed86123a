"""Running work is shown with its progress, and can be cancelled."""

import threading
from collections.abc import Callable, Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QProgressBar, QToolButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotations.errors import Cancelled
from annotator.panels import jobs_panel
from annotator.panels.jobs_panel import JobsPanel
from annotator.session import Session
from annotator.session.jobs import Job


@pytest.fixture
def bar_frame(qtbot: QtBot) -> QWidget:
    """What holds the panel, as the status bar does: by itself it would be a window of its own."""
    frame = QWidget()
    qtbot.addWidget(frame)
    QVBoxLayout(frame)
    frame.show()
    return frame


@pytest.fixture
def panel(session: Session, bar_frame: QWidget) -> JobsPanel:
    panel = JobsPanel(session)
    bar_frame.layout().addWidget(panel)
    return panel


@pytest.fixture
def shown_and_hidden(panel: JobsPanel, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Each time that the panel is made visible or not, from then on."""
    noted: list[bool] = []
    set_visible = panel.setVisible

    def note(is_visible: bool) -> None:
        noted.append(is_visible)
        set_visible(is_visible)

    monkeypatch.setattr(panel, "setVisible", note)
    return noted


class Work:
    """Work that reports what it is told to, and ends when it is told to."""

    def __init__(self) -> None:
        self.go_on = threading.Event()
        self.began = threading.Event()
        self.progress: Callable[[float], None] = lambda _progress: None

    def __call__(self, progress: Callable[[float], None], cancelled: Callable[[], bool]) -> None:
        self.progress = progress
        self.began.set()
        while not self.go_on.wait(0.01):
            if cancelled():
                raise Cancelled


@pytest.fixture
def work() -> Iterator[Work]:
    work = Work()
    yield work
    work.go_on.set()


def begin(session: Session, work: Work, title: str, *, shown: bool = True) -> Job:
    return session.jobs.start(title, work, done=lambda _: None, failed=lambda _: None, shown=shown)


def bar(panel: JobsPanel) -> QProgressBar:
    found = panel.findChild(QProgressBar, "jobs_progress")
    assert isinstance(found, QProgressBar)
    return found


def title(panel: JobsPanel) -> str:
    found = panel.findChild(QLabel, "jobs_title")
    assert isinstance(found, QLabel)
    return found.text()


def test_nothing_is_shown_while_nothing_runs(panel: JobsPanel) -> None:
    assert not panel.isVisible()


def test_progress_is_shown_until_the_work_is_done(
    qtbot: QtBot, session: Session, panel: JobsPanel, work: Work
) -> None:
    begin(session, work, "Averaging the volume")
    qtbot.waitUntil(panel.isVisible)
    assert title(panel) == "Averaging the volume"
    assert bar(panel).maximum() == 0
    assert work.began.wait(5)
    work.progress(0.25)
    qtbot.waitUntil(lambda: bar(panel).maximum() == 1000 and bar(panel).value() == 250)
    work.go_on.set()
    qtbot.waitUntil(lambda: not panel.isVisible())


def test_work_is_cancelled_by_its_button(
    qtbot: QtBot, session: Session, panel: JobsPanel, work: Work
) -> None:
    job = begin(session, work, "Averaging the volume")
    qtbot.waitUntil(panel.isVisible)
    button = panel.findChild(QToolButton, "jobs_cancel")
    assert isinstance(button, QToolButton)
    assert "Averaging the volume" in button.toolTip()
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert title(panel) == "Stopping: Averaging the volume"
    assert not button.isEnabled()
    qtbot.waitUntil(lambda: not panel.isVisible())
    assert job.state == "cancelled"


def test_more_work_is_counted(qtbot: QtBot, session: Session, panel: JobsPanel, work: Work) -> None:
    begin(session, work, "First")
    begin(session, work, "Second")
    qtbot.waitUntil(panel.isVisible)
    assert title(panel) == "First and 1 more"
    assert panel.toolTip() == "First\nSecond"


def test_it_goes_in_a_turn_after_that_in_which_the_work_is_done(
    qtbot: QtBot, session: Session, panel: JobsPanel, work: Work
) -> None:
    seen: list[bool] = []
    session.jobs.start("Long", work, done=lambda _: seen.append(panel.isVisible()), failed=lambda _: None)
    qtbot.waitUntil(panel.isVisible)
    work.go_on.set()
    qtbot.waitUntil(lambda: not panel.isVisible())
    assert seen == [True]


def test_the_work_that_stands_there_is_cancelled_and_no_other(
    qtbot: QtBot, session: Session, panel: JobsPanel, work: Work
) -> None:
    button, others = panel.findChild(QToolButton, "jobs_cancel"), Work()
    assert isinstance(button, QToolButton)
    # It ends while the panel still speaks of it.
    session.jobs.start("First", work, done=lambda _: button.click(), failed=lambda _: None)
    second = begin(session, others, "Second")
    qtbot.waitUntil(lambda: panel.isVisible() and title(panel) == "First and 1 more")
    work.go_on.set()
    qtbot.waitUntil(lambda: title(panel) == "Second")
    assert not second.is_cancelled()
    others.go_on.set()
    qtbot.waitUntil(lambda: not panel.isVisible())


def test_small_work_is_not_shown(qtbot: QtBot, session: Session, panel: JobsPanel, work: Work) -> None:
    begin(session, work, "Reading a slice", shown=False)
    qtbot.wait(2 * jobs_panel._WAIT_MS)
    assert not panel.isVisible()


def test_work_that_is_done_at_once_does_not_flicker(
    qtbot: QtBot, session: Session, panel: JobsPanel, shown_and_hidden: list[bool]
) -> None:
    for number in range(3):
        done: list[None] = []
        session.jobs.start(
            f"Opening v{number}", lambda _progress, _cancelled: None, done=done.append, failed=raised
        )
        qtbot.waitUntil(lambda done=done: bool(done))  # type: ignore[misc]
    qtbot.wait(2 * jobs_panel._WAIT_MS)
    assert shown_and_hidden == []


def raised(error: Exception) -> None:
    raise error
