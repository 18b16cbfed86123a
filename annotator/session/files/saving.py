"""The session's saving: when a person asks, when they leave, and a while after each edit."""

import contextlib
from pathlib import Path

from PySide6.QtCore import QObject

from annotations.documents import edits
from annotations.documents.annotation import Annotation
from annotations.documents.edits import EditRefused
from annotations.documents.files import ChangedOnDisk
from annotations.documents.provenance import Viewing
from annotations.documents.record import Status, changed, now
from annotations.documents.study import CONSENSUS
from annotations.durable_files import SaveError
from annotator.session.editing.posing import SessionPosing
from annotator.session.editing.seeing import Seeing
from annotator.session.options import SessionOptions

_NOTHING_PLACED = "Nothing is placed. Flag the volume to say why, and it can be done"
_REOPENED = "It was done, and the others' work could be seen: from now on it is marked as reopened"


class SessionSaving(SessionPosing):
    """Brings the document into its file; failures come as signals, and the journal keeps the edits."""

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._autosave_failed = False
        self._autosave.save_requested.connect(self._on_autosave_save_requested)
        self.seeing = Seeing(self, self._write_viewing, self)

    def set_autosave(self, seconds: float) -> None:
        """Change how soon an edit is written to the annotation's file; 0 leaves saving to the person."""
        self._autosave.set_save_after(seconds)

    def save(self, *, overwrite: bool = False) -> bool:
        """Write the document's file; False if that failed, and then a signal has said why."""
        return self._save(overwrite=overwrite, path=None)

    def save_as(self, path: Path) -> bool:
        """Write the document to another file, which is its own from then on; False as for `save`."""
        return self._save(overwrite=True, path=path)

    def set_status(self, status: Status) -> None:
        """Mark the document as done, which saves it, or as in progress."""
        words = status.replace("_", " ")
        self.settle_typing()
        if status == "done" and self._is_empty_without_reason():
            self._refuse(EditRefused(_NOTHING_PLACED))
            return
        # Before the edit, after which they have to be looked for anew.
        mistakes = self.mistakes if self.has_looked_for_mistakes else ()
        if not self._edit(f"Mark as {words}", lambda document: edits.set_status(document, status)):
            return
        if self.save() and status == "done" and self._document is not None:
            missing = [part.name for part in self._document.parts if part.anchor_um is None]
            doubts = []
            unjudged = [part.name for part in self._document.parts if part.source == "predicted"]
            if unjudged:
                doubts.append(f"nobody has accepted or corrected {', '.join(unjudged)} since the prediction")
            if missing:
                doubts.append(f"{', '.join(missing)} {'has' if len(missing) == 1 else 'have'} no position")
            if mistakes:
                doubts.append(f"the check says: {' '.join(mistake.text for mistake in mistakes)}")
            though = f", though {', and '.join(doubts)}" if doubts else ""
            self.post_message(f"Done and saved{though}")

    def _is_empty_without_reason(self) -> bool:
        document = self._document
        if document is None or self._read_only_reason or document.flag is not None:
            return False
        return all(part.anchor_um is None for part in document.parts)

    def _show_document(self, document: Annotation) -> None:
        before = self._document
        reopens = before is not None and self._reopens(before, document)
        if before is not None and reopens:
            self._note_reopening(before)
        super()._show_document(document)
        if reopens:
            self.post_message(_REOPENED)

    def _reopens(self, before: Annotation, after: Annotation) -> bool:
        """Whether a change is one of finished work whose author could see the others': whoever makes it."""
        if before.status != "done" or self._file is None or self._file.stamps.reopened is not None:
            return False
        # To ask for somebody's attention is no change of what was found.
        return changed(before, flag=after.flag) != after and self.seeing.exposure().could_see

    def _note_reopening(self, before: Annotation) -> None:
        if self._file is None:
            return
        self._file.note_reopening(now())
        if self.undo_stack.is_clean:
            # With the document that it holds: the change itself may be undone, and never be saved.
            with contextlib.suppress(SaveError):
                self._file.save(before, overwrite=False)

    def _write_viewing(self, viewing: Viewing) -> bool:
        if self._file is None:
            return False
        owed = self._file.owes_stamps
        self._file.note_viewing(viewing)
        if self.save():
            return True
        # Else the next wish to look would find it noted already, and nothing in the file.
        self._file.forget_viewing(viewing)
        self._file.owes_stamps = owed
        return False

    def _is_saved(self) -> bool:
        self.settle_typing()
        return not self.unsaved or self.is_mere_proposal or self.save()

    def _save(self, *, overwrite: bool, path: Path | None) -> bool:
        self.settle_typing()
        try:
            self._write(overwrite=overwrite, path=path)
        except ChangedOnDisk as error:
            self._ask_to_overwrite(error)
            return False
        except SaveError as error:
            self.report(error)
            return False
        return True

    def _write(self, *, overwrite: bool, path: Path | None) -> None:
        if self._document is None or self._file is None:
            return
        if self._document.annotator == CONSENSUS and not self.undo_stack.is_clean:
            self._file.note_review(self.person, now())
        self._file.save(self._document, overwrite=overwrite, path=path)
        self._autosave_failed = False
        self._autosave.watch(self._file)
        self.undo_stack.set_clean()
        self._refresh_item()
        self.save_state_changed.emit()

    def _close_file(self, *, nothing_left: bool) -> None:
        if self._file is not None:
            try:
                self._file.close(nothing_left=nothing_left)
            except SaveError as error:
                # A journal that cannot be deleted is offered again; it must not keep the document open.
                self.report(error)

    def _ask_to_overwrite(self, error: ChangedOnDisk) -> None:
        self.overwrite_requested.emit(self.neutral(str(error)))

    def _on_autosave_save_requested(self) -> None:
        if not self.unsaved or self.is_mere_proposal or self._read_only_reason:
            return
        try:
            # Without what is being typed: a person may pause in the middle of a number.
            self._write(overwrite=False, path=None)
        except ChangedOnDisk as error:
            self._ask_to_overwrite(error)
        except SaveError as error:
            # A dialog once; a full disk would bring it again and again.
            if self._autosave_failed:
                self.post_message(str(error))
            else:
                self.report(error)
            self._autosave_failed = True
            self._autosave.try_again()
