"""The errors volume by volume: sorted, filtered, walked through by the arrow keys, and judged."""

from PySide6.QtCore import QModelIndex, Qt, QTimer, Slot
from PySide6.QtGui import QFontMetrics, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QBoxLayout,
    QCheckBox,
    QComboBox,
    QHBoxLayout,
    QLineEdit,
    QStyle,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.looks.redrawing import Redrawing, keep_painted
from annotator.panels.predictions.errors_columns import RANK, VOLUME
from annotator.panels.predictions.errors_model import KINDS, ErrorsModel, SummaryModel
from annotator.panels.predictions.verdict_box import VerdictBox
from annotator.session import Session

_WAYS = {"Predicted keypoints": False, "Fitted pose": True}
_OPENS_AFTER_MS = 250
_LONGEST_NAME_LETTERS = 20
_PADDING_LETTERS = 2
_SORT_MARK_LETTERS = 3
_LEAST_ROWS = 4
# As wide as this, in lines of text, the verdict stands beside the list.
_SIDEWAYS_LINES = 40


class ErrorsPage(QWidget):
    """A row for each volume, the figures of those that are shown below, and the verdict on the open one.

    The arrow keys open the volume on which they come to rest; those that are passed by are not opened.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("errors_page")
        self._session = session
        self._drawn: object = None
        self._sizing = Redrawing(self._size_columns, self)
        self._is_selecting = False
        self._height_px = 0
        self._model = ErrorsModel(self)
        self._summary = SummaryModel(self._model, self)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_OPENS_AFTER_MS)
        self._rest.timeout.connect(self._open_current)
        self._filter = named(QLineEdit(), "errors_filter", title="Filter the volumes")
        self._filter.setPlaceholderText("Filter")
        self._filter.setToolTip("Shows the volumes in whose name, verdict or note this is")
        self._filter.setClearButtonEnabled(True)
        self._filter.textChanged.connect(self._model.show_text)
        self._kind = named(QComboBox(), "errors_kind", title="Which volumes are listed")
        for kind, words in KINDS.items():
            self._kind.addItem(words, kind)
        self._kind.currentIndexChanged.connect(self._on_kind_current_index_changed)
        self._way = named(QComboBox(), "errors_way", title="Of what the errors are")
        self._way.setToolTip("Of the keypoints as they were predicted, or of the tool fitted to them")
        for words, by_fit in _WAYS.items():
            self._way.addItem(words, by_fit)
        self._way.currentIndexChanged.connect(self._on_way_current_index_changed)
        for choice in (self._kind, self._way):
            # Its longest entry must not keep the panel wide.
            choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self._list = self._make_list()
        self._figures = self._make_figures()
        self._list.header().sectionResized.connect(self._on_header_section_resized)
        self._list.horizontalScrollBar().valueChanged.connect(self._figures.horizontalScrollBar().setValue)
        self._words = WrappedText(name="errors_words")
        self._words.set_color(lambda colors: colors.muted)
        self._goes_to_worst = named(QCheckBox("&Go to the keypoint furthest off"), "errors_goes_to_worst")
        self._goes_to_worst.setToolTip("Brings the slices there each time that a volume is opened")
        self._goes_to_worst.clicked.connect(session.reviewing.go_to_worst)
        self._verdict = VerdictBox(session)
        self._layout = QBoxLayout(QBoxLayout.Direction.TopToBottom, self)
        self._lay_out()
        self._model.shown_changed.connect(self._on_model_shown_changed)
        session.judging.changed.connect(self._on_judging_changed)

    def draw(self) -> None:
        """Show the errors of the checkpoint in use, and which volume is open."""
        if self._session.more_follows:
            return
        reviewing = self._session.reviewing
        current = reviewing.current
        if current is not None and current is not self._drawn:
            self._drawn = current
            self._model.show_errors(
                current.table, current.ranking, reviewing.volume_label, self._session.judging.judgement
            )
            # Hundreds of texts are compared for it.
            self._sizing.ask_apart()
        self._goes_to_worst.setChecked(reviewing.goes_to_worst)
        self._model.mark_open(reviewing.open_volume)
        self._select_open()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        is_sideways = self.width() >= _SIDEWAYS_LINES * self.fontMetrics().height()
        ways = QBoxLayout.Direction
        self._layout.setDirection(ways.LeftToRight if is_sideways else ways.TopToBottom)

    def _make_list(self) -> QTreeView:
        shown = _table("errors_list", "Volumes by their errors")
        shown.setModel(self._model)
        shown.setAlternatingRowColors(True)
        # Else the figures below would not stand below their columns once it comes.
        shown.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        shown.setMinimumHeight(self.fontMetrics().lineSpacing() * (_LEAST_ROWS + 2))
        shown.header().setSectionsMovable(False)
        shown.sortByColumn(RANK, Qt.SortOrder.DescendingOrder)
        shown.setSortingEnabled(True)
        shown.clicked.connect(self._open_current)
        shown.activated.connect(self._open_current)
        shown.selectionModel().currentRowChanged.connect(self._on_list_current_row_changed)
        shown.verticalScrollBar().rangeChanged.connect(self._on_list_range_changed)
        return shown

    def _make_figures(self) -> QTreeView:
        figures = _table("errors_figures", "Figures of the volumes that are shown")
        figures.setModel(self._summary)
        figures.setHeaderHidden(True)
        figures.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        figures.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        figures.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        figures.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        return figures

    def _lay_out(self) -> None:
        filters = QHBoxLayout()
        filters.addWidget(self._filter, 2)
        filters.addWidget(self._kind, 1)
        filters.addWidget(self._way, 1)
        figures = QHBoxLayout()
        figures.addWidget(self._figures)
        figures.addSpacing(self.style().pixelMetric(QStyle.PixelMetric.PM_ScrollBarExtent))
        listed = QVBoxLayout()
        listed.addLayout(filters)
        listed.addWidget(self._list, 1)
        listed.addLayout(figures)
        listed.addWidget(self._words)
        judged = QVBoxLayout()
        judged.addWidget(self._goes_to_worst)
        judged.addWidget(self._verdict)
        judged.addStretch()
        layout = self._layout
        layout.setContentsMargins(0, 4, 0, 0)
        layout.addLayout(listed, 1)
        layout.addLayout(judged)

    def _size_columns(self) -> None:
        """Give each column the width of its longest text, without laying out every cell."""
        font, header = self.font(), self._list.header()
        # As the open volume is written.
        font.setBold(True)
        metrics = QFontMetrics(font)
        letter = metrics.averageCharWidth()
        for column, each in enumerate(self._model.columns):
            texts = (self._model.widest_text(column), self._summary.widest_text(column))
            width = max(metrics.horizontalAdvance(text) for text in texts) + _PADDING_LETTERS * letter
            if column == VOLUME:
                width = min(width, _LONGEST_NAME_LETTERS * letter)
            lines = each.title.split("\n")
            titled = max(map(metrics.horizontalAdvance, lines)) + _SORT_MARK_LETTERS * letter
            header.resizeSection(column, max(width, titled))

    def _select_open(self) -> None:
        """Put the cursor on the open volume, unless it is on its way to another one."""
        row = self._model.row_of(self._session.reviewing.open_volume)
        if row is None or self._rest.isActive() or self._list.currentIndex().row() == row:
            return
        self._is_selecting = True
        self._list.setCurrentIndex(self._model.index(row, 0))
        self._is_selecting = False
        self._list.scrollTo(self._model.index(row, 0))
        self._height_px = self._list.viewport().height()

    @Slot()
    def _open_current(self) -> None:
        self._rest.stop()
        row = self._list.currentIndex().row()
        if row >= 0:
            self._session.reviewing.open(self._model.volumes[row])

    @Slot(QModelIndex, QModelIndex)
    def _on_list_current_row_changed(self, current: QModelIndex, _before: QModelIndex) -> None:
        if current.isValid() and not self._is_selecting:
            self._rest.start()

    @Slot(int, int)
    def _on_list_range_changed(self, _first: int, _last: int) -> None:
        """Keep the volume that was in sight there in a list that has become lower."""
        before_px, self._height_px = self._height_px, self._list.viewport().height()
        current = self._list.currentIndex()
        row = self._list.visualRect(current)
        if row.isValid() and row.top() < before_px and row.bottom() >= self._height_px:
            self._list.scrollTo(current)

    @Slot(int)
    def _on_kind_current_index_changed(self, _: int) -> None:
        self._model.show_kind(self._kind.currentData())

    @Slot(int)
    def _on_way_current_index_changed(self, _: int) -> None:
        self._model.show_by_fit(self._way.currentData())
        self._size_columns()

    @Slot(int, int, int)
    def _on_header_section_resized(self, column: int, _before: int, width: int) -> None:
        self._figures.setColumnWidth(column, width)

    @Slot()
    def _on_model_shown_changed(self) -> None:
        self._session.reviewing.set_order(self._model.volumes)
        shown = len(self._model.volumes)
        self._words.setText(f"{shown} of {self._model.count} volumes are shown.")
        self._words.setVisible(shown < self._model.count)
        rows = self._summary.rowCount()
        row_height = self._figures.sizeHintForRow(0)
        self._figures.setFixedHeight(rows * row_height + 2 * self._figures.frameWidth())
        for column in range(self._summary.columnCount()):
            self._figures.setColumnWidth(column, self._list.columnWidth(column))
        self._select_open()

    @Slot()
    def _on_judging_changed(self) -> None:
        self._model.show_judgements(self._session.judging.judgement)


def _table(name: str, title: str) -> QTreeView:
    table = named(QTreeView(), name, title=title)
    table.setRootIsDecorated(False)
    table.setUniformRowHeights(True)
    keep_painted(table.viewport())
    table.setAllColumnsShowFocus(True)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
    table.setTextElideMode(Qt.TextElideMode.ElideMiddle)
    table.header().setStretchLastSection(False)
    return table
