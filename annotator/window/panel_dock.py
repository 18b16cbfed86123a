"""A dock that another panel's opening does not paint anew."""

from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QDockWidget, QWidget

from annotator.looks.redrawing import keep_painted


class PanelDock(QDockWidget):
    """Of another height alone, it leaves what is painted as it is."""

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(title, parent)
        keep_painted(self)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        # Its title is shortened to its width.
        if event.size().width() != event.oldSize().width():
            self.update()
