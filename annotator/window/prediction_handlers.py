"""What the menu Predictions does with checkpoints: opens them, and lets them predict volumes."""

from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from annotator.panels.worklist.worklist_panel import WorklistPanel
from annotator.session import Session
from annotator.session.predictions.checkpoints import CHECKPOINT_SUFFIX, WEIGHTS_SUFFIX

_CHECKPOINT_FILES = f"Checkpoints (*{CHECKPOINT_SUFFIX} *{WEIGHTS_SUFFIX})"


class PredictionHandlers:
    """Turns menu entries into wishes about checkpoints and what they predict.

    Parameters
    ----------
    window : QWidget
        Parent of the dialogs.
    worklist : WorklistPanel
        Where volumes are selected.
    """

    def __init__(self, session: Session, window: QWidget, worklist: WorklistPanel) -> None:
        self._session = session
        self._window = window
        self._worklist = worklist

    def by_name(self) -> Mapping[str, Callable[[], object]]:
        """Return the handlers by the names of their actions."""
        predicting = self._session.predicting
        return {
            "load_checkpoint": self._load,
            "shipped_checkpoint": self._load_shipped,
            "predict_volume": self._predict_volume,
            "predict_selection": self._predict_selection,
            "predict_study": self._predict_study,
            "start_from_prediction": predicting.start_from_prediction,
            "accept_prediction": predicting.accept_predicted,
        }

    def _load(self) -> None:
        current = self._session.predicting.current
        folder = "" if current is None else str(current.path.parent)
        chosen, _ = QFileDialog.getOpenFileName(self._window, "Load a checkpoint", folder, _CHECKPOINT_FILES)
        if chosen:
            self._session.checkpoints.open(Path(chosen))

    def _load_shipped(self) -> None:
        path = self._session.predicting.shipped_path
        if path is not None:
            self._session.checkpoints.open(path)

    def _predict_volume(self) -> None:
        index = self._session.current_index
        if index is not None:
            self._session.predicting.predict([index])

    def _predict_selection(self) -> None:
        self._session.predicting.predict(self._worklist.selected)

    def _predict_study(self) -> None:
        self._session.predicting.predict(range(len(self._session.items)))
