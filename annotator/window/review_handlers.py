"""What the menu Predictions does about their review: errors, the walk through them, verdicts, the export."""

from collections.abc import Callable, Mapping
from functools import partial

from annotator.actions.predictions_table import VERDICT_TITLES
from annotator.window.dock_handlers import DockHandlers

_REPORT_FOLDER = "errors"


class ReviewHandlers(DockHandlers):
    """Turns menu entries into wishes about the review; the predictions' panel comes to the front."""

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        reviewing = self._session.reviewing
        judge = self._session.judging.judge
        return {
            "next_worse": partial(reviewing.step, 1),
            "previous_worse": partial(reviewing.step, -1),
            "compute_errors": self._compute,
            "export_errors": self.export,
            **{f"verdict_{verdict}": partial(judge, verdict) for verdict in VERDICT_TITLES},
        }

    def export(self) -> None:
        """Ask which forms of the report are wanted, and where; then write it."""
        from annotator.dialogs.exports.errors_export_dialog import ErrorsExportDialog  # late: few export

        reviewing, reporting = self._session.reviewing, self._session.reporting
        review = reviewing.review
        if review is None or reporting.refusal:
            self._session.post_message(reporting.refusal)
            return
        at = review.at if reviewing.is_stale else None
        dialog = ErrorsExportDialog(review.folder / _REPORT_FOLDER, self._window, computed_at=at)
        dialog.compute_requested.connect(self._compute)
        dialog.accepted.connect(lambda: reporting.export(dialog.folder, dialog.forms))
        self._questions.show(dialog)

    def _compute(self) -> None:
        self._show_dock()
        self._session.reviewing.compute()
