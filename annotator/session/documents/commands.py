"""The undo command: what an edit made of the document's fields."""

from collections.abc import Callable, Mapping

from PySide6.QtGui import QUndoCommand

from annotations.documents.annotation import Annotation
from annotations.documents.record import differences


class EditCommand(QUndoCommand):
    """Holds the fields that an edit changed, as they were and as they are; frozen, so undoing is exact.

    Not the documents: thousands of edits are kept, and most of a document's fields no edit changes.

    Parameters
    ----------
    text : str
        Names the edit in the menu, as in "Undo place k0".
    amend : callable
        The session's way to give fields of the present document other values.
    """

    def __init__(
        self,
        text: str,
        before: Annotation,
        after: Annotation,
        amend: Callable[[Mapping[str, object]], None],
    ) -> None:
        super().__init__(text)
        self._differences = differences(before, after)
        self._amend = amend

    def redo(self) -> None:
        """Make the document after the edit the present one."""
        self._amend({name: after for name, (_, after) in self._differences.items()})

    def undo(self) -> None:
        """Make the document before the edit the present one."""
        self._amend({name: before for name, (before, _) in self._differences.items()})
