"""Whether the others' work on the open volume may be shown now, and the record of what was shown."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.exposure import Exposure, exposure
from annotations.documents.permission import (
    FREE,
    Permission,
    keeps_passes_apart,
    permission,
    while_at_work,
)
from annotations.documents.provenance import Stamps, Viewing
from annotations.documents.record import changed, now
from annotations.documents.study import CONSENSUS, Study, study_folder_of
from annotator.session.state import SessionState
from annotator.session.volumes.worklist import Worklist

Shown = Literal["annotations", "predictions"]

_OPEN_STUDY = "This annotation belongs to a study: open the study to see the others' work"


class Seeing(QObject):
    """Answers for the open volume, from the files of the study; outside of one nothing is kept from anybody.

    What is shown, and a change of what was done, are written into the document's file where undo does not
    reach: see `annotations.documents.provenance.Stamps`.

    Parameters
    ----------
    write_viewing : callable
        Writes a viewing into the open document's file; False where that failed.

    Signals
    -------
    permission_changed
        ``permission`` or ``work_refusal`` may be another one: another volume is open, or the person's own
        work on it has been saved as done, or is in progress again.
    """

    permission_changed = Signal()

    def __init__(
        self, session: SessionState, write_viewing: Callable[[Viewing], bool], parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._write_viewing = write_viewing
        self._permission: Permission | None = None
        self._looks_anyway = False
        self._apart: tuple[tuple[Study, Path, str], bool] | None = None
        session.volume_changed.connect(self._on_session_volume_changed)
        session.save_state_changed.connect(self._on_session_save_state_changed)
        session.document_changed.connect(self._on_session_document_changed)

    @property
    def permission(self) -> Permission:
        """What may be shown for the open volume now, and why not."""
        return FREE if self._looks_anyway else self._by_rules

    @property
    def refusal(self) -> str:
        """Why others' work may not be shown now, as a sentence without its full stop; empty where it may.

        An annotation of a study that was opened alone has rules that are known only where the study is open.
        """
        return self._alone_refusal or self.permission.reason

    @property
    def work_refusal(self) -> str:
        """Why the own work must not be shaped by the others' now, likewise, whoever looks anyway.

        Empty where nobody works blind, and once the work is done if annotators see the others at all.
        """
        return self._alone_refusal or self._by_rules.reason

    @property
    def keeps_passes_apart(self) -> bool:
        """Whether nothing is to tell now which of the person's passes are over one volume."""
        worklist = self._session.worklist
        if worklist.study is None or not worklist.is_blind:
            return False
        asked = (worklist.study, worklist.folder, worklist.annotator)
        if self._apart is None or self._apart[0] != asked:
            self._apart = (asked, keeps_passes_apart(*asked))
        return self._apart[1]

    def may_see_others(self) -> bool:
        """Whether the others' work on the open volume may be shown now."""
        return self.permission.may_see

    def look_anyway(self) -> bool:
        """Let the others' work be shown for as long as the volume is open, where the study allows it.

        That is written into the document's file first; False where it is not allowed or not written.
        """
        if self.permission.may_see:
            return True
        if not self.permission.may_look or not self._note("annotations"):
            return False
        self._looks_anyway = True
        self.permission_changed.emit()
        return True

    def note_shown(self, shown: Shown) -> bool:
        """Write into the document's file that somebody else's work is shown; call it before showing it.

        False, and a signal has said why, where that could not be written, or may not be shown at all: then
        it is not to be shown. Of each kind the first time counts, and the first one before the work was done.
        """
        return self.permission.may_see and self._note(shown)

    def exposure(self) -> Exposure:
        """Return what the annotator may know of the others' work on the open volume."""
        worklist, volume_id = self._session.worklist, self._volume_id()
        if worklist.study is None or volume_id is None or not _is_annotators(worklist):
            return Exposure(could_see=False, viewings=())
        return exposure(worklist.study, worklist.folder, worklist.annotator, volume_id)

    def carried_over(self, document: Annotation) -> Stamps:
        """Return the stamps of a document that is being opened, with what its annotator knows already.

        What was shown while another document of the volume was open, by another method or in another pass,
        has been seen before this one is done.
        """
        if document.status == "done" or document.reopened is not None:
            return document.stamps
        noted = {(viewing.shown, viewing.status) for viewing in document.viewings}
        known: dict[tuple[str, str], Viewing] = {}
        for viewing in self.exposure().viewings:
            if (viewing.shown, "in_progress") not in noted:
                known.setdefault((viewing.shown, "in_progress"), changed(viewing, status="in_progress"))
        return changed(document.stamps, viewings=(*document.viewings, *known.values()))

    def _note(self, shown: Shown) -> bool:
        document = self._session.document
        if document is None or not _is_annotators(self._session.worklist):
            return True
        noted = {(viewing.shown, viewing.status) for viewing in self._session.viewings}
        if {(shown, document.status), (shown, "in_progress")} & noted:
            return True
        return self._write_viewing(Viewing(moment=now(), shown=shown, status=document.status))

    @property
    def _alone_refusal(self) -> str:
        """Why nothing is known of an annotation's rules; empty where its study is open, or it has none."""
        path = self._session.annotation_path
        is_alone = self._session.worklist.study is None and path is not None
        return _OPEN_STUDY if is_alone and path is not None and study_folder_of(path) is not None else ""

    @property
    def _by_rules(self) -> Permission:
        if self._permission is None:
            self._permission = self._read_permission()
        return self._permission

    def _read_permission(self) -> Permission:
        worklist, volume_id = self._session.worklist, self._volume_id()
        if worklist.study is None or volume_id is None:
            return FREE
        document = self._session.document
        if document is not None and document.status != "done" and _is_annotators(worklist):
            # Its file may still say done, as long as an undo is not saved.
            return while_at_work(worklist.study, worklist.annotator)
        # Of whoever works here: the consensus is nobody's own.
        person = self._session.person if worklist.annotator == CONSENSUS else worklist.annotator
        return permission(worklist.study, worklist.folder, person, volume_id)

    def _volume_id(self) -> str | None:
        index = self._session.current_index
        return None if index is None else self._session.items[index].volume_id

    def _forget(self) -> None:
        before, self._permission, self._apart = self._permission, None, None
        # Whoever looks anyway may all the while; what their own work may be shaped by changes with the rules.
        if before is not None and before != self._by_rules:
            self.permission_changed.emit()

    def _on_session_volume_changed(self) -> None:
        self._looks_anyway, self._permission = False, None
        self.permission_changed.emit()

    def _on_session_save_state_changed(self) -> None:
        if not self._session.unsaved:
            self._forget()

    def _on_session_document_changed(self, before: object, after: object) -> None:
        if getattr(before, "status", None) != getattr(after, "status", None):
            self._forget()


def _is_annotators(worklist: Worklist) -> bool:
    """Whether the documents are those of one of the study's annotators, in whose work blindness matters."""
    return worklist.study is not None and worklist.annotator in worklist.study.annotators
