"""The session's predictions: the checkpoints that are loaded, and what they say of volumes."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotations.prediction.shipped import shipped_checkpoint
from annotator.session.predicted import ShownPrediction
from annotator.session.remembered import Remembered
from annotator.session.saving import SessionSaving
from annotator.session.seeing import Seeing

if TYPE_CHECKING:
    from annotations.prediction.checkpoint import Checkpoint
    from annotations.prediction.prediction import Prediction
    from annotations.prediction.study_errors import Truth


class Predicting(QObject):
    """Holds checkpoints, lets the one in use predict in the background, and shows what it says.

    Signals
    -------
    checkpoints_changed
        ``checkpoints`` or ``current`` changed.
    truth_changed
        ``truth`` changed.
    predicted
        Prediction files of ``current`` were written: those that a study or folder keeps have changed.
    running_changed
        ``is_predicting`` changed.
    shown_changed
        ``shown`` or ``reason`` changed.
    """

    checkpoints_changed = Signal()
    truth_changed = Signal()
    predicted = Signal()
    running_changed = Signal()
    shown_changed = Signal()

    def __init__(self, session: SessionSaving, seeing: Seeing, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._seeing = seeing
        self._checkpoints: tuple[Checkpoint, ...] = ()
        self._current: Checkpoint | None = None
        self._shipped: Remembered[Path | None] = Remembered()

    @property
    def checkpoints(self) -> "tuple[Checkpoint, ...]":
        """Those that are loaded, in the order of their loading: several stand side by side."""
        return self._checkpoints

    @property
    def current(self) -> "Checkpoint | None":
        """The one in use: it predicts, and its predictions are drawn."""
        return self._current

    @property
    def shipped_path(self) -> Path | None:
        """Where the checkpoint is that ships for the tool in use; None where there is none."""
        return self._shipped.result(shipped_checkpoint, self._session.tool_name)

    @property
    def truth(self) -> "Truth":
        """Whose annotations are taken for the truth."""
        from annotations.prediction.study_errors import Truth  # late: few sessions predict

        return Truth()

    @property
    def prediction(self) -> "Prediction | None":
        """What ``current`` says of the open volume; None where it has not said anything yet."""
        return None

    @property
    def shown(self) -> ShownPrediction | None:
        """What is drawn over the open volume, where the layer ``prediction`` is shown and may be."""
        return None

    @property
    def reason(self) -> str:
        """Why nothing is shown though it is wanted, as a sentence without its full stop; else empty."""
        return ""

    @property
    def is_predicting(self) -> bool:
        """Whether volumes are being predicted."""
        return False

    def unfitness(self, checkpoint: "Checkpoint") -> str:
        """Return why a checkpoint does not fit what is open, without a full stop; empty where it fits."""
        return ""

    def load(self, checkpoint: "Checkpoint") -> None:
        """Take a checkpoint into use; what others have predicted stays."""

    def choose(self, sha256: str) -> None:
        """Use another one of those that are loaded."""

    def put_away(self, sha256: str) -> None:
        """Put a checkpoint away; its predictions stay in their files."""

    def choose_truth(self, truth: "Truth") -> None:
        """Take other annotations for the truth."""

    def predict(self, indices: Sequence[int]) -> None:
        """Predict the items at these places that have no prediction of ``current`` yet."""

    def cancel(self) -> None:
        """Give up what is being predicted; what is done stays."""

    def start_from_prediction(self) -> None:
        """Put unplaced keypoints where ``current`` has them, as one edit."""

    def accept_predicted(self) -> None:
        """Count the keypoints that are still where a checkpoint put them as placed, as one edit."""
