"""The session's review of predictions: the errors of loaded checkpoints, and what a reviewer makes of them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from PySide6.QtCore import QObject, Signal

from annotator.session.agreeing import Agreeing
from annotator.session.predicting import Predicting
from annotator.session.saving import SessionSaving

if TYPE_CHECKING:
    from annotations.prediction.error_table import ErrorTable

VerdictName = Literal["annotation_wrong", "model_wrong", "both_wrong", "neither_wrong"]


class Reviewing(QObject):
    """Compares what checkpoints predicted with what people say, and walks from the worst volume to the best.

    Signals
    -------
    changed
        Anything that this class tells may have changed.
    """

    changed = Signal()

    def __init__(
        self,
        session: SessionSaving,
        predicting: Predicting,
        agreeing: Agreeing,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting
        self._agreeing = agreeing
        self._tables: Mapping[str, ErrorTable] = {}

    @property
    def refusal(self) -> str:
        """Why the errors are not for this person here, as a sentence without its full stop; or empty."""
        worklist = self._session.worklist
        if worklist.study is None:
            return "Open a study: what its people say is what predictions are held against"
        return self._agreeing.refusal

    @property
    def may_compute(self) -> bool:
        """Whether there is a checkpoint whose errors may be computed."""
        return bool(self._predicting.checkpoints) and not self.refusal

    @property
    def table(self) -> "ErrorTable | None":
        """The errors of the checkpoint in use, as they were computed last."""
        current = self._predicting.current if self._predicting.checkpoints else None
        return None if current is None else self._tables.get(current.sha256)

    @property
    def is_judgeable(self) -> bool:
        """Whether a verdict can be given on the open volume."""
        return False

    @property
    def verdict(self) -> VerdictName | None:
        """The person's own verdict on the open volume."""
        return None

    def compute(self) -> None:
        """Compute the errors of all checkpoints; ``changed`` follows."""

    def step(self, by: int) -> None:
        """Open the volume that stands so many places further in the order of the review."""

    def judge(self, verdict: VerdictName) -> None:
        """Record a verdict on the open volume, or take the same one back."""
