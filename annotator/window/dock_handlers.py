"""What handlers whose wishes show in one panel begin with."""

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QDockWidget, QWidget

from annotator.session import Session
from annotator.window.questions import Questions


class DockHandlers(QObject):
    """Holds what is asked, and brings the panel to the front.

    Parameters
    ----------
    window : QWidget
        Parent of the dialogs.
    dock : QDockWidget
        The panel that shows what is wished for.
    """

    def __init__(self, session: Session, questions: Questions, window: QWidget, dock: QDockWidget) -> None:
        super().__init__(window)
        self._session = session
        self._questions = questions
        self._window = window
        self._dock = dock

    def _show_dock(self) -> None:
        self._dock.setVisible(True)
        self._dock.raise_()
