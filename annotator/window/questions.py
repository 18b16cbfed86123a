"""What only a person can decide: the session's questions and errors as dialogs, one at a time."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QDialog, QFileDialog, QWidget

from annotations.documents.locks import LockHolder
from annotations.documents.recovery import Recovery
from annotations.documents.study import Study
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotations.geometry.box_conversion import RollUnknown
from annotations.geometry.frames import Vector
from annotations.volumes import DatasetChoice, Volume
from annotator.dialogs.error_dialog import ErrorDialog
from annotator.dialogs.files.dataset_dialog import DatasetDialog
from annotator.dialogs.files.overwrite_dialog import OverwriteDialog
from annotator.dialogs.files.recovery_dialog import RecoveryDialog
from annotator.dialogs.files.spacing_dialog import SpacingDialog
from annotator.dialogs.files.unsaved_dialog import UnsavedDialog
from annotator.session import Session
from annotator.session.agreement.calibrating import ToolCalibration
from annotator.session.files.deriving import roll_meanings
from annotator.session.predictions.checkpoints import CHECKPOINT_SUFFIX
from annotator.settings import Settings

if TYPE_CHECKING:
    from annotations.prediction.checkpoint import Checkpoint

_ANNOTATION_FILES = "Annotations (*.json)"
_CHECKPOINT_FILES = f"Checkpoints (*{CHECKPOINT_SUFFIX})"
_GO_ON = "Go on without saving"


class Questions(QObject):
    """Shows a dialog for every question of the session, and hands the answer back.

    Parameters
    ----------
    settings : Settings
        Where it is kept who works here.
    window : QWidget
        Parent of the dialogs.
    log_path : Path
        Offered where an error is unexpected.
    """

    def __init__(self, session: Session, settings: Settings, window: QWidget, log_path: Path) -> None:
        super().__init__(window)
        self._session = session
        self._settings = settings
        self._window = window
        self._log_path = log_path
        self._shown: QDialog | None = None
        self._waiting: list[QDialog] = []
        self._problems: list[str] | None = None
        self._told: set[str] = set()
        self._is_changed_on_disk = False

    def start(self) -> None:
        """Take the session's questions and errors from now on."""
        session = self._session
        session.spacing_requested.connect(self._on_session_spacing_requested)
        session.dataset_requested.connect(self._on_session_dataset_requested)
        session.recovery_requested.connect(self._on_session_recovery_requested)
        session.deriving.roll_requested.connect(self._on_deriving_roll_requested)
        session.calibrating.measured.connect(self._on_calibrating_measured)
        session.checkpoints.opened.connect(self._on_checkpoints_opened)
        session.checkpoints.conversion_requested.connect(self._on_checkpoints_conversion_requested)
        session.checkpoints.converted.connect(self._on_checkpoints_converted)
        session.look_requested.connect(self._on_session_look_requested)
        session.identifying.identity_requested.connect(self._on_identifying_identity_requested)
        session.identifying.is_asked = True
        session.takeover_requested.connect(self._on_session_takeover_requested)
        session.overwrite_requested.connect(self._on_session_overwrite_requested)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        session.error_raised.connect(self._on_session_error_raised)

    def show_error(self, error: Exception) -> None:
        """Show an error with a way out; `UserError` speaks for itself, any other is called unexpected."""
        log_path = None if isinstance(error, UserError) else self._log_path
        self.show(ErrorDialog(error, self._window, log_path=log_path, neutral=self._session.neutral))

    def show(self, dialog: QDialog) -> None:
        """Show a dialog of the window, after those that are already there."""
        self._waiting.append(dialog)
        if self._shown is None:
            self._show_next()

    def save(self) -> None:
        """Save because a person asked for it: a failure is said every time."""
        self.leave(lambda: None, _GO_ON)

    def leave(self, then: Callable[[], object], leaving: str) -> None:
        """Save what is open, then go on; where saving fails, let the person choose what to do.

        Parameters
        ----------
        then : callable
            What to do when the document is saved, or given up for now.
        leaving : str
            What it is called to go on without saving.
        """
        problem = None if leaving != _GO_ON and self._session.is_mere_proposal else self._save()
        if problem is None:
            then()
        elif self._is_changed_on_disk:
            self._ask_which_version(problem, then, leaving)
        else:
            self._ask_after_failure(problem, then, leaving)

    def save_elsewhere(self) -> bool:
        """Ask for another file and save there; False if nothing was saved."""
        if self._session.is_blind:
            self._session.post_message(
                "In this study an annotation stays where it is: nothing was saved elsewhere"
            )
            return False
        present = str(self._session.annotation_path or "")
        chosen, _ = QFileDialog.getSaveFileName(
            self._window, "Save the annotation as", present, _ANNOTATION_FILES
        )
        if not chosen:
            return False
        path = Path(chosen)
        return self._session.save_as(path if path.suffix else path.with_suffix(".json"))

    def _save(self) -> str | None:
        """Save, and return why that failed; None if all is saved."""
        self._session.settle_typing()
        if not self._session.unsaved:
            return None
        self._problems, self._is_changed_on_disk = [], False
        try:
            if self._session.save():
                return None
            return " ".join(self._problems) or "Saving failed again, for the same reason as before."
        finally:
            self._problems = None

    def _ask_after_failure(self, problem: str, then: Callable[[], object], leaving: str) -> None:
        dialog = UnsavedDialog(
            problem, self._shown_path(), leaving, self._window, may_move=not self._session.is_blind
        )

        def on_dialog_accepted() -> None:
            if dialog.choice == "retry":
                self.leave(then, leaving)
            elif dialog.choice == "save_elsewhere":
                if self.save_elsewhere():
                    then()
            elif dialog.choice == "leave":
                if leaving != _GO_ON:
                    self._session.abandon()
                then()

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _ask_which_version(self, problem: str, then: Callable[[], object], leaving: str) -> None:
        dialog = OverwriteDialog(
            problem, self._shown_path(), self._window, may_move=not self._session.is_blind
        )

        def on_dialog_accepted() -> None:
            if dialog.choice == "reload":
                if leaving == _GO_ON:
                    self._session.reload()
                else:
                    self._session.abandon()
                then()
            elif dialog.choice == "overwrite":
                if self._session.save(overwrite=True):
                    then()
            elif dialog.choice == "save_elsewhere" and self.save_elsewhere():
                then()

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _shown_path(self) -> Path | None:
        return None if self._session.is_blind else self._session.annotation_path

    def _show_next(self) -> None:
        self._shown = self._waiting.pop(0) if self._waiting else None
        if self._shown is not None:
            self._shown.finished.connect(self._on_shown_finished)
            self._shown.open()

    def _on_shown_finished(self) -> None:
        if self._shown is not None:
            self._shown.deleteLater()
        self._show_next()

    def _tell_of_failure(self, problem: str) -> None:
        if problem in self._told or isinstance(self._shown, UnsavedDialog):
            # On a full disk every edit fails: a dialog each time would leave no way to make room.
            self._session.post_message(problem)
        else:
            self._told.add(problem)
            self._ask_after_failure(problem, lambda: None, _GO_ON)

    def _on_session_save_state_changed(self) -> None:
        if not self._session.unsaved:
            self._told.clear()

    def _on_session_spacing_requested(self, volume: Volume, offered_um: Vector) -> None:
        folder = volume.path.parent
        beside = sum(item.volume_path.parent == folder for item in self._session.items)
        dialog = SpacingDialog(
            volume,
            offered_um,
            self._window,
            is_one_of_several=beside > 1,
            neutral_name=self._session.opening_label,
        )

        def on_dialog_accepted() -> None:
            if (answer := dialog.answer) is not None:
                self._session.provide_spacing(volume.path, answer)

        dialog.accepted.connect(on_dialog_accepted)
        dialog.rejected.connect(lambda: self._session.decline_opening(volume.path))
        self.show(dialog)

    def _on_session_dataset_requested(self, path: Path, choices: tuple[DatasetChoice, ...]) -> None:
        dialog = DatasetDialog(self._session.opening_label or path, choices, self._window)

        def on_dialog_accepted() -> None:
            if dialog.dataset is not None:
                self._session.provide_dataset(path, dialog.dataset)

        dialog.accepted.connect(on_dialog_accepted)
        dialog.rejected.connect(lambda: self._session.decline_opening(path))
        self.show(dialog)

    def _on_session_recovery_requested(self, recoveries: tuple[Recovery, ...]) -> None:
        dialog = RecoveryDialog(
            recoveries, self._window, neutral_names=self._session.recovery_names(recoveries)
        )
        dialog.recover_requested.connect(self._session.recover)
        dialog.discard_requested.connect(self._session.discard_recovery)
        self.show(dialog)

    def _on_deriving_roll_requested(self, unknown: RollUnknown) -> None:
        from annotator.dialogs.annotating.roll_dialog import (  # late: few ask for it
            RollChoiceDialog,
            RollEntryDialog,
        )

        document, tool = self._session.document, self._session.tool
        if document is None or tool is None:
            return
        meanings = roll_meanings(document, tool, unknown)
        dialog: RollChoiceDialog | RollEntryDialog
        if meanings:
            dialog = RollChoiceDialog(unknown.link, meanings, self._window)
        else:
            dialog = RollEntryDialog(unknown.link, self._window)

        def on_dialog_accepted() -> None:
            if dialog.roll_deg is not None:
                self._session.deriving.derive(dialog.roll_deg)

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _on_calibrating_measured(self, found: ToolCalibration) -> None:
        from annotator.dialogs.annotating.calibration_dialog import CalibrationDialog  # late: few ask for it

        dialog = CalibrationDialog(found, self._window)
        dialog.accepted.connect(lambda: self._session.calibrating.keep(found, dialog.name))
        self.show(dialog)

    def _on_checkpoints_conversion_requested(self, weights_path: Path) -> None:
        from annotator.dialogs.annotating.conversion_dialog import ConversionDialog  # late: few train

        dialog = ConversionDialog(weights_path, self._window)

        def on_dialog_accepted() -> None:
            if dialog.choice == "convert":
                self._ask_for_checkpoint_name(weights_path)

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _ask_for_checkpoint_name(self, weights_path: Path) -> None:
        present = weights_path.with_suffix(CHECKPOINT_SUFFIX)
        dialog = QFileDialog(self._window, "Keep the checkpoint as", str(present.parent), _CHECKPOINT_FILES)
        dialog.setObjectName("checkpoint_name_dialog")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        # By the dialog, not afterwards: it is the one that asks before a file is replaced.
        dialog.setDefaultSuffix(CHECKPOINT_SUFFIX)
        dialog.selectFile(present.name)
        dialog.fileSelected.connect(lambda name: self._session.checkpoints.convert(weights_path, Path(name)))
        self.show(dialog)

    def _on_checkpoints_opened(self, checkpoint: "Checkpoint") -> None:
        self._show_checkpoint(checkpoint, is_new=False)

    def _on_checkpoints_converted(self, checkpoint: "Checkpoint") -> None:
        self._show_checkpoint(checkpoint, is_new=True)

    def _show_checkpoint(self, checkpoint: "Checkpoint", *, is_new: bool) -> None:
        from annotator.dialogs.checkpoint_dialog import CheckpointDialog, CheckpointFit  # late: few open one

        worklist, predicting = self._session.worklist, self._session.predicting
        folder = None if worklist.study is None else worklist.folder
        is_kept_from_view = worklist.is_blind or bool(self._session.agreeing.refusal)
        current = predicting.current
        fit = CheckpointFit(
            predicting.unfitness(checkpoint),
            predicting.tool_differences(checkpoint),
            is_usable=not predicting.tool_unfitness(checkpoint),
            is_in_use=current is not None and current.sha256 == checkpoint.sha256,
            is_volume_open=self._session.volume is not None,
        )
        dialog = CheckpointDialog(
            checkpoint,
            self._window,
            fit=fit,
            study_folder=folder,
            has_commands=folder is None or not is_kept_from_view,
            is_new=is_new,
        )
        dialog.accepted.connect(lambda: predicting.load(checkpoint))
        self.show(dialog)

    def _on_session_look_requested(self, path: Path, reason: str) -> None:
        from annotator.dialogs.files.look_dialog import LookDialog  # late: few ask for it

        dialog = LookDialog(reason, self._window)

        def on_dialog_accepted() -> None:
            if dialog.choice == "look":
                self._session.open_path(path, looks_anyway=True)

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _on_identifying_identity_requested(self, path: Path, folder: Path, study: Study) -> None:
        from annotator.dialogs.study.identity_dialog import IdentityDialog  # late: few are strangers

        dialog = IdentityDialog(study, self._session.person, self._window)

        def on_dialog_accepted() -> None:
            if dialog.person is None:
                return
            if study.names(dialog.person):
                self._settings.annotator_name = dialog.person
            self._session.identify(path, folder, dialog.person)

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _on_session_takeover_requested(self, holder: LockHolder) -> None:
        from annotator.dialogs.files.takeover_dialog import TakeoverDialog  # late: few ask for it

        dialog = TakeoverDialog(holder, self._window)

        def on_dialog_accepted() -> None:
            if dialog.choice == "take_over":
                self._session.take_over(holder)

        dialog.accepted.connect(on_dialog_accepted)
        self.show(dialog)

    def _on_session_overwrite_requested(self, problem: str) -> None:
        if self._problems is not None:
            self._problems.append(problem)
            self._is_changed_on_disk = True
        elif not isinstance(self._shown, OverwriteDialog):
            self._ask_which_version(problem, lambda: None, _GO_ON)

    def _on_session_error_raised(self, error: UserError) -> None:
        if self._problems is not None and isinstance(error, SaveError):
            self._problems.append(str(error))
        elif isinstance(error, SaveError) and self._session.unsaved:
            self._tell_of_failure(str(error))
        else:
            self.show_error(error)
