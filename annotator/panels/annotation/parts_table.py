"""The table of keypoints or of boxes: the selected row is the active part, a click on a cross clears."""

from collections.abc import Mapping, Sequence
from typing import Any

from PySide6.QtCore import QEvent, QItemSelectionModel, QModelIndex, QSize, Qt, Slot
from PySide6.QtGui import QFont, QFontMetrics, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemDelegate,
    QAbstractItemView,
    QHeaderView,
    QSizePolicy,
    QStyle,
    QTableView,
    QWidget,
)

from annotator.looks.redrawing import PaintingApart
from annotator.panels.annotation.part_delegates import (
    ClearDelegate,
    NameDelegate,
    NumberDelegate,
    StateDelegate,
)
from annotator.panels.annotation.parts_model import PartsModel
from annotator.panels.widgets.table_model import Index
from annotator.session import Session
from annotator.session.viewing.view import View

_STATE_SAMPLES = ("placed", "State")
_LONGEST_STATE = "out of view"
_SOURCE_LETTERS, _MOST_LETTERS = 9, 26
# In sight at once: as many as the tools that ship have keypoints.
_FEWEST_ROWS, _ROWS_IN_SIGHT = 3, 6


class PartsTable(QTableView):
    """As narrow and as tall as its rows: room that is left goes to words that are otherwise shortened.

    Parameters
    ----------
    samples : mapping
        The widest texts of each column of numbers, its heading among them; and names as long as those that
        come once there are rows.
    rows_in_sight : int
        How many rows it asks room for at least.
    """

    def __init__(
        self,
        session: Session,
        model: PartsModel[Any],
        samples: Mapping[int, tuple[str, ...]],
        *,
        name: str,
        title: str,
        rows_in_sight: int = _ROWS_IN_SIGHT,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._parts = model
        (self._name,) = model.columns_of("name")
        (self._state,) = model.columns_of("state")
        (self._clear,) = model.columns_of("clear")
        (self._source,) = model.columns_of("source")
        self._samples = {**samples, self._state: _STATE_SAMPLES}
        self._rows_in_sight = rows_in_sight
        self.setObjectName(name)
        self.setAccessibleName(title)
        self.setModel(model)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.setAlternatingRowColors(True)
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setTabKeyNavigation(False)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setItemDelegateForColumn(self._name, NameDelegate(self))
        self.setItemDelegateForColumn(self._state, StateDelegate(self))
        for column in model.columns_of("number"):
            self.setItemDelegateForColumn(column, NumberDelegate(model, self))
        self.setItemDelegateForColumn(self._clear, ClearDelegate(self._state, self))
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.verticalHeader().setDefaultSectionSize(int(self.fontMetrics().height() * 1.55))
        self.horizontalHeader().setHighlightSections(False)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
        self.clicked.connect(self._on_clicked)
        self.selectionModel().currentRowChanged.connect(self._on_current_row_changed)
        self._painting = PaintingApart(self.viewport())
        model.modelAboutToBeReset.connect(self._painting.ask)
        model.modelReset.connect(self._on_model_reset)
        session.view_changed.connect(self._on_session_view_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw_selection()

    def dataChanged(self, first: Index, last: Index, roles: Sequence[int] = ()) -> None:
        if self._session.more_follows:
            # Of another volume everything is different.
            self._painting.ask()
        super().dataChanged(first, last, list(roles))

    def fit_columns(self) -> None:
        """Share the width out: first what a person judges by, then whole words, then the source."""
        header, letter = self.horizontalHeader(), self.fontMetrics().horizontalAdvance("0")
        header.setMinimumSectionSize(letter)
        widths = self._narrowest_widths()
        spare = self.viewport().width() - sum(widths.values())
        state = max(min(spare, self._text_width(_LONGEST_STATE) - widths[self._state]), 0)
        widths[self._state] += state
        spare -= state
        source = _SOURCE_LETTERS * letter
        self.setColumnHidden(self._source, spare < source)
        if spare >= source:
            widths[self._source] = source
            spare -= source
        label = max(letter * _MOST_LETTERS - widths[self._name], 0)
        widths[self._name] += min(max(spare, 0), label)
        for column, width in widths.items():
            header.resizeSection(column, width)

    def sizeHint(self) -> QSize:
        """Ask for the room in which every row is in sight, with all that a person judges by."""
        width = sum(self._narrowest_widths().values())
        # Without rows the numbers of the rows take no room yet.
        numbers = max(self.verticalHeader().sizeHint().width(), self._text_width("0"))
        rows = max(self._rows(), self._rows_in_sight)
        return QSize(width + numbers + 2 * self.frameWidth(), self._height(rows))

    def minimumSizeHint(self) -> QSize:
        # In a small window the other rows scroll.
        return QSize(super().minimumSizeHint().width(), self._height(_FEWEST_ROWS))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.fit_columns()
        # A bar below the columns needs room of its own, or it would cover the last row.
        if event.oldSize().width() != event.size().width():
            self.updateGeometry()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self.fit_columns()
            self.updateGeometry()

    @Slot(QModelIndex)
    def _on_clicked(self, index: QModelIndex) -> None:
        name = self._parts.name(index.row())
        if index.column() == self._clear:
            self._session.clear(name)
            return
        self._session.activate(name, jump=True)
        if index.column() == self._state and index.flags() & Qt.ItemFlag.ItemIsEditable:
            self.edit(index)

    @Slot(QModelIndex, QModelIndex)
    def _on_current_row_changed(self, current: QModelIndex, previous: QModelIndex) -> None:
        if current.isValid() and self._parts.name(current.row()) != self._session.view.active_part:
            self._session.activate(self._parts.name(current.row()), jump=True)

    @Slot()
    def _on_model_reset(self) -> None:
        self.fit_columns()
        self.updateGeometry()
        self._draw_selection()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.active_part != after.active_part:
            self._draw_selection()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        editor = self.indexWidget(self.currentIndex())
        if editor is not None:
            # What is being typed was meant for another volume.
            self.closeEditor(editor, QAbstractItemDelegate.EndEditHint.RevertModelCache)
        self._draw_selection()

    def _draw_selection(self) -> None:
        row = self._parts.row(self._session.view.active_part)
        selection = self.selectionModel()
        if row is None:
            selection.clear()
        elif selection.currentIndex().row() != row or not selection.isRowSelected(row, QModelIndex()):
            column = max(selection.currentIndex().column(), 0)
            flags = QItemSelectionModel.SelectionFlag
            selection.setCurrentIndex(self._parts.index(row, column), flags.ClearAndSelect | flags.Rows)
            self.scrollTo(self._parts.index(row, 0))

    def _height(self, rows: int) -> int:
        height = self.horizontalHeader().sizeHint().height() + 2 * self.frameWidth()
        height += rows * self.verticalHeader().defaultSectionSize()
        if self.horizontalHeader().length() > self.viewport().width():
            height += self.horizontalScrollBar().sizeHint().height()
        return height

    def _rows(self) -> int:
        return self._parts.rowCount()

    def _narrowest_widths(self) -> dict[int, int]:
        mark = self.style().pixelMetric(QStyle.PixelMetric.PM_SmallIconSize, None, self)
        widths = {column: max(map(self._text_width, samples)) for column, samples in self._samples.items()}
        widths |= dict.fromkeys(self._parts.columns_of("sure", "lock", "clear"), mark + mark // 4)
        bold = QFont(self.font())
        bold.setBold(True)
        metrics = QFontMetrics(bold)
        indices = [self._parts.index(row, self._name) for row in range(self._rows())]
        names = [index.data(Qt.ItemDataRole.EditRole) for index in indices] or self._samples[self._name]
        widths[self._name] = (
            self._text_width("") + mark + mark // 2 + max(map(metrics.horizontalAdvance, names))
        )
        return widths

    def _text_width(self, text: str) -> int:
        margin = self.style().pixelMetric(QStyle.PixelMetric.PM_HeaderMargin, None, self)
        return self.fontMetrics().horizontalAdvance(text) + 3 * margin
