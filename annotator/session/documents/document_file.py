"""The file of the open document: its path, what stands in it, and the journal of what does not yet."""

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from time import monotonic

from annotations.documents.annotation import Annotation, stamped
from annotations.documents.files import FileIdentity, save_annotation
from annotations.documents.provenance import NO_STAMPS, Stamps, Viewing
from annotations.documents.record import changed
from annotations.documents.recovery import RecoveryJournal
from annotations.documents.volume_link import relative_path

_LONGEST_PAUSE_S = 60.0


class DocumentFile:
    """Keeps one document on disk.

    Parameters
    ----------
    path : Path
        The annotation's file.
    volume_path : Path
        The volume's file; documents on disk name it relative to wherever they are kept.
    expected : str
        Identity of the annotation file's present content, "" where there is none yet.
    recovery_folder : Path
        Where the journal is kept.
    stamps : Stamps
        What the file says of the work on the document so far.
    owes_stamps : bool
        Whether the file itself does not say all of that yet.
    is_read_only : bool
        Whether no journal is begun: the document is only looked at, until it is saved as another one.
    clock : callable
        Seconds that never run backwards.

    Raises
    ------
    SaveError
        The journal cannot be begun: then edits would not be safe.
    """

    def __init__(
        self,
        path: Path,
        volume_path: Path,
        expected: FileIdentity,
        recovery_folder: Path,
        stamps: Stamps = NO_STAMPS,
        owes_stamps: bool = False,
        is_read_only: bool = False,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.path = path
        self._volume_path = volume_path
        self._expected = expected
        self._recovery_folder = recovery_folder
        self._journal = None if is_read_only else RecoveryJournal(recovery_folder, path, expected)
        self._clock = clock
        self._stamps = stamps
        self.owes_stamps = owes_stamps
        self._last_activity = clock()

    def note_activity(self) -> None:
        """Count the time since the last activity as work, unless it was so long that nobody was there."""
        moment = self._clock()
        pause = moment - self._last_activity
        if pause < _LONGEST_PAUSE_S:
            self._stamps = changed(self._stamps, active_seconds=self._stamps.active_seconds + pause)
        self._last_activity = moment

    def note_viewing(self, viewing: Viewing) -> None:
        """Write down, where undo does not reach, that the annotator was shown somebody else's work."""
        self._stamps = changed(self._stamps, viewings=(*self._stamps.viewings, viewing))
        self.owes_stamps = True

    def forget_viewing(self, viewing: Viewing) -> None:
        """Take back what was noted last: it could not be written, and so was not shown."""
        viewings = tuple(each for each in self._stamps.viewings if each is not viewing)
        self._stamps = changed(self._stamps, viewings=viewings)

    def note_reopening(self, moment: datetime) -> None:
        """Write down, likewise, that the document was changed after the others' work could be seen."""
        if self._stamps.reopened is None:
            self._stamps = changed(self._stamps, reopened=moment)
            self.owes_stamps = True

    def note_review(self, reviewer: str, moment: datetime) -> None:
        """Write down who changed a consensus last: its annotator, the study's, does not say so."""
        self._stamps = changed(self._stamps, reviewer=reviewer, reviewed=moment)

    @property
    def is_new(self) -> bool:
        """Whether nothing was in the file when it was read or written last, as there was none."""
        return self._expected == ""

    @property
    def stamps(self) -> Stamps:
        """What the file is to say of the work on the document."""
        return changed(self._stamps, active_seconds=round(self._stamps.active_seconds, 1))

    def record(self, document: Annotation) -> None:
        """Write a document into the journal at once; SaveError if that fails."""
        if self._journal is not None:
            self._journal.record(self._located(document, self.path))

    def sync(self) -> None:
        """Bring the journal to the disk itself; SaveError if that fails."""
        if self._journal is not None:
            self._journal.sync()

    def save(self, document: Annotation, *, overwrite: bool, path: Path | None = None) -> None:
        """Write the file, or another one that the document then belongs to, and forget the journal's edits.

        Another version that is overwritten is kept beside it: see `save_annotation`.

        Raises
        ------
        ChangedOnDisk
            Another program wrote the file meanwhile, and ``overwrite`` is false.
        SaveError
            It cannot be written; old file and journal are whole.
        """
        target = path or self.path
        # What stands in another file did not come from this document, whoever wrote it.
        expected = self._expected if target == self.path else ""
        _, self._expected = save_annotation(
            self._located(document, target),
            target,
            expected=expected,
            overwrite=overwrite or path is not None,
        )
        self.path = target
        self.owes_stamps = False
        if self._journal is not None:
            self._journal.restart(target, self._expected)
        else:
            self._journal = RecoveryJournal(self._recovery_folder, target, self._expected)

    def close(self, *, nothing_left: bool) -> None:
        """End with this document; the journal stays for the next start unless nothing is left to recover."""
        if self._journal is None:
            return
        if nothing_left:
            self._journal.remove()
        else:
            self._journal.leave()

    def _located(self, document: Annotation, path: Path) -> Annotation:
        volume = changed(document.volume, path=relative_path(self._volume_path, path))
        located = document if volume == document.volume else changed(document, volume=volume)
        return stamped(located, self.stamps)
