"""What there is to annotate, how far it is, and the way to the next volume."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, Qt, Signal, Slot
from PySide6.QtGui import QFontMetrics
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QPushButton,
    QStyle,
    QTreeView,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.record import Method
from annotator.looks.durations import duration
from annotator.looks.labels import ElidedText, WrappedText
from annotator.looks.naming import named
from annotator.looks.progress import ProgressBar
from annotator.looks.redrawing import PaintingApart, Redrawing, keep_painted
from annotator.panels.widgets.name_elision import ElidedNameDelegate
from annotator.panels.widgets.table_model import bold_font
from annotator.panels.worklist.worklist_filter import KINDS, WorklistFilter, kind_words
from annotator.panels.worklist.worklist_model import FLAG, PREDICTED, TIME, WorklistModel, status_words
from annotator.session import Session
from annotator.session.volumes.worklist import ItemStatus, WorkItem


class WorklistPanel(QWidget):
    """Lists the volumes; Enter or a double click opens one, after what is open has been saved.

    Signals
    -------
    open_file_requested, open_folder_requested
        A button was pressed: the window asks which.
    """

    open_file_requested = Signal()
    open_folder_requested = Signal()

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._told: tuple[object, ...] | None = None
        self._was_on = QPersistentModelIndex()
        self.setObjectName("worklist_panel")
        self.setAccessibleName("Volumes to annotate")
        self._title = ElidedText(name="worklist_title")
        self._model = WorklistModel(session, self)
        self._shown = WorklistFilter(self._model, self)

        self._filter = named(QLineEdit(), "worklist_filter")
        self._filter.setAccessibleName("Filter the volumes")
        self._filter.setPlaceholderText("Filter")
        self._filter.setToolTip("Shows the volumes whose name, status or flag contains this")
        self._filter.setClearButtonEnabled(True)
        self._filter.textChanged.connect(self._shown.show_text)
        self._kind = named(QComboBox(), "worklist_kind", title="Which volumes are listed")
        self._kind.setToolTip("Shows all the volumes, or those that are this far")
        for kind in KINDS:
            self._kind.addItem(kind_words(kind), kind)
        self._kind.currentIndexChanged.connect(self._on_kind_current_index_changed)

        self._list = QTreeView()
        self._list.setObjectName("worklist_list")
        self._list.setAccessibleName("Volumes")
        self._list.setModel(self._shown)
        self._list.setRootIsDecorated(False)
        self._list.setUniformRowHeights(True)
        keep_painted(self._list.viewport())
        self._list.setAlternatingRowColors(True)
        self._list.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._list.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self._list.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self._list.setItemDelegateForColumn(0, ElidedNameDelegate(self._model.shared_beginning, self._list))
        self._list.header().setStretchLastSection(False)
        self._list.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        # Qt would lay out every row in sight to measure them, each time that another volume is opened.
        for column in (FLAG, PREDICTED, TIME):
            self._list.header().setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)
        self._list.header().setMinimumSectionSize(self.fontMetrics().height())
        self._list.activated.connect(self._on_list_activated)
        self._painting = PaintingApart(self._list.viewport())
        self._shown.modelAboutToBeReset.connect(self._painting.ask)
        self._shown.modelReset.connect(self._on_shown_model_reset)

        self._progress = named(ProgressBar(), "worklist_progress")
        self._progress.setAccessibleName("Volumes done")
        # In words below it: where the bar ends they would be hard to read.
        self._progress.setTextVisible(False)
        self._progress.setMaximumHeight(self.fontMetrics().height() // 2)
        self._summary = WrappedText(name="worklist_summary")
        self._summary.set_color(lambda colors: colors.muted)
        open_file = named(QPushButton("Open &file…"), "worklist_open_file")
        open_file.setToolTip("Open a volume or an annotation")
        open_file.clicked.connect(self.open_file_requested)
        open_folder = named(QPushButton("Open f&older…"), "worklist_open_folder")
        open_folder.setToolTip("Open a study, or a folder of volumes")
        open_folder.clicked.connect(self.open_folder_requested)

        buttons = QHBoxLayout()
        buttons.addWidget(open_file)
        buttons.addWidget(open_folder)
        filters = QHBoxLayout()
        filters.addWidget(self._filter, 1)
        filters.addWidget(self._kind)
        layout = QVBoxLayout(self)
        layout.addWidget(self._title)
        layout.addWidget(self._progress)
        layout.addWidget(self._summary)
        layout.addLayout(filters)
        layout.addWidget(self._list, 1)
        layout.addLayout(buttons)
        # Wherever it is scrolled to for that, the whole list is painted.
        self._finding = Redrawing(self._find_current, self)
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.predicted_volumes.changed.connect(self._on_session_predicted_volumes_changed)
        self._draw()
        self._draw_predicted()

    @property
    def selected(self) -> tuple[int, ...]:
        """The places in the session's list of the volumes that are selected, in its order."""
        rows = self._list.selectionModel().selectedRows()
        return tuple(sorted(self._shown.mapToSource(row).row() for row in rows))

    @Slot(QModelIndex)
    def _on_list_activated(self, index: QModelIndex) -> None:
        row = self._shown.mapToSource(index).row()
        if row != self._session.current_index:
            self._session.open_item(row)
        else:
            self._session.try_again()

    @Slot(int)
    def _on_kind_current_index_changed(self, _: int) -> None:
        self._shown.show_kind(self._kind.currentData())

    @Slot()
    def _on_session_worklist_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_shown_model_reset(self) -> None:
        self._draw()

    @Slot()
    def _on_session_predicted_volumes_changed(self) -> None:
        self._draw_predicted()

    def _draw_predicted(self) -> None:
        self._list.setColumnHidden(PREDICTED, not self._session.predicted_volumes.is_any)

    def _draw(self) -> None:
        self._title.setText(self._session.title or "Nothing is open")
        worklist = self._session.worklist
        told = (worklist.items, worklist.done_elsewhere, worklist.consensus_done, worklist.study)
        # Another open volume changes nothing of it, and hundreds of items are counted.
        if self._told is None or any(one is not other for one, other in zip(told, self._told, strict=True)):
            self._told = told
            self._draw_progress()
            self._size_columns()
        self._was_on = QPersistentModelIndex(self._list.currentIndex())
        self._finding.ask_apart()

    def _find_current(self) -> None:
        current = self._session.current_index
        has_moved = self._was_on != self._list.currentIndex()
        # By a person, who has gone to another row meanwhile.
        if current is not None and not has_moved:
            index = self._shown.mapFromSource(self._model.index(current, 0))
            if index.isValid() and self._list.currentIndex().row() != index.row():
                self._list.setCurrentIndex(index)
                self._list.scrollTo(index)

    def _size_columns(self) -> None:
        header, metrics = self._list.header(), self.fontMetrics()
        mark_px = self._list.style().pixelMetric(QStyle.PixelMetric.PM_SmallIconSize) + metrics.height() // 2
        is_flagged = any(item.flag is not None for item in self._session.items)
        header.resizeSection(FLAG, mark_px if is_flagged else header.minimumSectionSize())
        header.resizeSection(PREDICTED, mark_px)
        time_px = self._model.widest_time(QFontMetrics(bold_font())) + metrics.height()
        header.resizeSection(TIME, max(time_px, header.sectionSizeHint(TIME)))

    def _draw_progress(self) -> None:
        items, worklist = self._session.items, self._session.worklist
        is_review = worklist.is_review
        done = worklist.consensus_done if is_review else sum(item.status == "done" for item in items)
        self._progress.setVisible(bool(items))
        self._progress.show_progress(done, max(len(items), 1))
        progress = f"{'Consensus: ' if is_review else ''}{done} of {len(items)} done"
        self._progress.setFormat(progress)
        whose = "whose consensus is settled" if is_review else "that are done"
        self._progress.setToolTip(f"Volumes {whose} by {self._session.method}")
        self._summary.setVisible(bool(items))
        work = () if is_review else _work_lines(items, worklist.done_elsewhere)
        self._summary.setText("\n".join((progress, *work)))


def _work_lines(items: Sequence[WorkItem], done_elsewhere: Mapping[Method, int]) -> list[str]:
    """Say what is left, how long the work took, what is flagged, and how far the other method is.

    As many lines, and as long, whatever is done: else the list below would move under the mouse.
    """
    left: tuple[ItemStatus, ...] = ("new", "in_progress")
    numbers = {status: sum(item.status == status for item in items) for status in left}
    counts = [f"{number} {status_words(status)}" for status, number in numbers.items()]
    seconds = sum(item.active_seconds for item in items)
    flagged = sum(item.flag is not None for item in items)
    spent = [f"{duration(seconds)} at work", f"{flagged} flagged"]
    others = [f"By {method}: {done} of {len(items)} done" for method, done in done_elsewhere.items()]
    return [_unbroken(counts), _unbroken(spent), *others]


def _unbroken(counts: Sequence[str]) -> str:
    """Return counts in one line, which is broken, if it must be, after a dot."""
    return " ".join(
        each.replace(" ", "\N{NO-BREAK SPACE}")
        for each in (*(f"{count} ·" for count in counts[:-1]), counts[-1])
    )
