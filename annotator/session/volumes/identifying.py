"""Who works here: a person whom a study does not name is asked, before a misspelt name opens it."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from annotations.documents.study import CONSENSUS
from annotator.session.volumes.worklist import Worklist

_STRANGER = "{} is not among this study's annotators; annotations are kept apart, under that name"
_REVIEWER = "You review this study: see Agreement and Consensus in the menu View"


class Identifying(QObject):
    """Remembers, for as long as the program runs, who has said that they are the person named.

    Attributes
    ----------
    is_asked : bool
        Whether somebody answers ``identity_requested``; else the person named goes on.

    Signals
    -------
    identity_requested : Path, Path, Study
        The study in the second path, a folder, to which the first one leads, does not name the person: answer
        with `Session.identify` or not at all.
    """

    identity_requested = Signal(object, object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.is_asked = False
        self._confirmed: set[tuple[Path, str]] = set()
        self._told: set[tuple[Path, str]] = set()

    def confirm(self, folder: Path, person: str) -> None:
        """Take down that a person is who they are named, in a study's folder."""
        self._confirmed.add((folder.resolve(), person))

    def is_settled(self, folder: Path, person: str) -> bool:
        """Say whether a person need not be asked who they are in a study's folder."""
        return not self.is_asked or (folder.resolve(), person) in self._confirmed

    def words_for(self, worklist: Worklist) -> str:
        """Return what a person who does not annotate in a study is told, once; else an empty text."""
        study, name = worklist.study, worklist.annotator
        is_told = study is None or not study.annotators or name in (*study.annotators, CONSENSUS)
        if is_told or (worklist.folder, name) in self._told:
            return ""
        self._told.add((worklist.folder, name))
        return _REVIEWER if worklist.is_review else _STRANGER.format(name)


def likely_name(said: str, names: Sequence[str]) -> str | None:
    """Return which of the names is the one said but for its capitals and spaces; None if none is."""
    folded = _folded(said)
    return next((name for name in names if _folded(name) == folded), None)


def _folded(name: str) -> str:
    return "".join(name.split()).casefold()
