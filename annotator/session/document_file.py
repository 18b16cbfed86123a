"""The file of the open document: its path, what stands in it, and the journal of what does not yet."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic

from annotations.documents.annotation import Annotation, changed
from annotations.documents.files import FileIdentity, save_annotation
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
    active_seconds : float
        Time already spent on the document.
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
        active_seconds: float = 0.0,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.path = path
        self._volume_path = volume_path
        self._expected = expected
        self._journal = RecoveryJournal(recovery_folder, path, expected)
        self._clock = clock
        self._active_seconds = active_seconds
        self._last_activity = clock()

    def note_activity(self) -> None:
        """Count the time since the last activity as work, unless it was so long that nobody was there."""
        moment = self._clock()
        pause = moment - self._last_activity
        if pause < _LONGEST_PAUSE_S:
            self._active_seconds += pause
        self._last_activity = moment

    @property
    def active_seconds(self) -> float:
        """Time spent at work on the document, in seconds."""
        return self._active_seconds

    def record(self, document: Annotation) -> None:
        """Write a document into the journal at once; SaveError if that fails."""
        self._journal.record(self._located(document, self.path))

    def sync(self) -> None:
        """Bring the journal to the disk itself; SaveError if that fails."""
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
            active_seconds=round(self._active_seconds, 1),
        )
        self.path = target
        self._journal.restart(target, self._expected)

    def close(self, *, nothing_left: bool) -> None:
        """End with this document; the journal stays for the next start unless nothing is left to recover."""
        if nothing_left:
            self._journal.remove()
        else:
            self._journal.leave()

    def _located(self, document: Annotation, path: Path) -> Annotation:
        volume = changed(document.volume, path=relative_path(self._volume_path, path))
        return document if volume == document.volume else changed(document, volume=volume)
