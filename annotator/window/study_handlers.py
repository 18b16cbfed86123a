"""New studies, the settings of the open one, and its check."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QWidget

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study_building import StudyChanged
from annotations.errors import UserError
from annotator.dialogs.study.study_check_dialog import StudyCheckDialog
from annotator.dialogs.study.study_dialog import StudyDialog
from annotator.dialogs.study.study_form import problem_of
from annotator.dialogs.study.study_settings_dialog import StudySettingsDialog
from annotator.session import Session
from annotator.session.studies import StudyProposal, StudyReport
from annotator.settings import Settings
from annotator.window.questions import Questions

_BLIND = (
    "You annotate this study blind, and its {} would show the volumes by name: {} for whoever does not "
    "annotate here"
)


class StudyHandlers(QObject):
    """Asks what a study is to be, and hands the answers to the session.

    Parameters
    ----------
    open_path : callable
        Opens a study or an annotation, once what is open is saved.
    """

    def __init__(
        self,
        session: Session,
        settings: Settings,
        questions: Questions,
        window: QWidget,
        open_path: Callable[[Path], None],
    ) -> None:
        super().__init__(window)
        self._session = session
        self._settings = settings
        self._questions = questions
        self._window = window
        self._open_path = open_path
        self._new_dialog: StudyDialog | None = None
        self._settings_dialog: StudySettingsDialog | None = None
        self._check_dialog: StudyCheckDialog | None = None
        session.worklist_changed.connect(self._on_session_worklist_changed)
        session.studies.proposed.connect(self._on_studies_proposed)
        session.studies.created.connect(self._on_studies_created)
        session.studies.create_failed.connect(self._on_studies_create_failed)
        session.studies.volumes_found.connect(self._on_studies_volumes_found)
        session.studies.search_failed.connect(self._on_studies_search_failed)
        session.studies.changed.connect(self._on_studies_changed)
        session.studies.change_failed.connect(self._on_studies_change_failed)
        session.studies.checked.connect(self._on_studies_checked)

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        return {
            "new_study": self._ask_for_volumes,
            "study_settings": self._ask_for_changes,
            "check_study": self._check,
        }

    def _ask_for_volumes(self) -> None:
        recent = self._settings.recent_paths
        chosen = QFileDialog.getExistingDirectory(
            self._window, "Make a study of the volumes in", str(recent[0].parent) if recent else ""
        )
        if chosen:
            self._session.studies.propose(Path(chosen))

    def _ask_for_changes(self) -> None:
        study, folder = self._session.studies.study, self._session.studies.folder
        if study is None or folder is None or self._is_kept_from("settings", "they are"):
            return
        self._show_settings(StudySettingsDialog(study, folder, self._window))

    def _show_settings(self, dialog: StudySettingsDialog) -> None:
        def on_dialog_submitted() -> None:
            if dialog.study is not None:
                self._session.studies.change(dialog.before, dialog.study)

        def on_dialog_finished() -> None:
            if self._settings_dialog is dialog:
                self._settings_dialog = None

        self._settings_dialog = dialog
        dialog.volumes_requested.connect(self._session.studies.find)
        dialog.submitted.connect(on_dialog_submitted)
        dialog.finished.connect(on_dialog_finished)
        self._questions.show(dialog)

    def _check(self) -> None:
        if not self._is_kept_from("check", "it is"):
            # What is not in its file yet would be said to be missing.
            self._questions.save()
            self._session.studies.check()

    def _is_kept_from(self, what: str, they_are: str) -> bool:
        if self._session.studies.is_kept_from_names:
            self._session.post_message(_BLIND.format(what, they_are))
            return True
        return False

    def _on_session_worklist_changed(self) -> None:
        studies = self._session.studies
        if self._check_dialog is not None and (
            studies.is_kept_from_names or studies.folder != self._check_dialog.folder
        ):
            # It would go on naming volumes to somebody who is not to know them, or those of another study.
            self._check_dialog.hide()

    def _on_studies_proposed(self, proposal: StudyProposal) -> None:
        dialog = StudyDialog(proposal, self._session.annotator_name, self._session.tool_name, self._window)

        def on_dialog_submitted() -> None:
            if dialog.study is not None:
                self._session.studies.create(dialog.study, dialog.folder, dialog.tool)

        def on_dialog_finished() -> None:
            self._new_dialog = None

        self._new_dialog = dialog
        dialog.submitted.connect(on_dialog_submitted)
        dialog.finished.connect(on_dialog_finished)
        self._questions.show(dialog)

    def _on_studies_created(self, folder: Path) -> None:
        if self._new_dialog is not None:
            self._new_dialog.finish()
        self._open_path(folder)

    def _on_studies_create_failed(self, error: Exception) -> None:
        if self._new_dialog is not None:
            self._new_dialog.show_failure(error)
        elif isinstance(error, UserError):
            self._questions.show_error(error)

    def _on_studies_volumes_found(self, found: Sequence[FoundVolume]) -> None:
        if self._settings_dialog is not None:
            self._settings_dialog.add_volumes(found)

    def _on_studies_search_failed(self, error: Exception) -> None:
        if self._settings_dialog is not None:
            self._settings_dialog.show_note(problem_of(error))

    def _on_studies_changed(self) -> None:
        if self._settings_dialog is not None:
            self._settings_dialog.finish()
        self._session.post_message("The study is changed; its file before is kept as study.toml.bak")

    def _on_studies_change_failed(self, error: Exception) -> None:
        dialog = self._settings_dialog
        if dialog is not None and isinstance(error, StudyChanged):
            try:
                anew = dialog.on_top_of(error.present)
            except UserError as contradiction:
                dialog.show_failure(contradiction)
            else:
                self._show_settings(anew)
                dialog.finish()
        elif dialog is not None:
            dialog.show_failure(error)
        elif isinstance(error, UserError):
            self._questions.show_error(error)

    def _on_studies_checked(self, report: StudyReport) -> None:
        if self._check_dialog is None:
            # Not a question: it stays beside the window while its findings are seen to.
            self._check_dialog = StudyCheckDialog(self._window)
            self._check_dialog.open_requested.connect(self._open_path)
            self._check_dialog.check_requested.connect(self._check)
        self._check_dialog.show_report(report)
        self._check_dialog.show()
        self._check_dialog.activateWindow()
