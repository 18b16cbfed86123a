"""The keypoint table, driven by mouse and keyboard."""

from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QTableView,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from annotations.geometry.frames import Vector
from annotator.panels.annotation.keypoints_model import Column
from annotator.panels.annotation.keypoints_panel import KeypointsPanel
from annotator.session import Session
from tests.annotator.conftest import open_and_wait, write_volume

K0_UM: Vector = (159.0, 135.0, 94.0)
K1_UM: Vector = (318.0, 405.0, 188.0)
# What the offscreen platform says of itself when a tooltip or a list pops up.
OFFSCREEN = "This plugin does not support (raise|grabbing the keyboard)"
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def panel(qtbot: QtBot, session: Session) -> KeypointsPanel:
    session.place(K0_UM, "clicked", "k0")
    session.place(K1_UM, "clicked", "k1")
    panel = KeypointsPanel(session)
    qtbot.addWidget(panel)
    panel.resize(760, 360)
    with qtbot.waitActive(panel):
        panel.show()
        panel.activateWindow()
    return panel


@pytest.fixture
def table(panel: KeypointsPanel) -> QTableView:
    table = panel.findChild(QTableView, "keypoints_table")
    assert isinstance(table, QTableView)
    return table


def cell(table: QTableView, row: int, column: Column) -> QPoint:
    return table.visualRect(table.model().index(row, column)).center()


def click(qtbot: QtBot, table: QTableView, row: int, column: Column) -> None:
    qtbot.mouseClick(table.viewport(), LEFT, pos=cell(table, row, column))


def begin_editing(qtbot: QtBot, table: QTableView, row: int, column: Column) -> QLineEdit:
    click(qtbot, table, row, column)
    qtbot.mouseDClick(table.viewport(), LEFT, pos=cell(table, row, column))
    editor = table.findChild(QLineEdit, "number_editor")
    assert isinstance(editor, QLineEdit)
    return editor


def test_a_click_on_a_row_activates_the_keypoint_and_goes_to_it(
    qtbot: QtBot, session: Session, table: QTableView
) -> None:
    click(qtbot, table, 0, Column.KEYPOINT)
    assert session.view.active_part == "k0"
    assert session.view.crosshair_um == K0_UM
    session.look(crosshair_um=(0.0, 0.0, 0.0))
    click(qtbot, table, 0, Column.KEYPOINT)
    assert session.view.crosshair_um == K0_UM


def test_the_arrow_keys_go_through_the_keypoints(qtbot: QtBot, session: Session, table: QTableView) -> None:
    click(qtbot, table, 0, Column.KEYPOINT)
    qtbot.keyClick(table, Qt.Key.Key_Down)
    assert session.view.active_part == "k1"
    assert session.view.crosshair_um == K1_UM


def on_screen(widget: QWidget) -> QImage:
    """Return what a person sees, which need not be what would be painted now."""
    for _ in range(3):
        QApplication.processEvents()
    window = widget.window()
    place = widget.rect().translated(widget.mapTo(window, QPoint(0, 0)))
    return widget.screen().grabWindow(window.winId()).toImage().copy(place)


def test_rows_that_have_scrolled_are_painted_where_they_are(table: QTableView) -> None:
    def fresh() -> QImage:
        return table.viewport().grab().toImage().convertToFormat(QImage.Format.Format_RGB32)

    row, rows = table.rowHeight(0), table.viewport().height()
    table.setFixedHeight(table.height() - rows + 5 * row + row // 2)
    whole = on_screen(table.viewport())
    table.verticalScrollBar().setValue(1)
    assert table.verticalScrollBar().maximum() == 1
    assert on_screen(table.viewport()) == fresh() != whole
    # At the end the last row is whole at the bottom, and elsewhere the first one at the top.
    table.setFixedHeight(table.height() - row)
    assert table.verticalScrollBar().maximum() > 1
    assert on_screen(table.viewport()) == fresh()


def test_the_selected_row_is_the_active_part(session: Session, table: QTableView) -> None:
    session.activate("k4")
    assert [index.row() for index in table.selectionModel().selectedRows()] == [4]
    session.activate(None)
    assert table.selectionModel().selectedRows() == []


def test_a_coordinate_is_typed_with_enter(qtbot: QtBot, session: Session, table: QTableView) -> None:
    editor = begin_editing(qtbot, table, 0, Column.Y)
    assert editor.text() == "135.000"
    qtbot.keyClicks(editor, "200.5")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: session.undo_stack.count == 3)
    assert session.document is not None
    assert session.document.keypoint("k0").position_um == (159.0, 200.5, 94.0)
    assert session.view.crosshair_um == (159.0, 200.5, 94.0)


@pytest.mark.qt_log_ignore(OFFSCREEN)
def test_wrong_text_keeps_the_editor_open_and_escape_gives_it_up(
    qtbot: QtBot, session: Session, table: QTableView, panel: KeypointsPanel
) -> None:
    editor = begin_editing(qtbot, table, 0, Column.X)
    qtbot.keyClicks(editor, "12,5")
    qtbot.keyClick(editor, Qt.Key.Key_Return)
    message = panel.findChild(QLabel, "keypoints_message")
    assert isinstance(message, QLabel)
    assert message.isVisible()
    assert "decimals with a point" in message.text()
    assert editor.isVisible()
    qtbot.keyClick(editor, Qt.Key.Key_Escape)
    assert session.document is not None
    assert session.document.keypoint("k0").position_um == K0_UM
    assert session.undo_stack.count == 2
    session.nudge(0, 1)
    assert not message.isVisible()


def test_leaving_a_cell_with_wrong_text_changes_nothing_and_says_so(
    qtbot: QtBot, session: Session, table: QTableView, panel: KeypointsPanel
) -> None:
    editor = begin_editing(qtbot, table, 0, Column.X)
    qtbot.keyClicks(editor, "abc")
    box = panel.findChild(QLineEdit, "qt_spinbox_lineedit")
    assert isinstance(box, QLineEdit)
    box.setFocus()
    message = panel.findChild(QLabel, "keypoints_message")
    assert isinstance(message, QLabel)
    qtbot.waitUntil(message.isVisible)
    assert "Nothing was changed" in message.text()
    assert session.undo_stack.count == 2


def test_a_locked_cell_opens_no_editor(qtbot: QtBot, session: Session, table: QTableView) -> None:
    session.set_locked("k0", True)
    qtbot.mouseDClick(table.viewport(), LEFT, pos=cell(table, 0, Column.X))
    assert table.findChild(QLineEdit, "number_editor") is None
    click(qtbot, table, 0, Column.STATE)
    assert table.findChild(QComboBox, "state_editor") is None


@pytest.mark.qt_log_ignore(OFFSCREEN)
def test_a_state_is_chosen_from_a_list(qtbot: QtBot, session: Session, table: QTableView) -> None:
    click(qtbot, table, 0, Column.STATE)
    editor = table.findChild(QComboBox, "state_editor")
    assert isinstance(editor, QComboBox)
    assert editor.currentData() == "placed"
    view = editor.view()
    qtbot.waitUntil(view.isVisible)
    qtbot.keyClick(view, Qt.Key.Key_Down)
    qtbot.keyClick(view, Qt.Key.Key_Return)
    assert session.document is not None
    assert session.document.keypoint("k0").state == "occluded"
    assert session.undo_stack.undo_text == "Mark k0 occluded"


def test_check_boxes_judge_and_lock(qtbot: QtBot, session: Session, table: QTableView) -> None:
    for column in (Column.SURE, Column.LOCK):
        rect = table.visualRect(table.model().index(0, column))
        qtbot.mouseClick(table.viewport(), LEFT, pos=QPoint(rect.left() + 10, rect.center().y()))
    assert session.document is not None
    keypoint = session.document.keypoint("k0")
    assert keypoint.certainty == "unsure"
    assert keypoint.locked


def test_the_cross_clears_a_keypoint(qtbot: QtBot, session: Session, table: QTableView) -> None:
    click(qtbot, table, 1, Column.CLEAR)
    assert session.document is not None
    assert session.document.keypoint("k1").state == "unplaced"
    session.undo_stack.undo()
    assert session.document.keypoint("k1").position_um == K1_UM


def test_the_unit_is_switched_for_table_and_boxes(
    qtbot: QtBot, session: Session, table: QTableView, panel: KeypointsPanel
) -> None:
    session.activate("k0")
    voxels = panel.findChild(QToolButton, "keypoints_unit_voxel")
    assert isinstance(voxels, QToolButton)
    qtbot.mouseClick(voxels, LEFT)
    assert table.model().index(0, Column.X).data() == "10.0"
    box = panel.findChild(QLineEdit, "qt_spinbox_lineedit")
    assert isinstance(box, QLineEdit)
    assert box.text() == "10.00"
    assert voxels.isChecked()


def test_the_number_of_positions_is_told(session: Session, panel: KeypointsPanel) -> None:
    progress = panel.findChild(QLabel, "keypoints_progress")
    assert isinstance(progress, QLabel)
    assert progress.text() == "2 of 6 have a position"
    session.clear("k0")
    assert progress.text() == "1 of 6 have a position"
    session.close_volume()
    assert progress.text() == "No volume is open"


def test_coordinates_stay_in_sight_in_a_narrow_panel(qtbot: QtBot, table: QTableView) -> None:
    letter = table.fontMetrics().horizontalAdvance("0")
    table.window().resize(letter * 41, 300)
    qtbot.waitUntil(lambda: table.viewport().width() < letter * 41)
    last = table.visualRect(table.model().index(0, Column.Z))
    assert table.viewport().rect().contains(last)


def test_at_the_width_that_it_asks_for_all_is_in_sight_but_the_source(
    qtbot: QtBot, session: Session, panel: KeypointsPanel, table: QTableView
) -> None:
    panel.resize(panel.sizeHint())
    qtbot.waitUntil(lambda: table.isColumnHidden(Column.SOURCE))
    viewport = table.viewport().rect()
    assert viewport.contains(table.visualRect(table.model().index(5, Column.CLEAR)))
    assert not table.horizontalScrollBar().isVisible()
    assert not table.verticalScrollBar().isVisible()


def test_in_a_narrow_dock_the_residual_is_in_sight_and_nothing_is_scrolled(
    qtbot: QtBot, panel: KeypointsPanel, table: QTableView
) -> None:
    letter = table.fontMetrics().horizontalAdvance("0")
    panel.resize(letter * 52, 400)
    qtbot.waitUntil(lambda: table.isColumnHidden(Column.SOURCE))
    assert not table.isColumnHidden(Column.RESIDUAL)
    assert table.viewport().rect().contains(table.visualRect(table.model().index(5, Column.CLEAR)))


def test_the_table_is_no_taller_than_its_rows(panel: KeypointsPanel, table: QTableView) -> None:
    last = table.visualRect(table.model().index(5, Column.X))
    assert abs(table.viewport().height() - last.bottom()) < 8


def test_room_that_is_left_over_goes_to_whole_words_and_the_source(table: QTableView) -> None:
    assert not table.isColumnHidden(Column.SOURCE)
    width = table.fontMetrics().horizontalAdvance("out of view")
    assert table.columnWidth(Column.STATE) > width


@pytest.mark.qt_log_ignore(OFFSCREEN)
def test_a_list_of_states_that_is_closed_leaves_nothing_behind(
    qtbot: QtBot, session: Session, table: QTableView
) -> None:
    click(qtbot, table, 0, Column.STATE)
    editor = table.findChild(QComboBox, "state_editor")
    assert isinstance(editor, QComboBox)
    qtbot.waitUntil(editor.view().isVisible)
    qtbot.keyClick(editor.view(), Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: table.findChild(QComboBox, "state_editor") is None)
    assert session.document is not None
    assert session.document.keypoint("k0").state == "placed"


def test_a_right_click_on_a_state_opens_nothing(qtbot: QtBot, table: QTableView) -> None:
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.RightButton, pos=cell(table, 0, Column.STATE))
    assert table.findChild(QComboBox, "state_editor") is None


def test_text_that_is_being_typed_is_no_other_volumes(
    qtbot: QtBot, session: Session, table: QTableView, volume_path: Path
) -> None:
    editor = begin_editing(qtbot, table, 0, Column.X)
    editor.setText("777")
    # As large and as far apart as the first: the rows stay, and so would an editor.
    open_and_wait(qtbot, session, write_volume(volume_path.with_name("other.npy"), seed=1))
    qtbot.waitUntil(lambda: table.findChild(QLineEdit, "number_editor") is None)
    assert session.document is not None
    assert not any(part.anchor_um for part in session.document.parts)
    assert session.view.preview is None
