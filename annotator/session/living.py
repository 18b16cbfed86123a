"""The session's live view: volumes that arrive one after the other, and what a checkpoint says of each."""

from PySide6.QtCore import QObject

from annotator.session.predicting import Predicting
from annotator.session.state import SessionState


class Living(QObject):
    """Lets a network look at volumes as they come, in a process of its own."""

    def __init__(self, session: SessionState, predicting: Predicting, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._predicting = predicting

    def close(self) -> None:
        """End the process."""
