"""Which passes over a blind study's volumes a checkpoint has been asked about."""

from collections.abc import Sequence
from pathlib import Path

from annotator.session.editing.seeing import Seeing
from annotator.session.volumes.worklist import WorkItem


class Passes:
    """Says of which items it may be told that there is a prediction.

    A prediction's file is of a volume. Where volumes come again, and nobody is to know which, it is there for
    the second pass as soon as it is for the first: so it counts for those alone that were asked about, for as
    long as the program runs.
    """

    def __init__(self, seeing: Seeing) -> None:
        self._seeing = seeing
        self._asked: set[tuple[str, Path]] = set()

    def note_asked(self, sha256: str, item: WorkItem) -> None:
        """Note that a checkpoint has been asked about an item, and has answered."""
        self._asked.add((sha256, item.annotation_path))

    def counts(self, sha256: str, item: WorkItem) -> bool:
        """Say whether what a checkpoint has said of an item's volume counts for the item."""
        return bool(self.counting(sha256, (item,)))

    def counting(self, sha256: str, items: Sequence[WorkItem]) -> Sequence[WorkItem]:
        """Return those of some items for which what a checkpoint has said of their volumes counts."""
        if not self._seeing.keeps_passes_apart:
            return items
        return tuple(item for item in items if (sha256, item.annotation_path) in self._asked)
