"""The list by which a reviewer settles a study: ranked on demand, and the way to each volume's consensus."""

from PySide6.QtCore import QModelIndex, QSortFilterProxyModel, Qt, Slot
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.agreement.triage_model import FLAGS, WHY, TriageModel
from annotator.panels.widgets.table_model import SORT_ROLE
from annotator.session import Session

_INVITATION = "Ranks the volumes: what needs a reviewer first, by flags, disagreement and how the tool fits."
_RANKING = "Reading and fitting all annotations…"
_NOTHING = "Nobody has annotated anything by {} yet."
_LONGEST_LETTERS = 44
_MARGIN = 4


class TriagePage(QWidget):
    """Volumes by what needs a reviewer most; Enter or a double click opens the consensus on one."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._has_ranked = False
        self._rank = named(QPushButton(), "triage_rank")
        self._rank.clicked.connect(self._on_rank_clicked)
        self._words = WrappedText(name="triage_words")
        self._words.set_color(lambda colors: colors.muted)
        self._model = TriageModel(self)
        self._sorted = QSortFilterProxyModel(self)
        self._sorted.setSourceModel(self._model)
        self._sorted.setSortRole(SORT_ROLE)
        self._list = named(QTreeView(), "triage_list", title="Volumes by what needs a reviewer first")
        self._list.setModel(self._sorted)
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        self._list.setAlternatingRowColors(True)
        self._list.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._list.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        header = self._list.header()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        for column in (FLAGS, WHY):
            # Their words can be long, and are whole in the tooltip.
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Interactive)
            header.resizeSection(column, self.fontMetrics().averageCharWidth() * _LONGEST_LETTERS)
        # By no column at first: as they were ranked.
        header.setSortIndicatorClearable(True)
        header.setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        self._list.setSortingEnabled(True)
        self._list.activated.connect(self._on_list_activated)
        row = QHBoxLayout()
        row.addWidget(self._rank)
        row.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, _MARGIN, 0, 0)
        layout.addLayout(row)
        layout.addWidget(self._words)
        layout.addWidget(self._list, 1)
        session.settling.triaged.connect(self._draw)
        session.settling.changed.connect(self._draw)
        self._draw()

    @Slot()
    def _on_rank_clicked(self) -> None:
        settling = self._session.settling
        if settling.is_triaging:
            settling.cancel_triage()
        else:
            self._has_ranked = True
            settling.triage()

    @Slot(QModelIndex)
    def _on_list_activated(self, index: QModelIndex) -> None:
        self._session.settling.settle(self._model.volume_id(self._sorted.mapToSource(index).row()))

    @Slot()
    def _draw(self) -> None:
        settling, current = self._session.settling, self._session.current_index
        entries = settling.entries
        self._rank.setText("Cancel" if settling.is_triaging else "&Rank the volumes")
        self._rank.setToolTip("" if settling.is_triaging else "Read all annotations again, and rank")
        self._model.show_entries(entries)
        self._model.mark_open(self._session.items[current].volume_id if current is not None else None)
        self._list.setVisible(bool(entries))
        if settling.is_triaging:
            words = _RANKING
        elif entries:
            left = sum(entry.settled != "done" for entry in entries)
            words = f"{left} of {len(entries)} to settle, those that need it most first."
        else:
            words = _NOTHING.format(self._session.method) if self._has_ranked else _INVITATION
        self._words.setText(words)
