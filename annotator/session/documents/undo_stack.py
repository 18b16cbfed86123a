"""The undo stack: the edits of the open document, each of which can be taken back and made again."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from annotations.documents.annotation import Annotation
from annotations.documents.edit_log import EditLog, packed_edit


class UndoStack(QObject):
    """Knows which edits were made, how many of them are in the document, and which of them are in its file.

    Qt's own stack keeps an object for each edit, whose memory is not given back when the volume is closed.

    Parameters
    ----------
    present : callable
        Returns the open document, or None.
    show : callable
        Puts another one in its place. As long as it has not returned, all properties are those before the
        change; whatever error it ends with, after it they are those of the document that is there now.

    Signals
    -------
    index_changed
        ``index`` changed, and with it what can be undone. Whoever calls `clear` tells of it by itself.
    clean_changed
        ``is_clean`` changed.
    """

    index_changed = Signal()
    clean_changed = Signal()

    def __init__(
        self,
        present: Callable[[], Annotation | None],
        show: Callable[[Annotation], None],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._present = present
        self._show = show
        self._edits = EditLog()
        self._index = 0
        self._clean_index: int | None = 0

    @property
    def count(self) -> int:
        """How many edits there are, those that can be made again with them."""
        return len(self._edits)

    @property
    def index(self) -> int:
        """How many of the edits are in the document."""
        return self._index

    @property
    def can_undo(self) -> bool:
        return self._index > 0

    @property
    def can_redo(self) -> bool:
        return self._index < self.count

    @property
    def undo_text(self) -> str:
        """What `undo` would take back, as in "Undo place k0"; empty where there is nothing."""
        return self._edits.text(self._index - 1) if self.can_undo else ""

    @property
    def redo_text(self) -> str:
        """What `redo` would make again; empty where there is nothing."""
        return self._edits.text(self._index) if self.can_redo else ""

    @property
    def is_clean(self) -> bool:
        """Whether the document's edits are the ones that are in its file."""
        return self._index == self._clean_index

    def set_clean(self) -> None:
        """Note that the file has the document as it is now."""
        self._be_at(self._index, self._index)

    def push(self, text: str, before: Annotation, after: Annotation) -> None:
        """Make an edit of the document; what could have been made again is forgotten."""
        edit = packed_edit(text, before, after)
        try:
            self._show(after)
        finally:
            is_clean_forgotten = self._clean_index is not None and self._clean_index > self._index
            self._edits.cut(self._index)
            self._edits.append(edit)
            self._be_at(self._index + 1, None if is_clean_forgotten else self._clean_index)

    def undo(self) -> None:
        """Take the last edit back, if there is one."""
        document = self._present()
        if document is not None and self.can_undo:
            index = self._index - 1
            self._go_to(index, self._edits.undone(index, document))

    def redo(self) -> None:
        """Make the edit again that was taken back last, if there is one."""
        document = self._present()
        if document is not None and self.can_redo:
            self._go_to(self._index + 1, self._edits.redone(self._index, document))

    def clear(self) -> None:
        """Forget all edits, as another document is open or none; what is open is in its file."""
        self._edits.cut(0)
        self._be_at(0, 0)

    def _go_to(self, index: int, document: Annotation) -> None:
        try:
            self._show(document)
        finally:
            self._be_at(index, self._clean_index)

    def _be_at(self, index: int, clean_index: int | None) -> None:
        before, was_clean = self._index, self.is_clean
        self._index, self._clean_index = index, clean_index
        if index != before:
            self.index_changed.emit()
        if self.is_clean != was_clean:
            self.clean_changed.emit()
