"""What each edit of a document changed, in order, as bytes: thousands of edits are kept to be undone."""

import pickle
from array import array

from annotations.documents.annotation import Annotation
from annotations.documents.record import Difference, amended, differences


def packed_edit(text: str, before: Annotation, after: Annotation) -> bytes:
    """Return an edit for an `EditLog`: what it is called, and what differs before and after it."""
    return pickle.dumps((text, differences(before, after)))


class EditLog:
    """Keeps what each edit changed, as it was and as it is, and gives back exactly that.

    All of it lies in one block of memory. As objects, thousands of edits would lie between others that stay,
    and the memory around those is not given back when the edits are forgotten.
    """

    def __init__(self) -> None:
        self._block = bytearray()
        self._ends = array("Q")

    def __len__(self) -> int:
        return len(self._ends)

    def append(self, edit: bytes) -> None:
        """Write an edit down, which `packed_edit` has made ready."""
        self._block += edit
        self._ends.append(len(self._block))

    def cut(self, length: int) -> None:
        """Forget all edits but the first ``length``."""
        if length == 0:
            # What was only emptied would keep its memory.
            self._block, self._ends = bytearray(), array("Q")
        elif length < len(self):
            del self._block[self._ends[length - 1] :]
            del self._ends[length:]

    def text(self, index: int) -> str:
        """Return what an edit is called; IndexError if there are not so many."""
        return self._read(index)[0]

    def undone(self, index: int, document: Annotation) -> Annotation:
        """Return the document after an edit as it was before it; IndexError if there are not so many."""
        return amended(document, self._read(index)[1], backwards=True)

    def redone(self, index: int, document: Annotation) -> Annotation:
        """Return the document before an edit as it was after it; IndexError if there are not so many."""
        return amended(document, self._read(index)[1], backwards=False)

    def _read(self, index: int) -> tuple[str, tuple[Difference, ...]]:
        if not 0 <= index < len(self):
            raise IndexError(f"there are {len(self)} edits, none of the index {index}")
        begin = self._ends[index - 1] if index else 0
        text, found = pickle.loads(self._block[begin : self._ends[index]])
        return text, found
