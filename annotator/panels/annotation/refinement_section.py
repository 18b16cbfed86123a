"""What the volume itself proposes for the tool's pose: looked for on demand, accepted or rejected."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.widgets.read_only_table import ReadOnlyTable
from annotator.session import Session
from annotator.session.jobs import Job

_IDLE = "Polishes the pose so that the tool's surface lies on bright surfaces of the volume."
_READING = "Reading the volume…"
_PROPOSED = "Each keypoint would move as far as it says below."


class RefinementSection(QWidget):
    """A button that asks for a proposal; then how far each keypoint would move, and two that answer it."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._is_reading = False
        self._text = WrappedText(name="refine_text")
        self._moves = ReadOnlyTable("refine_moves", "How far each keypoint would move")
        self._moves.setColumnCount(2)
        self._moves.setHorizontalHeaderLabels(("Keypoint", "Move / µm"))
        self._moves.verticalHeader().setVisible(False)
        self._surface = WrappedText(name="refine_surface")
        self._surface.set_color(lambda colors: colors.muted)
        self._remark = WrappedText(name="refine_remark")
        self._remark.set_color(lambda colors: colors.warning)
        self._refine = named(QPushButton("&Refine against the volume"), "refine_start")
        self._refine.setToolTip("Look for the tool's surface in the volume, near to where the tool is")
        self._refine.clicked.connect(self._on_refine_clicked)
        self._accept = named(QPushButton("Accept"), "refine_accept")
        self._accept.setToolTip("Move what is placed there: one step that can be undone (Return)")
        self._accept.clicked.connect(self._on_accept_clicked)
        self._reject = named(QPushButton("Reject"), "refine_reject")
        self._reject.setToolTip("Leave everything where it is (Esc)")
        self._reject.clicked.connect(self._on_reject_clicked)
        buttons = QHBoxLayout()
        for button in (self._refine, self._accept, self._reject):
            buttons.addWidget(button)
        buttons.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 0, 0, 4)
        layout.addWidget(self._text)
        layout.addLayout(buttons)
        layout.addWidget(self._moves)
        layout.addWidget(self._surface)
        layout.addWidget(self._remark)
        session.jobs.job_changed.connect(self._on_jobs_job_changed)

    def draw(self) -> None:
        """Show where the refinement stands."""
        refinement = self._session.view.refinement
        self._is_reading = is_reading = self._session.is_refining
        self._text.setText(_READING if is_reading else _IDLE if refinement is None else _PROPOSED)
        self._text.set_color(None if refinement is not None else lambda colors: colors.muted)
        self._refine.setVisible(refinement is None)
        self._refine.setEnabled(not is_reading and bool(self._session.shown_positions_um()))
        for widget in (self._moves, self._surface, self._accept, self._reject):
            widget.setVisible(refinement is not None)
        self._remark.setVisible(refinement is not None and bool(refinement.remark))
        if refinement is not None:
            before_um, after_um = refinement.surface_rms_before_um, refinement.surface_rms_after_um
            self._surface.setText(
                f"Then the tool's surface lies {after_um:.0f} µm rms from what the volume shows, "
                f"{before_um:.0f} µm before."
            )
            self._remark.setText(refinement.remark)
            self._show_moves()

    def _show_moves(self) -> None:
        moves_um = self._session.refinement_moves_um()
        if self._moves.rowCount() != len(moves_um):
            self._moves.clearContents()
            self._moves.setRowCount(len(moves_um))
            self._moves.fit_height()
        for row, (name, move_um) in enumerate(moves_um.items()):
            self._moves.write(row, 0, name).setTextAlignment(Qt.AlignmentFlag.AlignCenter)
            self._moves.write(row, 1, f"{move_um:.0f}")

    @Slot(object)
    def _on_jobs_job_changed(self, _job: Job) -> None:
        if self._session.is_refining != self._is_reading:
            self.draw()

    @Slot()
    def _on_refine_clicked(self) -> None:
        self._session.refine()
        self.draw()

    @Slot()
    def _on_accept_clicked(self) -> None:
        self._session.accept_refinement()

    @Slot()
    def _on_reject_clicked(self) -> None:
        self._session.reject_refinement()
