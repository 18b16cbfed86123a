"""Predictions held against what people say: the errors, the plots, several checkpoints side by side."""

from PySide6.QtWidgets import QVBoxLayout, QWidget

from annotator.looks.labels import WrappedText
from annotator.session import Session


class PredictionsPanel(QWidget):
    """Shows the errors of the checkpoint in use, and opens their volumes."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setObjectName("predictions_panel")
        self.setAccessibleName("Predictions")
        self._state = WrappedText(name="predictions_state")
        layout = QVBoxLayout(self)
        layout.addWidget(self._state)
        layout.addStretch()
