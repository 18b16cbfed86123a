"""Several checkpoints side by side: on the same volumes, and how sure it is that one of them is nearer."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QComboBox, QHeaderView, QTableWidgetItem, QVBoxLayout, QWidget

from annotations.agreement.report.contents import Table
from annotations.prediction.report.paired_table import IN_WORDS, paired_table
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.widgets.read_only_table import ReadOnlyTable
from annotator.session import Session

_WAYS = ("predicted keypoints", "fitted pose")
_BY = 2
"""Place of the column of the report's table that says of what the errors are: here it is chosen."""


class PairedPage(QWidget):
    """The report's table of differences, for the errors of one kind at a time."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("paired_page")
        self._reviewing = session.reviewing
        self._drawn: object = None
        self._shown: Table | None = None
        self._caption = WrappedText(name="paired_caption")
        self._way = named(QComboBox(), "paired_way", title="Of what the errors are")
        for way in _WAYS:
            self._way.addItem(way.capitalize(), way)
        self._way.currentIndexChanged.connect(self._on_way_current_index_changed)
        self._table = ReadOnlyTable("paired_table", "Checkpoints side by side")
        self._table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self._table.verticalHeader().hide()
        self._words = WrappedText(IN_WORDS, name="paired_words")
        self._words.set_color(lambda colors: colors.muted)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 0)
        for each in (self._caption, self._way, self._table, self._words):
            layout.addWidget(each)
        layout.addStretch(1)

    def draw(self) -> None:
        """Show what was computed last."""
        review = self._reviewing.review
        if review is not self._drawn:
            self._drawn = review
            self._shown = paired_table(review.material) if review is not None else None
            self._write()

    @Slot(int)
    def _on_way_current_index_changed(self, _: int) -> None:
        self._write()

    def _write(self) -> None:
        table = self._shown
        if table is None:
            return
        self._caption.setText(table.caption)
        columns = [place for place in range(len(table.columns)) if place != _BY]
        rows = [row for row in table.rows if row[_BY] == self._way.currentData()]
        self._table.setColumnCount(len(columns))
        self._table.setRowCount(len(rows))
        above = ""
        for row, cells in enumerate(rows):
            for column, place in enumerate(columns):
                # The name of an error stands once, before the checkpoints.
                text = "" if place == 0 and cells[0] == above else cells[place]
                item = self._table.write(row, column, text, cells[place])
                if place == 0 or place in table.words:
                    item.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
            above = cells[0]
        for column, place in enumerate(columns):
            self._table.setHorizontalHeaderItem(column, QTableWidgetItem(table.columns[place]))
        self._table.fit_height()
