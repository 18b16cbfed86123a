"""The session's locking: one window at a time changes a document, and each person only their own."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from annotations.documents.annotation import Annotation
from annotations.documents.files import file_identity
from annotations.documents.locks import DocumentLocked, LockHolder
from annotations.documents.study import CONSENSUS, load_study, study_folder_of
from annotations.durable_files import SaveError
from annotations.errors import UserError
from annotator.session.files.lock_keeper import LockKeeper
from annotator.session.files.saving import SessionSaving
from annotator.session.files.spare_locks import FolderReadOnly
from annotator.session.options import SessionOptions
from annotator.session.volumes.opening import Opened

_OPEN_ELSEWHERE = "It is open elsewhere: {}. Once it is closed there, you can go on here"
_NOT_WRITABLE = "This folder cannot be written"
_FREE = "It is free now: you can go on"
_LOOK_AGAIN_S = 10.0
_BEHIND = "Its file has just been changed, and is read again"
_MOVED = "the study or folder is not there any more: it was moved, or its disk is away"
_HOW_TO_FIND = (
    "Bring it back, or open it where it is now and recover your edits there (File ▸ Recover Unsaved Edits…)"
)
_HOW_TO_SAVE = "Save it under another name to keep your own version"
_HOW_TO_AGREE = "Agree with whoever has it on who goes on"


class SessionLocking(SessionSaving):
    """Keeps the open document locked, or read-only where somebody else may write it: `read_only_reason`."""

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._offered: LockHolder | None = None
        self._is_behind = False
        self._tried_again: Path | None = None
        self._is_kept_by_study = False
        self._waiting = QTimer(self, interval=round(1000 * _LOOK_AGAIN_S))
        self._waiting.timeout.connect(self._on_waiting_timeout)
        self._locks = LockKeeper(self)
        self._locks.lost.connect(self._on_locks_lost)

    def take_over(self, holder: LockHolder) -> None:
        """Answer ``takeover_requested`` with yes; ignored if another document is open by now."""
        if self._file is None or holder is not self._offered:
            return
        self._offered = None
        try:
            self._locks.take_over(self._file.path, self._options.annotator_name, holder)
        except UserError as error:
            self.report(error)
        else:
            # The other one may have saved since it was read here.
            self.reload()

    def try_again(self) -> None:
        """Try to change a document that is read-only; a message says what has become of it."""
        if not self._read_only_reason or self._file is None:
            return
        if not self.unsaved:
            self._tried_again = self._file.path
            self.reload()
            return
        # Somebody has taken it over: what was edited here until then is not given up.
        try:
            self._locks.hold(self._file.path, self._options.annotator_name)
        except (DocumentLocked, FolderReadOnly) as error:
            self._set_read_only(self._reason_now(error))
            self.post_message(f"Still read-only. {self._read_only_reason}.")
        else:
            self._set_read_only("")
            self.post_message(_FREE)

    @property
    def may_try_again(self) -> bool:
        """Whether the document is read-only for a reason that can come to an end."""
        return bool(self._read_only_reason) and not self._is_kept_by_study

    def reload(self) -> None:
        """Read the document from its file again."""
        raise NotImplementedError

    @property
    def is_opening(self) -> bool:
        """Whether a document is being opened or read again, or a question about that waits for its answer."""
        raise NotImplementedError

    def _claim_lock(self, opened: Opened) -> None:
        """Ask, in the thread that has read a document, for the lock that it will have when it is open."""
        path = opened.found.item.annotation_path
        if not self._reason_by_study(opened.document, path) and not _leaves_no_trace(opened):
            self._locks.claim(path, self._options.annotator_name)

    def _lock(self, opened: Opened) -> None:
        """Lock a document that is about to be the open one, or find out why it is read-only."""
        path, request = opened.found.item.annotation_path, opened.found.request
        self._offered, self._is_behind = None, False
        self._waiting.stop()
        self._read_only_reason = self._reason_by_study(opened.document, path)
        self._is_kept_by_study = bool(self._read_only_reason)
        if self._is_kept_by_study or _leaves_no_trace(opened):
            self._locks.leave()
            return
        try:
            self._locks.hold(path, self._options.annotator_name)
        except (DocumentLocked, FolderReadOnly) as error:
            self._read_only_reason = self._reason_now(error)
            if isinstance(error, DocumentLocked) and error.holder.is_stale:
                self._offered = error.holder
            return
        if request.recovery is None and file_identity(path) != opened.found.identity:
            # Whoever had the lock has saved once more since the file was read here.
            self._read_only_reason, self._is_behind = _BEHIND, True

    def _unlock(self) -> None:
        self._offered, self._is_behind = None, False
        self._read_only_reason, self._is_kept_by_study = "", False
        self._waiting.stop()
        self._locks.release()

    def _tell_of_lock(self) -> None:
        """Say that the document which has just been opened is read-only, or ask whether it must be."""
        if self._is_behind:
            self.reload()
            return
        # Another document may have been opened meanwhile.
        was_read_only = self._tried_again is not None and self._tried_again == self.annotation_path
        self._tried_again = None
        if self._read_only_reason:
            still = "Still read-only" if was_read_only else "Read-only"
            self.post_message(f"{still}. {self._read_only_reason}.")
        elif was_read_only:
            self.post_message(_FREE)
        if self._offered is not None:
            self.takeover_requested.emit(self._offered)

    def _write(self, *, overwrite: bool, path: Path | None) -> None:
        document, person = self._document, self._options.annotator_name
        if document is None or self._file is None:
            return
        if path is None or path == self._file.path:
            folder = self._worklist.folder
            if folder in self._file.path.parents and not self._worklist.is_there:
                # A folder made anew in its place would hold a file that nobody looks for there.
                raise SaveError(_MOVED, where=folder, remedy=_HOW_TO_FIND)
            self._locks.check()
            if not self._locks.is_holding and self._worklist.is_review and not self._read_only_reason:
                self._locks.hold(self._file.path, person)
            if self._read_only_reason:
                raise SaveError(self._read_only_reason, remedy=self._way_out())
            super()._write(overwrite=overwrite, path=path)
            return
        if reason := self._reason_by_study(document, path):
            raise SaveError(reason, where=path, remedy="Choose a place outside of the study")
        with self._locks.moving_to(path, person):
            super()._write(overwrite=overwrite, path=path)
        self._set_read_only("")

    def _reason_now(self, error: DocumentLocked | FolderReadOnly) -> str:
        """Return why a document cannot be changed now, and look out for the end of it."""
        if isinstance(error, FolderReadOnly):
            return _NOT_WRITABLE
        self._waiting.start()
        return _OPEN_ELSEWHERE.format(error.holder)

    def _set_read_only(self, reason: str) -> None:
        if reason == self._read_only_reason:
            return
        self._read_only_reason = reason
        if not reason:
            self._is_kept_by_study = False
            self._waiting.stop()
        self.drop_preview()
        self.save_state_changed.emit()
        # What can be changed is drawn with what there is.
        self.document_changed.emit(self._document, self._document)

    def _reason_by_study(self, document: Annotation, path: Path) -> str:
        """Return why a person must not write a document at a path: in a study each writes their own."""
        author, person = document.annotator, self._options.annotator_name
        folder = study_folder_of(path)
        if folder is None or author == person:
            return ""
        if author != CONSENSUS:
            return f"This is the annotation of {author}, and {person} works here"
        try:
            settles = load_study(folder).is_reviewer(person)
        except UserError as error:
            return f"Who settles the study's consensus could not be read: {error}".removesuffix(".")
        return "" if settles else "The study's consensus is settled by its reviewers"

    def _on_waiting_timeout(self) -> None:
        if self._file is not None and self._read_only_reason and not self.unsaved:
            self._locks.look_whether_free(self._file.path, self._on_locks_found_free)

    def _on_locks_found_free(self) -> None:
        # Not in place of a volume that a person has asked for, nor anew before it has been read once.
        if self._waiting.isActive() and not self.unsaved and not self.is_opening:
            self.try_again()

    def _on_locks_lost(self, error: DocumentLocked) -> None:
        taken = f"It has been taken over meanwhile by {error.holder}"
        self._set_read_only(taken)
        self._waiting.start()
        kept = "; your unsaved edits are kept in the recovery file" if self.unsaved else ""
        self.report(UserError(f"{taken}{kept}", remedy=self._way_out()))

    def _way_out(self) -> str:
        # In blind work a document stays in its place.
        return _HOW_TO_AGREE if self.is_blind else _HOW_TO_SAVE


def _leaves_no_trace(opened: Opened) -> bool:
    """Say whether somebody reviews where nothing is placed: the lock is taken by the first save."""
    return opened.found.request.worklist.is_review and not opened.found.item.annotation_path.exists()
