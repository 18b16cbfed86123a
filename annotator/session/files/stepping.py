"""The session's stepping: from one volume of the list to the next, past those that could not be opened."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject

from annotator.session.files.recovering import SessionRecovering
from annotator.session.options import SessionOptions
from annotator.session.remembered import Remembered
from annotator.session.volumes.opening import OpeningRequest
from annotator.session.volumes.worklist import WorkItem, Worklist


class SessionStepping(SessionRecovering):
    """Goes through the list, and remembers for as long as the program runs what could not be opened."""

    def __init__(self, options: SessionOptions, parent: QObject | None = None) -> None:
        super().__init__(options, parent)
        self._unopened: frozenset[tuple[Path, str | None]] = frozenset()
        self._skipped: tuple[str, ...] = ()
        self._next_to_do: Remembered[int | None] = Remembered()

    def open_item(self, index: int, *, skipped: Sequence[str] = ()) -> None:
        """Save what is open and open another item, and say then what was skipped on the way there."""
        raise NotImplementedError

    def next_volume(self) -> None:
        """Open the next item."""
        self._step(1)

    def previous_volume(self) -> None:
        """Open the previous item."""
        self._step(-1)

    def next_to_do(self) -> int | None:
        """Return the place of the next item that is not done, counted from the open one; None if all are.

        Those that could not be opened are passed over; see `skipped_to_do`.
        """
        _, here = self._destination()
        return self._next_to_do.result(_next_to_do, self._worklist, here, self._unopened)

    def skipped_to_do(self) -> tuple[str, ...]:
        """Return the names of what `next_to_do` passes over, in the order of the list."""
        _, here = self._destination()
        following = self.next_to_do()
        passed = []
        for at in self._worklist.to_do(here):
            if at == following:
                break
            passed.append(self.items[at].label)
        return tuple(passed)

    def _step(self, by: int) -> None:
        _, here = self._destination()
        index = (here if here is not None else -by) + by
        if 0 <= index < len(self.items):
            self.open_item(index)
        else:
            self.post_message("There is no next volume" if by > 0 else "There is no previous volume")

    def _destination(self) -> tuple[Worklist, int | None]:
        """Return the list and the place that are being opened, or are open."""
        raise NotImplementedError

    def _note_unopened(self, request: OpeningRequest) -> None:
        # By the volume: another pass over it, or by the other method, fails alike.
        self._unopened |= {_volume_of(request.item)}

    def _note_opened(self, request: OpeningRequest) -> None:
        if _volume_of(request.item) in self._unopened:
            self._unopened -= {_volume_of(request.item)}


def skipped_words(labels: Sequence[str]) -> str:
    """Say which volumes were passed over."""
    return f"{', '.join(labels)} could not be opened: skipped; tell the study's lead" if labels else ""


def _next_to_do(
    worklist: Worklist, here: int | None, unopened: frozenset[tuple[Path, str | None]]
) -> int | None:
    to_do = worklist.to_do(here)
    return next((at for at in to_do if _volume_of(worklist.items[at]) not in unopened), None)


def _volume_of(item: WorkItem) -> tuple[Path, str | None]:
    return item.volume_path, item.dataset
