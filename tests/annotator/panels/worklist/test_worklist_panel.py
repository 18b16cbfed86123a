"""The list of volumes: what it shows, and how it opens the next one."""

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QPaintEvent, QRegion
from PySide6.QtWidgets import (
    QApplication,
    QLabel,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QTreeView,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.volumes import write_sidecar
from annotator.looks.redrawing import owes_drawing
from annotator.panels.worklist.worklist_panel import WorklistPanel
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.conftest import open_and_wait
from tests.annotator.panels.worklist.listed_volumes import listed, rows
from tests.annotator.redrawn import redrawn

LEFT = Qt.MouseButton.LeftButton
ROLE = Qt.ItemDataRole


@pytest.fixture
def three(qtbot: QtBot, empty_session: Session, tmp_path: Path) -> Session:
    """A session on a folder of three volumes, the first one open."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("v001", "v002", "w003"):
        np.save(folder / f"{name}.npy", np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
        write_sidecar(folder / f"{name}.npy", (15.9, 13.5, 9.4), 2)
    with qtbot.waitSignal(
        empty_session.volume_changed, check_params_cb=lambda: empty_session.volume is not None
    ):
        empty_session.open_path(folder)
    return empty_session


@pytest.fixture
def panel(qtbot: QtBot, three: Session) -> WorklistPanel:
    panel = WorklistPanel(three)
    qtbot.addWidget(panel)
    panel.resize(280, 400)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    return panel


@pytest.fixture
def items(panel: WorklistPanel) -> QTreeView:
    return listed(panel)


def open_with(qtbot: QtBot, session: Session, index: int, act: object) -> None:
    with qtbot.waitSignal(session.volume_changed, check_params_cb=lambda: session.volume is not None):
        act()  # type: ignore[operator]
    assert session.current_index == index
    assert session.document is not None


def test_volumes_are_listed_with_their_status(three: Session, panel: WorklistPanel, items: QTreeView) -> None:
    assert rows(items) == [("v001.npy", "to do"), ("v002.npy", "to do"), ("w003.npy", "to do")]
    title = panel.findChild(QLabel, "worklist_title")
    assert isinstance(title, QLabel)
    assert title.text() == "recordings"
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    assert rows(items)[0] == ("v001.npy", "done")
    progress = panel.findChild(QProgressBar, "worklist_progress")
    assert isinstance(progress, QProgressBar)
    assert progress.text() == "1 of 3 done"
    three.set_status("in_progress")
    assert rows(items)[0] == ("v001.npy", "in progress")


def test_the_open_volume_is_marked(three: Session, items: QTreeView) -> None:
    first = items.model().index(0, 0)
    assert first.data(ROLE.FontRole).bold()
    assert first.data(ROLE.AccessibleTextRole) == "v001.npy, to do, open"
    assert items.model().index(1, 0).data(ROLE.FontRole) is None
    assert items.currentIndex().row() == 0


def test_enter_opens_a_volume(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    items.setFocus()
    qtbot.keyClick(items, Qt.Key.Key_Down)
    open_with(qtbot, three, 1, lambda: qtbot.keyClick(items, Qt.Key.Key_Return))
    assert items.model().index(1, 0).data(ROLE.FontRole).bold()
    assert items.model().index(0, 0).data(ROLE.FontRole) is None


def test_a_double_click_opens_a_volume(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    spot = items.visualRect(items.model().index(2, 0)).center()
    qtbot.mouseClick(items.viewport(), LEFT, pos=spot)
    assert three.current_index == 0
    open_with(qtbot, three, 2, lambda: qtbot.mouseDClick(items.viewport(), LEFT, pos=spot))


def test_opening_the_open_volume_does_nothing(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    with qtbot.assertNotEmitted(three.volume_changed):
        qtbot.keyClick(items, Qt.Key.Key_Return)


def test_the_filter_narrows_the_list_and_the_right_volume_opens(
    qtbot: QtBot, three: Session, panel: WorklistPanel, items: QTreeView
) -> None:
    field = panel.findChild(QLineEdit, "worklist_filter")
    assert isinstance(field, QLineEdit)
    qtbot.keyClicks(field, "W0")
    assert rows(items) == [("w003.npy", "to do")]
    items.setCurrentIndex(items.model().index(0, 0))
    open_with(qtbot, three, 2, lambda: qtbot.keyClick(items, Qt.Key.Key_Return))
    field.clear()
    assert len(rows(items)) == 3
    qtbot.keyClicks(field, "nothing like it")
    assert rows(items) == []


def test_the_list_can_be_filtered_by_status(
    qtbot: QtBot, three: Session, panel: WorklistPanel, items: QTreeView
) -> None:
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    field = panel.findChild(QLineEdit, "worklist_filter")
    assert isinstance(field, QLineEdit)
    qtbot.keyClicks(field, "done")
    assert rows(items) == [("v001.npy", "done")]


def test_only_changed_rows_are_redrawn(qtbot: QtBot, three: Session, items: QTreeView) -> None:
    source = items.model().sourceModel()  # type: ignore[attr-defined]
    drawn: list[int] = []
    source.dataChanged.connect(lambda first, _last: drawn.append(first.row()))
    with qtbot.assertNotEmitted(source.modelReset):
        three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    assert set(drawn) == {0}


def test_a_list_of_another_height_paints_no_row_that_stays(qtbot: QtBot, three: Session) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(400, 600)
    panel = WorklistPanel(three, window)
    panel.resize(280, 400)
    with qtbot.waitExposed(window):
        window.show()
    viewport, painted = listed(panel).viewport(), QRegion()

    class Paintings(QObject):
        def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
            nonlocal painted
            if isinstance(event, QPaintEvent):
                painted += event.region()
            return False

    redrawn(panel)
    QApplication.processEvents()
    paintings = Paintings(window)
    viewport.installEventFilter(paintings)
    before = viewport.rect()
    panel.resize(panel.width(), panel.height() + 60)
    qtbot.waitUntil(lambda: not painted.isEmpty())
    assert painted == QRegion(viewport.rect()) - QRegion(before)
    # Another width moves what stands at the right, and shortens names.
    panel.resize(panel.width() - 40, panel.height())
    qtbot.waitUntil(lambda: painted.boundingRect().contains(viewport.rect()))


def test_the_marks_of_the_three_states_differ(three: Session, items: QTreeView) -> None:
    def picture() -> bytes:
        image = items.model().index(0, 0).data(ROLE.DecorationRole).pixmap(16, 16).toImage()
        return bytes(image.constBits())

    new = picture()
    three.place((1.0, 2.0, 3.0))
    three.set_status("done")
    done = picture()
    three.set_status("in_progress")
    assert len({new, done, picture()}) == 3


def test_the_buttons_ask_the_window(qtbot: QtBot, panel: WorklistPanel) -> None:
    for name, signal in (
        ("worklist_open_file", panel.open_file_requested),
        ("worklist_open_folder", panel.open_folder_requested),
    ):
        button = panel.findChild(QPushButton, name)
        assert isinstance(button, QPushButton)
        with qtbot.waitSignal(signal):
            qtbot.mouseClick(button, LEFT)


def test_an_empty_list_says_so(qtbot: QtBot, empty_session: Session) -> None:
    panel = WorklistPanel(empty_session)
    qtbot.addWidget(panel)
    title = panel.findChild(QLabel, "worklist_title")
    assert isinstance(title, QLabel)
    assert title.text() == "Nothing is open"
    progress = panel.findChild(QProgressBar, "worklist_progress")
    assert isinstance(progress, QProgressBar)
    assert progress.isHidden()


def test_a_second_try_at_the_same_row_opens_what_is_free_by_now(
    qtbot: QtBot, session: Session, options: SessionOptions, volume_path: Path
) -> None:
    second = Session(options)
    qtbot.addWidget(panel := WorklistPanel(second))
    open_and_wait(qtbot, second, volume_path)
    assert second.read_only_reason
    session.close_volume()
    told: list[str] = []
    second.message_posted.connect(told.append)
    with qtbot.waitSignal(second.volume_changed):
        listed(panel).activated.emit(listed(panel).currentIndex())
    assert not second.read_only_reason
    assert told == ["It is free now: you can go on"]
    second.shut_down()


def test_a_row_that_a_person_goes_to_meanwhile_stays_the_current_one(
    qtbot: QtBot, three: Session, items: QTreeView
) -> None:
    panel = items.window()
    redrawn(panel)
    assert items.currentIndex().row() == three.current_index == 0
    went: list[bool] = []

    def go_to_the_end() -> None:
        if three.current_index == 1 and not went:
            went.append(owes_drawing(panel))
            qtbot.keyClick(items, Qt.Key.Key_End)

    # After the panel's own slot, in the same turn: what the panel owes is drawn later.
    three.worklist_changed.connect(go_to_the_end)
    three.next_volume()
    qtbot.waitUntil(lambda: went == [True])
    redrawn(panel)
    assert items.currentIndex().row() == 2
