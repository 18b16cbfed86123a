"""Autosave: each edit in the journal before the next event, on the disk within a second, in the file soon."""

from PySide6.QtCore import QObject, QTimer, Signal

from annotations.documents.annotation import Annotation
from annotations.durable_files import SaveError
from annotator.session.documents.document_file import DocumentFile

SYNC_MS = 500
_RETRY_MS = 5000


class Autosave(QObject):
    """Watches the edits of the open document.

    Signals
    -------
    save_requested
        The document should be written to its file now: some time has passed since the first unsaved edit.
    failed : SaveError
        The journal could not be written: the last edit is in memory only.

    Parameters
    ----------
    save_after_s : float
        Seconds from the first unsaved edit to ``save_requested``; 0 leaves saving to the person.
    """

    save_requested = Signal()
    failed = Signal(object)

    def __init__(self, save_after_s: float, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._file: DocumentFile | None = None
        self._sync_timer = QTimer(self, singleShot=True, interval=SYNC_MS)
        self._sync_timer.timeout.connect(self._on_sync_timer_timeout)
        self._save_timer = QTimer(self, singleShot=True)
        self._save_timer.timeout.connect(self.save_requested)
        self.set_save_after(save_after_s)

    def set_save_after(self, seconds: float) -> None:
        """Change how soon the file is written after an edit; 0 leaves saving to the person."""
        self._save_after_ms = round(1000 * seconds)
        if not self._save_after_ms:
            self._save_timer.stop()

    def watch(self, file: DocumentFile | None) -> None:
        """Watch another document's file, or none."""
        self._sync_timer.stop()
        self._save_timer.stop()
        self._file = file

    def record(self, document: Annotation) -> None:
        """Take in an edit: on return it survives the death of this program."""
        if self._file is None:
            return
        try:
            self._file.record(document)
        except SaveError as error:
            self.failed.emit(error)
        if not self._sync_timer.isActive():
            self._sync_timer.start()
        if self._save_after_ms and not self._save_timer.isActive():
            self._save_timer.start(self._save_after_ms)

    def try_again(self) -> None:
        """Ask once more later: the file could not be written now."""
        if self._save_after_ms and self._file is not None:
            self._save_timer.start(max(self._save_after_ms, _RETRY_MS))

    def _on_sync_timer_timeout(self) -> None:
        if self._file is None:
            return
        try:
            self._file.sync()
        except SaveError as error:
            self.failed.emit(error)
