"""The list of errors as it is seen: which of its rows are in sight."""

from pathlib import Path

import pytest
from PySide6.QtWidgets import QTreeView
from pytestqt.qtbot import QtBot

from annotator.panels.predictions.errors_page import ErrorsPage
from annotator.session import Session
from tests.annotator.panels.predictions.panel_reading import table
from tests.annotator.reviewed_study import review, write_reviewed


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_reviewed(tmp_path / "study")


@pytest.fixture
def page(qtbot: QtBot, rita: Session) -> ErrorsPage:
    review(qtbot, rita)
    page = ErrorsPage(rita)
    qtbot.addWidget(page)
    page.draw()
    with qtbot.waitExposed(page):
        page.show()
    return page


def lower(page: ErrorsPage, rows: float) -> QTreeView:
    """Give the list the height of some rows below its headings."""
    shown = table(page)
    row_px = shown.visualRect(shown.model().index(0, 0)).height()
    frame_px = shown.height() - shown.viewport().height()
    shown.setFixedHeight(frame_px + round(rows * row_px))
    return table(page)


def is_in_sight(shown: QTreeView, row: int) -> bool:
    place = shown.visualRect(shown.model().index(row, 0))
    return place.top() >= 0 and place.bottom() < shown.viewport().height()


def test_the_open_volume_stays_in_sight_in_a_list_that_becomes_lower(
    qtbot: QtBot, rita: Session, page: ErrorsPage
) -> None:
    last = rita.reviewing.order[-1]
    rita.reviewing.open(last)
    qtbot.waitUntil(lambda: rita.reviewing.open_volume == last and not rita.jobs.running)
    page.draw()
    shown = lower(page, 3.5)
    assert shown.currentIndex().row() == 2
    assert is_in_sight(shown, 2)

    assert is_in_sight(lower(page, 1.5), 2)


def test_whoever_has_scrolled_away_from_it_stays_there(qtbot: QtBot, rita: Session, page: ErrorsPage) -> None:
    last = rita.reviewing.order[-1]
    rita.reviewing.open(last)
    qtbot.waitUntil(lambda: rita.reviewing.open_volume == last and not rita.jobs.running)
    page.draw()
    shown = lower(page, 2.0)
    shown.scrollToTop()
    assert not is_in_sight(shown, 2)

    shown = lower(page, 1.2)
    assert is_in_sight(shown, 0)
