"""The live view's window: volumes and the predicted pose as they come."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from annotator.session import Session


class LiveWindow(QWidget):
    """Shows what a network sees in each volume that arrives, and where it has the tool."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self._living = session.living
        self.setObjectName("live_window")
        self.setWindowTitle("Live view")
