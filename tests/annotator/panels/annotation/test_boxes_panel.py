"""The table of boxes and the numbers below it, driven by mouse and keyboard."""

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QComboBox, QLabel, QLineEdit, QTableView, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from annotations.documents.annotation import BoxAnnotation
from annotations.geometry.boxes import Box
from annotator.panels.annotation.boxes_model import Column
from annotator.panels.annotation.boxes_panel import BoxesPanel
from annotator.session import Session

LINK0 = Box((300.0, 400.0, 200.0), (11000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
LINK1 = Box((150.0, 270.0, 94.0), (5000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
# What the offscreen platform says of itself when a tooltip or a list pops up.
OFFSCREEN = "This plugin does not support (raise|grabbing the keyboard)"
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def session(boxes_session: Session) -> Session:
    """A session with two boxes placed."""
    boxes_session.type_box("link0", LINK0)
    boxes_session.type_box("link1", LINK1)
    return boxes_session


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> BoxesPanel:
    panel = BoxesPanel(session)
    qtbot.addWidget(panel)
    panel.resize(600, 500)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    return panel


@pytest.fixture
def table(panel: BoxesPanel) -> QTableView:
    table = panel.findChild(QTableView, "boxes_table")
    assert isinstance(table, QTableView)
    return table


def cell(table: QTableView, row: int, column: Column) -> QPoint:
    return table.visualRect(table.model().index(row, column)).center()


def click(qtbot: QtBot, table: QTableView, row: int, column: Column) -> None:
    qtbot.mouseClick(table.viewport(), LEFT, pos=cell(table, row, column))


def begin_editing(qtbot: QtBot, table: QTableView, column: Column) -> None:
    """Double-click a cell of the first row, as a person does: a click comes first."""
    click(qtbot, table, 0, column)
    qtbot.mouseDClick(table.viewport(), LEFT, pos=cell(table, 0, column))


def part(session: Session, link: str) -> BoxAnnotation:
    assert session.document is not None
    found = session.document.part(link)
    assert isinstance(found, BoxAnnotation)
    return found


def label(panel: BoxesPanel, name: str) -> QLabel:
    found = panel.findChild(QLabel, name)
    assert isinstance(found, QLabel)
    return found


def test_a_click_on_a_row_activates_the_link_and_goes_to_its_box(
    qtbot: QtBot, session: Session, table: QTableView
) -> None:
    click(qtbot, table, 1, Column.LINK)
    assert session.view.active_part == "link1"
    assert session.view.crosshair_um == LINK1.center_um
    qtbot.keyClick(table, Qt.Key.Key_Up)
    assert session.view.active_part == "link0"


def test_the_selected_row_is_the_active_link(session: Session, table: QTableView) -> None:
    session.activate("link2")
    assert [index.row() for index in table.selectionModel().selectedRows()] == [2]


def test_a_length_is_typed_in_the_table_and_undone(qtbot: QtBot, session: Session, table: QTableView) -> None:
    begin_editing(qtbot, table, Column.LENGTH)
    editor = table.findChild(QLineEdit, "number_editor")
    assert isinstance(editor, QLineEdit)
    assert editor.accessibleName() == "link0: Length"
    qtbot.keyClicks(editor, "12 mm")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: part(session, "link0").size_um == (12000.0, 4000.0, 4000.0))
    session.undo_stack.undo()
    assert part(session, "link0").box == LINK0


@pytest.mark.qt_log_ignore(OFFSCREEN)
def test_a_length_that_makes_no_sense_is_explained(
    qtbot: QtBot, session: Session, table: QTableView, panel: BoxesPanel
) -> None:
    steps = session.undo_stack.count
    begin_editing(qtbot, table, Column.LENGTH)
    editor = table.findChild(QLineEdit, "number_editor")
    assert isinstance(editor, QLineEdit)
    qtbot.keyClicks(editor, "-3")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    assert "more than zero" in label(panel, "boxes_message").text()
    assert label(panel, "boxes_message").isVisible()
    qtbot.keyClick(editor, Qt.Key.Key_Escape)
    assert session.undo_stack.count == steps


def test_a_fixed_width_opens_no_editor_until_it_is_free(
    qtbot: QtBot, session: Session, table: QTableView
) -> None:
    begin_editing(qtbot, table, Column.WIDTH)
    assert table.findChild(QLineEdit, "number_editor") is None
    session.free_cross_section("link0", True)
    begin_editing(qtbot, table, Column.WIDTH)
    assert table.findChild(QLineEdit, "number_editor") is not None


@pytest.mark.qt_log_ignore(OFFSCREEN)
def test_a_state_is_chosen_from_a_list(qtbot: QtBot, session: Session, table: QTableView) -> None:
    click(qtbot, table, 0, Column.STATE)
    editor = table.findChild(QComboBox, "state_editor")
    assert isinstance(editor, QComboBox)
    qtbot.waitUntil(editor.view().isVisible)
    qtbot.keyClick(editor.view(), Qt.Key.Key_Down)
    qtbot.keyClick(editor.view(), Qt.Key.Key_Return)
    assert part(session, "link0").state == "occluded"
    assert session.undo_stack.undo_text == "Mark link0 occluded"


def test_check_boxes_judge_and_lock(qtbot: QtBot, session: Session, table: QTableView) -> None:
    for column in (Column.SURE, Column.LOCK):
        rect = table.visualRect(table.model().index(0, column))
        qtbot.mouseClick(table.viewport(), LEFT, pos=QPoint(rect.left() + 10, rect.center().y()))
    assert part(session, "link0").certainty == "unsure"
    assert part(session, "link0").locked


def test_the_cross_clears_a_box_and_undo_brings_it_back(
    qtbot: QtBot, session: Session, table: QTableView, panel: BoxesPanel
) -> None:
    assert label(panel, "boxes_progress").text() == "2 of 3 have a position"
    click(qtbot, table, 1, Column.CLEAR)
    assert part(session, "link1").box is None
    assert label(panel, "boxes_progress").text() == "1 of 3 have a position"
    session.undo_stack.undo()
    assert part(session, "link1").box == LINK1


def test_the_unit_of_the_table_is_switched(qtbot: QtBot, table: QTableView, panel: BoxesPanel) -> None:
    button = panel.findChild(QToolButton, "boxes_unit_mm")
    assert isinstance(button, QToolButton)
    qtbot.mouseClick(button, LEFT)
    assert table.model().index(0, Column.LENGTH).data() == "11.000"


def test_four_zeros_are_explained_above_the_numbers(
    qtbot: QtBot, session: Session, panel: BoxesPanel
) -> None:
    session.activate("link0")
    for letter in "wxyz":
        field = panel.findChild(QLineEdit, f"quaternion_{letter}")
        assert isinstance(field, QLineEdit)
        field.setFocus()
        field.selectAll()
        qtbot.keyClicks(field, "0")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert "no rotation" in label(panel, "boxes_message").text()
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert not label(panel, "boxes_message").isVisible()


def test_no_number_is_cut_off_in_a_narrow_panel(qtbot: QtBot, panel: BoxesPanel) -> None:
    panel.resize(panel.minimumSizeHint())
    qtbot.waitUntil(lambda: panel.width() == panel.minimumSizeHint().width())
    area = panel.findChild(QWidget, "boxes_scroll")
    roll = panel.findChild(QWidget, "box_roll")
    assert isinstance(area, QWidget)
    assert isinstance(roll, QWidget)
    assert roll.mapTo(area, QPoint(roll.width(), 0)).x() <= area.width()


def test_every_row_is_in_sight_where_the_columns_scroll(
    qtbot: QtBot, panel: BoxesPanel, table: QTableView
) -> None:
    letter = table.fontMetrics().horizontalAdvance("0")
    panel.resize(letter * 40, 500)
    qtbot.waitUntil(lambda: table.horizontalScrollBar().isVisible())
    qtbot.waitUntil(
        lambda: table.viewport().rect().contains(cell(table, 2, Column.LINK) + QPoint(0, letter // 2))
    )
