"""What the menu Tools does about the consensus, and about the training files that are made of it."""

from collections.abc import Callable, Mapping

from PySide6.QtWidgets import QDockWidget, QWidget

from annotations.errors import UserError
from annotator.session import Session
from annotator.window.dock_handlers import DockHandlers
from annotator.window.questions import Questions


class ConsensusHandlers(DockHandlers):
    """Turns menu entries into wishes about the consensus and the export for training.

    The consensus's panel comes to the front when something is settled or ranked.
    """

    def __init__(self, session: Session, questions: Questions, window: QWidget, dock: QDockWidget) -> None:
        super().__init__(session, questions, window, dock)
        session.exporting.exported.connect(self._on_exporting_exported)
        session.exporting.failed.connect(self._on_exporting_failed)

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        return {
            "settle_consensus": self._settle,
            "propose_consensus": self._session.settling.propose,
            "leave_consensus": self._session.settling.leave,
            "rank_volumes": self._rank,
            "export_targets": self._export,
        }

    def _settle(self) -> None:
        self._show_dock()
        self._session.settling.settle()

    def _rank(self) -> None:
        self._show_dock()
        self._session.settling.triage()

    def _export(self) -> None:
        from annotator.dialogs.exports.training_export_dialog import TrainingExportDialog  # late: few export

        worklist, refusal = self._session.worklist, self._session.exporting.refusal
        if worklist.study is None or refusal:
            self._session.post_message(refusal)
            return
        dialog = TrainingExportDialog(worklist.study, worklist.folder, self._session.method, self._window)
        dialog.accepted.connect(lambda: self._session.exporting.export(dialog.path, dialog.options))
        self._questions.show(dialog)

    def _on_exporting_exported(self, exported: object) -> None:
        from annotations.interchange.training_file import Exported  # late: few export
        from annotator.dialogs.exports.training_report_dialog import TrainingReportDialog

        if isinstance(exported, Exported):
            self._questions.show(TrainingReportDialog(exported, self._window))

    def _on_exporting_failed(self, error: UserError) -> None:
        self._session.report(error)
