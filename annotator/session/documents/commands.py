"""The undo command: what an edit made of the document, kept whole."""

from collections.abc import Callable

from PySide6.QtGui import QUndoCommand

from annotations.documents.annotation import Annotation


class EditCommand(QUndoCommand):
    """Holds the document before and after one edit; both are frozen, so undoing is exact.

    Parameters
    ----------
    text : str
        Names the edit in the menu, as in "Undo place k0".
    show : callable
        The session's way to make a document the present one.
    """

    def __init__(
        self, text: str, before: Annotation, after: Annotation, show: Callable[[Annotation], None]
    ) -> None:
        super().__init__(text)
        self._before = before
        self._after = after
        self._show = show

    def redo(self) -> None:
        """Make the document after the edit the present one."""
        self._show(self._after)

    def undo(self) -> None:
        """Make the document before the edit the present one."""
        self._show(self._before)
