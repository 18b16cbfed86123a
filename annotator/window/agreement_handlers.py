"""What the menu Tools does about the agreement of annotators: computes it, shows it, exports it."""

from collections.abc import Callable, Mapping

from annotator.window.dock_handlers import DockHandlers

_REPORT_FOLDER = "agreement"
_NOT_COMPUTED = "Compute the agreement first"


class AgreementHandlers(DockHandlers):
    """Turns menu entries into wishes about the agreement; its panel comes to the front with its figures."""

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        return {"compute_agreement": self._compute, "export_agreement": self.export}

    def export(self) -> None:
        """Ask which forms of the report are wanted, and where; then write it.

        Before that the annotations are looked at: the dialog says so where the figures are not of them.
        """
        agreeing = self._session.agreeing
        if agreeing.result is None or agreeing.folder is None or agreeing.export_refusal:
            self._session.post_message(agreeing.export_refusal or _NOT_COMPUTED)
            return
        agreeing.look_for_changes(self._ask_for_forms)

    def _ask_for_forms(self) -> None:
        from annotator.dialogs.exports.agreement_export_dialog import (
            AgreementExportDialog,  # late: few export
        )

        agreeing, reporting = self._session.agreeing, self._session.agreement_reporting
        if agreeing.folder is None:
            return
        is_old = agreeing.is_stale or agreeing.has_changed_files
        at = agreeing.computed_at if is_old else None
        dialog = AgreementExportDialog(agreeing.folder / _REPORT_FOLDER, self._window, computed_at=at)
        dialog.compute_requested.connect(self._compute)
        dialog.accepted.connect(lambda: reporting.export(dialog.folder, dialog.forms))
        self._questions.show(dialog)

    def _compute(self) -> None:
        self._show_dock()
        self._session.agreeing.compute()
