"""The session's recovering: what a dead program left behind is found, named, given back or thrown away."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from annotations.documents.annotation import Annotation
from annotations.documents.recovery import Recovery, discard, find_recoveries
from annotations.durable_files import SaveError
from annotator.session.files.locking import SessionLocking
from annotator.session.volumes.study_paths import (
    IdentityNeeded,
    KeptFromView,
    RulesUnknown,
    neutral_label,
    without_kept,
)
from annotator.session.volumes.worklist import Worklist, moved_with, worklist_with

_VOLUME = "The volume of the unsaved edits"
_BY_REVIEWERS = "The edits are kept, and one of the study's reviewers can recover them"
_AFTER_IDENTIFYING = "The edits are kept: open the study, say who you are, and recover them then"
_AFTER_MENDING = "The edits are kept: mend the study, and recover them then"


class SessionRecovering(SessionLocking):
    """Offers recoveries, and brings the one that is opened into its document as one edit."""

    def offer_recoveries(self) -> None:
        """Look, in the background, for what a dead program left behind, and ask about it."""
        folder = self._options.recovery_folder
        self.jobs.start(
            "Looking for unsaved work",
            lambda _progress, _cancelled: find_recoveries(folder),
            done=self._on_recoveries_found,
            failed=self._raise_error,
            shown=False,
        )

    def recovery_names(self, recoveries: Iterable[Recovery]) -> Mapping[Path, str]:
        """Return neutral names of those recoveries that are, or may be, of blind work, by their journals."""
        names = {
            recovery.journal_path: neutral_label(
                moved_with(recovery.annotation_path, self._worklist), recovery.document.annotator
            )
            for recovery in recoveries
        }
        return {path: name for path, name in names.items() if name}

    def discard_recovery(self, recovery: Recovery) -> None:
        """Delete what a dead program left behind."""
        discard(recovery.journal_path)

    def _go_on_from(self, recovery: Recovery) -> None:
        if not self._edit("Recover unsaved edits", lambda _document: recovery.document):
            # It cannot be changed here now; the old journal is offered again.
            return
        try:
            if self._file is not None:
                self._file.record(recovery.document)
            discard(recovery.journal_path)
        except SaveError as error:
            # The old journal stays where the new one could not take over.
            self.report(error)
        came = "1 edit came" if recovery.edits == 1 else f"{recovery.edits} edits came"
        self.post_message(f"{came} back as one step: Undo takes all of it away, Redo brings it back")

    def _on_recoveries_found(self, recoveries: tuple[Recovery, ...]) -> None:
        if recoveries:
            self.recovery_requested.emit(recoveries)


def tells_more(recovered: Annotation, saved: Annotation) -> bool:
    """Return whether a recovered document says more of what its annotator could see than its file does."""
    return (recovered.viewings, recovered.reopened) != (saved.viewings, saved.reopened)


def worklist_of_recovery(
    recovery: Recovery,
    path: Path,
    present: Worklist,
    person: str,
    is_settled: Callable[[Path, str], bool],
) -> Worklist:
    """Return the list that a recovery's document belongs to, with that as the one to open.

    Parameters
    ----------
    path : Path
        Where its annotation is kept by now.
    present : Worklist
        See `worklist_with`.
    person : str
        Who recovers it.
    is_settled : callable
        See `without_kept`.

    Raises
    ------
    KeptFromView
        Its volume leads to what the person is not to see by name; it says what becomes of the edits.
    UserError
        Its study or folder is not there any more.
    """
    worklist, index = worklist_with(recovery.document, path, present)
    try:
        return without_kept(worklist, person, is_settled, index)
    except (KeptFromView, IdentityNeeded) as error:
        raise KeptFromView(error.problem, where=error.where or _VOLUME, remedy=_remedy(error)) from error


def _remedy(refusal: KeptFromView | IdentityNeeded) -> str:
    if isinstance(refusal, IdentityNeeded):
        return _AFTER_IDENTIFYING
    return _AFTER_MENDING if isinstance(refusal, RulesUnknown) else _BY_REVIEWERS
