"""The table of keypoints, and the position of the active one."""

from PySide6.QtCore import QItemSelectionModel, QModelIndex, QSize, Qt, Slot
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QButtonGroup,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QTableView,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.annotation import Annotation
from annotator.labels import WrappedText
from annotator.naming import named
from annotator.panels.keypoint_delegates import ClearDelegate, CoordinateDelegate, NameDelegate, StateDelegate
from annotator.panels.keypoints_model import COORDINATES, Column, KeypointsModel
from annotator.panels.position_editor import PositionEditor
from annotator.session import Session
from annotator.view import View

_UNITS = (
    ("um", "µm", "Show and type positions in micrometres"),
    ("voxel", "Voxels", "Show and type voxel indices"),
)

_LETTERS = {
    Column.X: 9,
    Column.Y: 9,
    Column.Z: 9,
    Column.STATE: 11,
    Column.SURE: 5,
    Column.LOCK: 5,
    Column.CLEAR: 3,
    Column.SOURCE: 10,
}
_FEWEST_LETTERS, _MOST_LETTERS = 8, 26


class KeypointsTable(QTableView):
    """Gives the room that is left over to the keypoints' labels; what stands first stays in sight longest."""

    def fit_columns(self) -> None:
        letter = self.fontMetrics().horizontalAdvance("0")
        header = self.horizontalHeader()
        header.setMinimumSectionSize(letter * 3)
        for column, letters in _LETTERS.items():
            header.resizeSection(column, letter * letters)
        room = self.viewport().width() - letter * sum(_LETTERS.values())
        header.resizeSection(
            Column.KEYPOINT, min(max(room, letter * _FEWEST_LETTERS), letter * _MOST_LETTERS)
        )

    def sizeHint(self) -> QSize:
        """Ask for the width in which names, coordinates, states and marks are in sight."""
        letters = _FEWEST_LETTERS + sum(_LETTERS[column] for column in _LETTERS if column < Column.CLEAR)
        frame = self.verticalHeader().sizeHint().width() + 2 * self.frameWidth()
        width = self.fontMetrics().horizontalAdvance("0") * letters + frame
        return QSize(width, super().sizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.fit_columns()


class KeypointsPanel(QWidget):
    """Choose, type, judge, lock and clear keypoints; the selected row is the active keypoint."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setObjectName("keypoints_panel")
        self.setAccessibleName("Keypoints")

        self._model = KeypointsModel(session, self)
        self._model.not_understood.connect(self._on_model_not_understood)
        self._model.modelReset.connect(self._on_model_reset)
        self._table = self._make_table()
        self._editor = PositionEditor(session, self)
        self._progress = named(QLabel(), "keypoints_progress")
        self._progress.setAccessibleName("Keypoints placed")
        self._message = WrappedText(name="keypoints_message")
        self._message.set_color(lambda colors: colors.error)
        self._message.setVisible(False)
        self._units = QButtonGroup(self)

        header = QHBoxLayout()
        header.addWidget(self._progress, 1)
        for unit, text, tooltip in _UNITS:
            button = named(QToolButton(), f"keypoints_unit_{unit}")
            button.setText(text)
            button.setToolTip(tooltip)
            button.setAccessibleName(tooltip)
            button.setCheckable(True)
            button.setChecked(unit == self._model.unit)
            button.setProperty("unit", unit)
            self._units.addButton(button)
            header.addWidget(button)
        self._units.buttonClicked.connect(self._on_unit_button_clicked)

        layout = QVBoxLayout(self)
        layout.addLayout(header)
        layout.addWidget(self._table, 1)
        layout.addWidget(self._message)
        layout.addWidget(self._editor)

        session.view_changed.connect(self._on_session_view_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw_selection()
        self._draw_progress()

    def _make_table(self) -> "KeypointsTable":
        table = KeypointsTable()
        table.setObjectName("keypoints_table")
        table.setAccessibleName("Keypoints")
        table.setModel(self._model)
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        table.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        table.setAlternatingRowColors(True)
        table.setShowGrid(False)
        table.setWordWrap(False)
        table.setTabKeyNavigation(False)
        table.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        table.setItemDelegateForColumn(Column.KEYPOINT, NameDelegate(table))
        table.setItemDelegateForColumn(Column.STATE, StateDelegate(table))
        for column in COORDINATES:
            table.setItemDelegateForColumn(column, CoordinateDelegate(self._model, table))
        table.setItemDelegateForColumn(Column.CLEAR, ClearDelegate(table))
        table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        table.verticalHeader().setDefaultSectionSize(int(table.fontMetrics().height() * 1.55))
        table.horizontalHeader().setHighlightSections(False)
        table.clicked.connect(self._on_table_clicked)
        table.selectionModel().currentRowChanged.connect(self._on_table_current_row_changed)
        return table

    @Slot(QModelIndex)
    def _on_table_clicked(self, index: QModelIndex) -> None:
        name = self._model.name(index.row())
        if index.column() == Column.CLEAR:
            self._session.clear(name)
            return
        self._session.activate(name, jump=True)
        if index.column() == Column.STATE and index.flags() & Qt.ItemFlag.ItemIsEditable:
            self._table.edit(index)

    @Slot(QModelIndex, QModelIndex)
    def _on_table_current_row_changed(self, current: QModelIndex, previous: QModelIndex) -> None:
        if current.isValid() and self._model.name(current.row()) != self._session.view.active_keypoint:
            self._session.activate(self._model.name(current.row()), jump=True)

    @Slot(object)
    def _on_unit_button_clicked(self, button: QToolButton) -> None:
        unit = button.property("unit")
        self._model.set_unit(unit)
        self._editor.set_unit(unit)

    @Slot(str)
    def _on_model_not_understood(self, message: str) -> None:
        self._message.setText(message)
        self._message.setVisible(True)

    @Slot()
    def _on_model_reset(self) -> None:
        self._draw_selection()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.active_keypoint != after.active_keypoint:
            self._draw_selection()

    @Slot(object, object)
    def _on_session_document_changed(self, before: Annotation | None, after: Annotation | None) -> None:
        self._message.setVisible(False)
        self._draw_progress()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._message.setVisible(False)
        self._draw_selection()
        self._draw_progress()

    def _draw_selection(self) -> None:
        row = self._model.row(self._session.view.active_keypoint)
        selection = self._table.selectionModel()
        if row is None:
            selection.clear()
        elif selection.currentIndex().row() != row or not selection.isRowSelected(row, QModelIndex()):
            column = max(selection.currentIndex().column(), 0)
            index = self._model.index(row, column)
            flags = QItemSelectionModel.SelectionFlag
            selection.setCurrentIndex(index, flags.ClearAndSelect | flags.Rows)
            self._table.scrollTo(self._model.index(row, 0))

    def _draw_progress(self) -> None:
        document = self._session.document
        if document is None:
            self._progress.setText("No volume is open")
        else:
            self._progress.setText(
                f"{len(document.positions_um)} of {len(document.keypoints)} have a position"
            )
