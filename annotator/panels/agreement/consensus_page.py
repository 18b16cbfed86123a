"""The open consensus: its parts, whose each may be taken, and what a reviewer does with the whole."""

from functools import partial

from PySide6.QtCore import QItemSelectionModel, QModelIndex, Qt, Slot
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QMenu,
    QPushButton,
    QTableView,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from annotations.agreement.consensus import PartConsensus, distance_um
from annotations.documents.annotation import Part
from annotator.looks.annotator_marks import annotator_swatch
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.agreement.consensus_model import TAKE, ConsensusModel
from annotator.session import Session
from annotator.session.viewing.view import View

_MARGIN = 4


class ConsensusPage(QWidget):
    """What the annotators agree on, part by part; the selected row is the active part of all views."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._words = WrappedText(name="consensus_words")
        self._stale = WrappedText(name="consensus_stale")
        self._stale.set_color(lambda colors: colors.warning)
        self._model = ConsensusModel(session, self)
        self._table = named(QTableView(), "consensus_parts", title="Parts of the consensus")
        self._table.setModel(self._model)
        self._table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self._table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self._table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self._table.setAlternatingRowColors(True)
        self._table.setShowGrid(False)
        self._table.setWordWrap(False)
        self._table.setTabKeyNavigation(False)
        self._table.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self._table.verticalHeader().setVisible(False)
        self._table.verticalHeader().setDefaultSectionSize(int(self.fontMetrics().height() * 1.7))
        self._table.horizontalHeader().setHighlightSections(False)
        self._table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self._table.selectionModel().currentRowChanged.connect(self._on_table_current_row_changed)
        self._model.modelReset.connect(self._on_model_model_reset)
        self._propose = named(QPushButton("&Propose again"), "consensus_propose")
        self._propose.setToolTip(
            "Read the annotations anew, and put what they agree on where you have not decided"
        )
        self._propose.clicked.connect(session.settling.propose)
        self._accept = named(QPushButton("&Accept, next"), "consensus_accept")
        self._accept.clicked.connect(self._on_accept_clicked)
        self._leave = named(QPushButton("&Leave"), "consensus_leave")
        self._leave.setToolTip("Go back to my own list, at the same volume")
        self._leave.clicked.connect(session.settling.leave)
        buttons = QHBoxLayout()
        buttons.addWidget(self._propose)
        buttons.addWidget(self._accept)
        buttons.addStretch(1)
        buttons.addWidget(self._leave)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, _MARGIN, 0, 0)
        layout.addWidget(self._words)
        layout.addWidget(self._stale)
        layout.addWidget(self._table, 1)
        layout.addLayout(buttons)
        session.document_changed.connect(self._on_session_document_changed)
        session.view_changed.connect(self._on_session_view_changed)
        session.save_state_changed.connect(self._draw)
        session.settling.changed.connect(self._draw)
        session.settling.triaged.connect(self._draw)
        self._make_menus()
        self._draw()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._session.settling.look_for_changes()

    def _make_menus(self) -> None:
        """Give each row a button whose menu has the annotators who placed the part."""
        for row in range(self._model.rowCount()):
            name = self._model.name(row)
            button = named(QToolButton(), f"consensus_take_{name}", title=f"Take somebody's {name}")
            button.setText("Take")
            button.setAutoRaise(True)
            button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            menu = QMenu(button)
            menu.setObjectName(f"consensus_take_{name}_menu")
            menu.aboutToShow.connect(partial(self._fill_menu, menu, name))
            button.setMenu(menu)
            self._table.setIndexWidget(self._model.index(row, TAKE), button)
        self._table.setColumnWidth(TAKE, self.fontMetrics().horizontalAdvance("Take ▾ ") + 4 * _MARGIN)
        self._table.horizontalHeader().setSectionResizeMode(TAKE, QHeaderView.ResizeMode.Fixed)

    def _fill_menu(self, menu: QMenu, name: str) -> None:
        menu.clear()
        settling, document = self._session.settling, self._session.document
        agreed = settling.part(name)
        if document is None or agreed is None:
            return
        present = document.part(name)
        numbers = {other.annotator: other.number for other in self._session.others.shown}
        for annotator, part in settling.opinions_on(name).items():
            action = menu.addAction(_offer(annotator, part, present, agreed))
            if annotator in numbers:
                action.setIcon(annotator_swatch(numbers[annotator]))
            action.setEnabled(not present.locked and not self._session.read_only_reason)
            action.triggered.connect(partial(settling.adopt, name, annotator))
        if menu.isEmpty():
            menu.addAction("Nobody has placed it").setEnabled(False)

    @Slot()
    def _on_accept_clicked(self) -> None:
        session = self._session
        session.set_status("done")
        if session.document is not None and session.document.status == "done" and not session.unsaved:
            session.settling.settle_next()

    @Slot(QModelIndex, QModelIndex)
    def _on_table_current_row_changed(self, current: QModelIndex, _previous: QModelIndex) -> None:
        if current.isValid() and self._model.name(current.row()) != self._session.view.active_part:
            self._session.activate(self._model.name(current.row()), jump=True)

    @Slot()
    def _on_model_model_reset(self) -> None:
        self._make_menus()
        self._draw_selection()

    @Slot(object, object)
    def _on_session_document_changed(self, _before: object, _after: object) -> None:
        self._draw()

    @Slot(object, object)
    def _on_session_view_changed(self, before: View, after: View) -> None:
        if before.active_part != after.active_part:
            self._draw_selection()

    def _draw_selection(self) -> None:
        row = self._model.row(self._session.view.active_part)
        selection = self._table.selectionModel()
        if row is None:
            selection.clear()
        elif selection.currentIndex().row() != row:
            flags = QItemSelectionModel.SelectionFlag
            selection.setCurrentIndex(self._model.index(row, 0), flags.ClearAndSelect | flags.Rows)

    @Slot()
    def _draw(self) -> None:
        session, settling = self._session, self._session.settling
        document = session.document
        is_open = settling.is_settling and document is not None
        self._words.setText(self._state_words())
        stale = self._stale_words()
        self._stale.setText(stale)
        self._stale.setVisible(bool(stale))
        may_edit = is_open and not session.read_only_reason
        is_proposed = document is not None and bool(document.consensus_of)
        self._propose.setText("&Propose again" if is_proposed else "&Propose")
        self._propose.setEnabled(may_edit)
        # In nobody's own list: a volume is named.
        following = settling.next_volume_id() if is_open else None
        is_placed = document is not None and any(part.anchor_um is not None for part in document.parts)
        is_done = document is not None and document.status == "done"
        wishes = [] if is_done else ["mark it as done"]
        wishes += [f"go on to {following}"] if following is not None else []
        self._accept.setText("&Next" if is_done else "&Accept, next" if following is not None else "&Accept")
        self._accept.setToolTip(" and ".join(wishes).capitalize() or "Every volume is settled")
        self._accept.setEnabled(may_edit and is_placed and bool(wishes))
        self._draw_selection()

    def _state_words(self) -> str:
        session, settling = self._session, self._session.settling
        document, consensus = session.document, settling.consensus
        if document is None:
            return "No volume is open."
        if session.read_only_reason:
            return f"Read-only. {session.read_only_reason}."
        if consensus is None:
            return "Reading what the annotators say…" if settling.is_reading else ""
        people = list(dict.fromkeys(name for part in consensus.parts.values() for name in part.used))
        if not people:
            return f"Nobody has annotated {session.volume_label} by {document.method} yet."
        done = "Settled" if document.status == "done" else "Consensus"
        words = f"{done}: {session.volume_label}, by {document.method}, of {', '.join(people)}."
        if document.status == "done" and session.review is not None:
            reviewer, moment = session.review
            accepted = "Changed last" if session.unsaved else "Accepted"
            words += f" {accepted} by {reviewer}, {moment.astimezone():%-d %b %Y}."
        elif document.consensus_of and session.is_mere_proposal:
            words += " Only proposed: it is saved once you change or accept it."
        moved = [f"{name} by {um:,.0f} µm" for name, um in settling.moved_um.items()]
        if moved:
            words += f" Proposing again moved {', '.join(moved)}: accept it anew."
        return words

    def _stale_words(self) -> str:
        settling = self._session.settling
        if not settling.is_stale:
            return ""
        changed = settling.changed_since
        who = f"{', '.join(changed)} {'has' if len(changed) == 1 else 'have'}"
        return f"{who} changed something since this was proposed: propose again to see what it comes to."


def _offer(annotator: str, part: Part, present: Part, agreed: PartConsensus) -> str:
    off_um = distance_um(part, present)
    words = [annotator] if off_um is None else [f"{annotator}: {off_um:,.0f} µm from here"]
    if present.source == "adopted" and present.adopted_from == annotator:
        words.append("taken")
    if annotator in agreed.set_aside:
        words.append("set aside")
    if annotator in agreed.turned:
        words.append("turned")
    # An ampersand would be taken for the mark of a key.
    return ", ".join(words).replace("&", "&&")
