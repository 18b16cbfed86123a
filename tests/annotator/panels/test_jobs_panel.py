"""Running work is shown with its progress, and can be cancelled."""

import threading
from collections.abc import Callable, Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QProgressBar, QToolButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotations.errors import Cancelled
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
    assert panel.isVisible()
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
    assert title(panel) == "First and 1 more"
    assert panel.toolTip() == "First\nSecond"


def test_small_work_is_not_shown(qtbot: QtBot, session: Session, panel: JobsPanel, work: Work) -> None:
    begin(session, work, "Reading a slice", shown=False)
    assert not panel.isVisible()
