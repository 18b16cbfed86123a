"""The session's verdicts: who is wrong where a checkpoint and an annotation differ, as a reviewer says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotator.session.reviewing import Reviewing
from annotator.session.state import SessionState

if TYPE_CHECKING:
    from annotations.prediction.verdicts import Verdict, VerdictList, VolumeVerdict

VERDICT_WORDS: "Mapping[Verdict, str]" = {
    "annotation_wrong": "annotation",
    "model_wrong": "model",
    "both_wrong": "both",
    "neither_wrong": "neither",
}
"""Who is wrong by each verdict, in a word."""

_CHANGED = "*"


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
        reviewing.computed.connect(self._on_reviewing_computed)

    @property
    def lists(self) -> "Mapping[str, tuple[VerdictList, ...]]":
        """Everybody's verdicts, by the SHA-256 of the checkpoint that they are about."""
        return self._lists

    @property
    def open_volume(self) -> str | None:
        """The open volume, if a verdict can be given on it."""
        volume, table = self._reviewing.open_volume, self._reviewing.table
        is_there = table is not None and any(row.volume == volume for row in table.rows)
        return volume if is_there else None

    @property
    def open_judgement(self) -> Judgement:
        """What is said of the open volume."""
        volume = self.open_volume
        return _NOTHING_SAID if volume is None else self.judgement(volume)

    @property
    def is_judgeable(self) -> bool:
        """Whether a verdict can be given on the open volume."""
        return self.open_volume is not None

    @property
    def own(self) -> "VolumeVerdict | None":
        """The person's own verdict on the open volume."""
        return self.open_judgement.own

    def judgement(self, volume: str) -> Judgement:
        """Return what is said of a volume, about the checkpoint in use."""
        current = self._reviewing.current
        if current is None:
            return _NOTHING_SAID
        said = {
            each.reviewer: verdict
            for each in self._lists.get(current.checkpoint.sha256, ())
            for verdict in each.verdicts
            if verdict.volume == volume
        }
        own = said.pop(self._session.person, None)
        return Judgement(own, said, own is not None and self._is_outdated(own))

    def judge(self, verdict: "Verdict") -> None:
        """Record a verdict on the open volume; the same one again takes it back, or renews an old one."""

    def write_note(self, volume: str, note: str) -> None:
        """Write a note to the person's verdict on a volume."""

    def _is_outdated(self, verdict: "VolumeVerdict") -> bool:
        return False

    def _on_reviewing_computed(self) -> None:
        review = self._reviewing.review
        reviews = review.by_sha256 if review is not None else {}
        self._lists = {sha256: each.verdicts for sha256, each in reviews.items()}
        self.changed.emit()
