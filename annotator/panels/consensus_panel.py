"""Settling the consensus: which volumes need it first, and the one that is open."""

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QPushButton, QVBoxLayout, QWidget

from annotator.looks.folding import Folding
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.consensus_page import ConsensusPage
from annotator.panels.triage_page import TriagePage
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
        self.setObjectName("consensus_panel")
        self.setAccessibleName("Consensus")
        self._words = WrappedText(name="consensus_reason")
        self._settle = named(QPushButton("&Settle the consensus"), "consensus_settle")
        self._settle.clicked.connect(self._on_settle_clicked)
        self._page = ConsensusPage(session)
        self._triage = TriagePage(session)
        self._folding = Folding("Volumes by rank", self._triage, name="consensus_triage", unfolded=True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addWidget(self._words)
        layout.addWidget(self._settle)
        layout.addWidget(self._page, 3)
        layout.addWidget(self._folding, 2)
        layout.addStretch()
        session.settling.changed.connect(self._draw)
        session.volume_changed.connect(self._draw)
        self._draw()

    @Slot()
    def _on_settle_clicked(self) -> None:
        self._session.settling.settle()

    @Slot()
    def _draw(self) -> None:
        settling = self._session.settling
        reason, is_settling = settling.reason, settling.is_settling
        self._words.setText(f"{reason}." if reason else _INVITATION)
        self._words.setVisible(bool(reason) or not is_settling)
        self._settle.setVisible(not reason and not is_settling)
        self._settle.setToolTip("Open the consensus on the open volume; where there is none, propose it")
        # Hidden first: with both in sight for a moment the window would have to grow.
        self._page.setVisible(is_settling and not reason)
        self._folding.setVisible(not reason)
