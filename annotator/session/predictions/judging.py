"""The session's verdicts: who is wrong where a checkpoint and an annotation differ, as a reviewer says."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.documents.files import DocumentError
from annotations.documents.record import changed
from annotations.errors import UserError
from annotator.session.predictions.reviewing import Reviewing
from annotator.session.remembered import Remembered
from annotator.session.state import SessionState

if TYPE_CHECKING:
    from annotations.prediction.errors.error_table import ErrorsOfVolume
    from annotations.prediction.prediction import CheckpointReference
    from annotations.prediction.verdicts.verdicts import Verdict, VerdictList, VolumeVerdict

VERDICT_WORDS: "Mapping[Verdict, str]" = {
    "annotation_wrong": "annotation",
    "model_wrong": "model",
    "both_wrong": "both",
    "neither_wrong": "neither",
}
"""Who is wrong by each verdict, in a word."""

_CHANGED = "*"
_NO_ROW = "A verdict is about a volume of the list of errors: open one"


@dataclass(frozen=True)
class Judgement:
    """What reviewers say of a volume.

    Attributes
    ----------
    own : VolumeVerdict or None
        What the person at work here says.
    others : mapping of str to VolumeVerdict
        What others say, by their names.
    is_outdated : bool
        Whether the annotation has been changed since the own verdict.
    """

    own: "VolumeVerdict | None" = None
    others: "Mapping[str, VolumeVerdict]" = field(default_factory=dict)
    is_outdated: bool = False

    @property
    def words(self) -> str:
        """The own verdict in a word or two, or that of others in brackets."""
        if self.own is not None:
            return f"{VERDICT_WORDS[self.own.verdict]}{_CHANGED if self.is_outdated else ''}"
        others = sorted({VERDICT_WORDS[each.verdict] for each in self.others.values()})
        return f"({', '.join(others)})" if others else ""

    @property
    def lines(self) -> tuple[str, ...]:
        """What there is to say of it, a line for each reviewer."""
        said = {**({"you": self.own} if self.own is not None else {}), **self.others}
        lines = [
            f"Wrong, says {who}: {VERDICT_WORDS[each.verdict]}{f' – {each.note}' if each.note else ''}"
            for who, each in said.items()
        ]
        if self.is_outdated:
            lines.append("The annotation has been changed since your verdict")
        return tuple(lines)


_NOTHING_SAID = Judgement()


class Judging(QObject):
    """Records what the person says of the open volume, for the checkpoint in use, at once in their file.

    Signals
    -------
    changed
        A verdict was recorded or taken back, or others are known.
    """

    changed = Signal()

    def __init__(self, session: SessionState, reviewing: Reviewing, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._reviewing = reviewing
        self._lists: dict[str, tuple[VerdictList, ...]] = {}
        self._by_volume: Remembered[Mapping[str, Mapping[str, VolumeVerdict]]] = Remembered()
        reviewing.changed.connect(self._on_reviewing_changed)
        reviewing.computed.connect(self._on_reviewing_computed)

    @property
    def lists(self) -> "Mapping[str, tuple[VerdictList, ...]]":
        """Everybody's verdicts, by the SHA-256 of the checkpoint that they are about."""
        return self._lists

    @property
    def open_volume(self) -> str | None:
        """The open volume, if a verdict can be given on it."""
        volume = self._reviewing.open_volume
        return volume if self._reviewing.row_of(volume) is not None else None

    @property
    def open_judgement(self) -> Judgement:
        """What is said of the open volume."""
        volume = self.open_volume
        return _NOTHING_SAID if volume is None else self.judgement(volume)

    @property
    def checkpoint(self) -> "CheckpointReference | None":
        """The checkpoint in use, if its errors are there."""
        table = self._reviewing.table
        return None if table is None else table.checkpoint

    def judgement(self, volume: str) -> Judgement:
        """Return what is said of a volume, about the checkpoint in use."""
        checkpoint = self.checkpoint
        if checkpoint is None:
            return _NOTHING_SAID
        by_volume = self._by_volume.result(_by_volume, self._lists.get(checkpoint.sha256))
        said = dict(by_volume.get(volume, {}))
        own = said.pop(self._session.person, None)
        return Judgement(own, said, own is not None and self._is_outdated(own))

    def judge(self, verdict: "Verdict") -> None:
        """Record a verdict on the open volume; the same one again takes it back, or renews an old one."""
        from annotations.prediction.verdicts.verdict_file import (  # late: few judge
            record_verdict,
            withdraw_verdict,
        )
        from annotations.prediction.verdicts.verdicts import verdict_on

        row, checkpoint, before = self._row(), self.checkpoint, self.open_judgement
        if row is None or checkpoint is None:
            self._session.post_message(_NO_ROW)
            return
        if before.own is not None and before.own.verdict == verdict and not before.is_outdated:
            self._write(checkpoint, partial(withdraw_verdict, volume=row.volume))
            return
        said = verdict_on(row, checkpoint, verdict, "" if before.own is None else before.own.note)
        self._write(checkpoint, partial(record_verdict, verdict=said))

    def write_note(self, volume: str, checkpoint: "CheckpointReference", note: str) -> bool:
        """Write a note to the person's verdict on a volume; False where it cannot be written.

        Parameters
        ----------
        volume : str
            Its id.
        checkpoint : CheckpointReference
            On whose prediction the verdict is; another one may be in use by now.
        note : str
        """
        from annotations.prediction.verdicts.verdict_file import record_verdict  # late: few judge

        lists = self._lists.get(checkpoint.sha256, ())
        mine = next((each for each in lists if each.reviewer == self._session.person), None)
        own = None if mine is None else mine.on(volume)
        if own is None or own.note == note:
            return True
        return self._write(checkpoint, partial(record_verdict, verdict=changed(own, note=note)))

    def _write(
        self, checkpoint: "CheckpointReference", write: "Callable[[Path, str, str, str], VerdictList]"
    ) -> bool:
        """Write the person's file at once, as a small one: who goes on has nothing to lose.

        False where it cannot be written.
        """
        person = self._session.person
        try:
            written = write(self._session.worklist.folder, checkpoint.name, checkpoint.sha256, person)
        except UserError as error:
            self._session.report(error)
            self.changed.emit()
            return False
        others = (each for each in self._lists.get(checkpoint.sha256, ()) if each.reviewer != person)
        self._lists[checkpoint.sha256] = (*others, written)
        self.changed.emit()
        return True

    def _row(self) -> "ErrorsOfVolume | None":
        return self._reviewing.row_of(self._reviewing.open_volume)

    def _is_outdated(self, verdict: "VolumeVerdict") -> bool:
        from annotations.prediction.verdicts.verdicts import is_stale  # late: few judge

        checkpoint = self.checkpoint
        row = self._reviewing.row_of(verdict.volume)
        return checkpoint is not None and is_stale(verdict, row, checkpoint.sha256)

    def _on_reviewing_changed(self) -> None:
        if self._reviewing.review is None:
            self._lists = {}

    def _on_reviewing_computed(self) -> None:
        from annotations.prediction.verdicts.verdict_file import load_verdicts  # late: few judge

        review, person = self._reviewing.review, self._session.person
        if review is None:
            return
        self._lists = {}
        for checkpoint, judged in zip(review.checkpoints, review.material.checkpoints, strict=True):
            others = (each for each in judged.verdicts if each.reviewer != person)
            # Anew: a verdict may have been given while the errors were computed.
            try:
                own = load_verdicts(review.folder, checkpoint.description.name, checkpoint.sha256, person)
            except DocumentError:
                # It is among the review's remarks, and what is there is not written over.
                own = None
            self._lists[checkpoint.sha256] = (*others, *((own,) if own is not None else ()))
        self.changed.emit()


def _by_volume(lists: "tuple[VerdictList, ...] | None") -> "Mapping[str, Mapping[str, VolumeVerdict]]":
    """Return the verdicts by the volume and by who says so."""
    said: dict[str, dict[str, VolumeVerdict]] = {}
    for each in lists or ():
        for verdict in each.verdicts:
            said.setdefault(verdict.volume, {})[each.reviewer] = verdict
    return said
