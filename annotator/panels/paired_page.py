"""Several checkpoints side by side."""

from PySide6.QtWidgets import QWidget

from annotator.session import Session


class PairedPage(QWidget):
    """Placeholder."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)

    def draw(self) -> None:
        """Draw."""
