"""Settling the consensus: which volumes need it first, and the one that is open."""

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QPushButton, QTabWidget, QVBoxLayout, QWidget

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.agreement.consensus_page import ConsensusPage
from annotator.panels.agreement.triage_page import TriagePage
from annotator.session import Session

_INVITATION = (
    "The consensus on a volume is a document of its own, proposed from what several annotators placed; "
    "theirs stay as they are."
)


class ConsensusPanel(QWidget):
    """Shows a reviewer the ranked volumes and the open consensus; anybody else, why it is not for them."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._was_settling = False
        self.setObjectName("consensus_panel")
        self.setAccessibleName("Consensus")
        self._words = WrappedText(name="consensus_reason")
        self._settle = named(QPushButton("&Settle the consensus"), "consensus_settle")
        self._settle.setToolTip("Open the consensus on the open volume; where there is none, propose it")
        self._settle.clicked.connect(self._on_settle_clicked)
        self._tabs = named(QTabWidget(), "consensus_tabs", title="Consensus")
        self._tabs.setDocumentMode(True)
        self._parts_tab = self._tabs.addTab(ConsensusPage(session), "This volume")
        self._triage_tab = self._tabs.addTab(TriagePage(session), "Volumes by rank")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addWidget(self._words)
        layout.addWidget(self._settle)
        layout.addWidget(self._tabs, 1)
        layout.addStretch()
        session.settling.changed.connect(self._draw)
        session.settling.triaged.connect(self._on_settling_triaged)
        session.volume_changed.connect(self._draw)
        self._draw()

    @Slot()
    def _on_settle_clicked(self) -> None:
        self._session.settling.settle()

    @Slot()
    def _on_settling_triaged(self) -> None:
        if self._session.settling.is_triaging:
            self._tabs.setCurrentIndex(self._triage_tab)

    @Slot()
    def _draw(self) -> None:
        settling = self._session.settling
        reason, is_settling = settling.reason, settling.is_settling
        self._words.setText(f"{reason}." if reason else _INVITATION)
        self._words.setVisible(bool(reason) or not is_settling)
        self._settle.setVisible(not reason and not is_settling)
        self._settle.setEnabled(self._session.volume is not None)
        self._tabs.setVisible(not reason)
        self._tabs.setTabVisible(self._parts_tab, is_settling)
        if is_settling and not self._was_settling:
            self._tabs.setCurrentIndex(self._parts_tab)
        self._was_settling = is_settling
