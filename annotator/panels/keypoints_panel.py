"""The table of keypoints, and the position of the active one."""

from PySide6.QtCore import QEvent, QItemSelectionModel, QModelIndex, QSize, Qt, Slot
from PySide6.QtGui import QFont, QFontMetrics, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QButtonGroup,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QSizePolicy,
    QStyle,
    QTableView,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.annotation import Annotation
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.keypoint_delegates import ClearDelegate, CoordinateDelegate, NameDelegate, StateDelegate
from annotator.panels.keypoints_model import COORDINATES, Column, KeypointsModel
from annotator.panels.position_editor import PositionEditor
from annotator.session import Session
from annotator.session.view import View

_UNITS = (
    ("um", "µm", "Show and type positions in micrometres"),
    ("voxel", "Voxels", "Show and type voxel indices"),
)

# The widest that a column shows, and the words that are its heading.
_SAMPLES = {
    Column.X: ("000000", "x / µm"),
    Column.Y: ("000000", "y / µm"),
    Column.Z: ("000000", "z / µm"),
    Column.STATE: ("placed", "State"),
}
_MARKS = (Column.SURE, Column.LOCK, Column.CLEAR)
_LONGEST_STATE = "out of view"
_SOURCE_LETTERS, _MOST_LETTERS = 9, 26
# In sight at once: as many as the tools that ship have keypoints.
_FEWEST_ROWS, _ROWS_IN_SIGHT = 3, 6


class KeypointsTable(QTableView):
    """As narrow and as tall as its rows: room that is left goes to words that are otherwise shortened."""

    def fit_columns(self) -> None:
        header, letter = self.horizontalHeader(), self.fontMetrics().horizontalAdvance("0")
        header.setMinimumSectionSize(letter)
        widths = self._narrowest_widths()
        spare = self.viewport().width() - sum(widths.values())
        state = self._text_width(_LONGEST_STATE) - widths[Column.STATE]
        if spare >= state:
            widths[Column.STATE] += state
            spare -= state
        source = _SOURCE_LETTERS * letter
        self.setColumnHidden(Column.SOURCE, spare < source)
        if spare >= source:
            widths[Column.SOURCE] = source
            spare -= source
        label = max(letter * _MOST_LETTERS - widths[Column.KEYPOINT], 0)
        widths[Column.KEYPOINT] += min(max(spare, 0), label)
        for column, width in widths.items():
            header.resizeSection(column, width)

    def sizeHint(self) -> QSize:
        """Ask for the room in which every row is in sight, with all that a person judges by."""
        width = sum(self._narrowest_widths().values())
        # Without rows the numbers of the rows take no room yet.
        numbers = max(self.verticalHeader().sizeHint().width(), self._text_width("0"))
        return QSize(width + numbers + 2 * self.frameWidth(), self._height(max(self._rows(), _ROWS_IN_SIGHT)))

    def minimumSizeHint(self) -> QSize:
        rows = min(max(self._rows(), _FEWEST_ROWS), _ROWS_IN_SIGHT)
        return QSize(super().minimumSizeHint().width(), self._height(rows))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.fit_columns()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self.fit_columns()
            self.updateGeometry()

    def _height(self, rows: int) -> int:
        height = self.horizontalHeader().sizeHint().height() + 2 * self.frameWidth()
        height += rows * self.verticalHeader().defaultSectionSize()
        if self.horizontalHeader().length() > self.viewport().width():
            height += self.horizontalScrollBar().sizeHint().height()
        return height

    def _rows(self) -> int:
        return self.model().rowCount() if self.model() is not None else 0

    def _narrowest_widths(self) -> dict[Column, int]:
        mark = self.style().pixelMetric(QStyle.PixelMetric.PM_SmallIconSize, None, self)
        widths = {column: max(map(self._text_width, samples)) for column, samples in _SAMPLES.items()}
        widths |= dict.fromkeys(_MARKS, mark + mark // 2)
        bold = QFont(self.font())
        bold.setBold(True)
        metrics, model = QFontMetrics(bold), self.model()
        indices = [model.index(row, Column.KEYPOINT) for row in range(self._rows())]
        names = [metrics.horizontalAdvance(index.data(Qt.ItemDataRole.EditRole)) for index in indices]
        widths[Column.KEYPOINT] = self._text_width("") + mark + mark // 2 + max(names, default=mark)
        return widths

    def _text_width(self, text: str) -> int:
        margin = self.style().pixelMetric(QStyle.PixelMetric.PM_HeaderMargin, None, self)
        return self.fontMetrics().horizontalAdvance(text) + 3 * margin


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
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addLayout(header)
        layout.addWidget(self._table)
        layout.addWidget(self._message)
        layout.addWidget(self._editor)
        layout.addStretch(1)

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
        table.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
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
        if current.isValid() and self._model.name(current.row()) != self._session.view.active_part:
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
        self._table.fit_columns()
        self._table.updateGeometry()
        self._draw_selection()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.active_part != after.active_part:
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
        row = self._model.row(self._session.view.active_part)
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
