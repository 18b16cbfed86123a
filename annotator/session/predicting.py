"""The session's predictions: the checkpoints that are loaded, and what they say of volumes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from annotator.session.predicted import ShownPrediction
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

    @property
    def checkpoints(self) -> "tuple[Checkpoint, ...]":
        """Those that are loaded, in the order of their loading: several stand side by side."""
        return self._checkpoints

    @property
    def current(self) -> "Checkpoint | None":
        """The one in use: it predicts, and its predictions are drawn."""
        raise NotImplementedError

    @property
    def truth(self) -> "Truth":
        """Whose annotations are taken for the truth."""
        raise NotImplementedError

    @property
    def prediction(self) -> "Prediction | None":
        """What ``current`` says of the open volume; None where it has not said anything yet."""
        raise NotImplementedError

    @property
    def shown(self) -> ShownPrediction | None:
        """What is drawn over the open volume, where the layer ``prediction`` is shown and may be."""
        raise NotImplementedError

    @property
    def reason(self) -> str:
        """Why nothing is shown though it is wanted, as a sentence without its full stop; else empty."""
        raise NotImplementedError

    @property
    def is_predicting(self) -> bool:
        """Whether volumes are being predicted."""
        raise NotImplementedError

    def unfitness(self, checkpoint: "Checkpoint") -> str:
        """Return why a checkpoint does not fit what is open, without a full stop; empty where it fits."""
        raise NotImplementedError

    def load(self, checkpoint: "Checkpoint") -> None:
        """Take a checkpoint into use; what others have predicted stays."""
        raise NotImplementedError

    def choose(self, sha256: str) -> None:
        """Use another one of those that are loaded."""
        raise NotImplementedError

    def put_away(self, sha256: str) -> None:
        """Put a checkpoint away; its predictions stay in their files."""
        raise NotImplementedError

    def choose_truth(self, truth: "Truth") -> None:
        """Take other annotations for the truth."""
        raise NotImplementedError

    def predict(self, indices: Sequence[int]) -> None:
        """Predict the items at these places that have no prediction of ``current`` yet."""
        raise NotImplementedError

    def cancel(self) -> None:
        """Give up what is being predicted; what is done stays."""
        raise NotImplementedError

    def start_from_prediction(self) -> None:
        """Put unplaced keypoints where ``current`` has them, as one edit."""
        raise NotImplementedError

    def accept_predicted(self) -> None:
        """Count the keypoints that are still where a checkpoint put them as placed, as one edit."""
        raise NotImplementedError
