"""What the window shows as long as nothing is open: the ways to open something."""

from collections.abc import Iterable

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from annotator.labels import Heading

_COLUMN_LETTERS = 56


class StartPage(QWidget):
    """Offers the actions that open something as large buttons, and what was open before.

    Parameters
    ----------
    opening : iterable of QAction
        In the order in which they are shown.
    recent : iterable of QAction
        Those of the recent files; the ones that are not visible are left out.
    """

    def __init__(
        self, opening: Iterable[QAction], recent: Iterable[QAction], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("start_page")
        self.setAccessibleName("Nothing is open")
        self._recent = tuple(recent)
        column = QFrame()
        column.setFixedWidth(_COLUMN_LETTERS * self.fontMetrics().averageCharWidth())
        layout = QVBoxLayout(column)
        layout.addWidget(Heading("Open a volume to annotate"))
        layout.addWidget(QLabel("Drop a file or a folder anywhere on the window, or"))
        for action in opening:
            layout.addWidget(_button(action))
        self._recent_title = Heading("Recent")
        layout.addSpacing(self.fontMetrics().height())
        layout.addWidget(self._recent_title)
        self._recent_buttons = [_button(action) for action in self._recent]
        for button in self._recent_buttons:
            layout.addWidget(button)
        around = QVBoxLayout(self)
        around.addStretch(2)
        around.addWidget(column, 0, Qt.AlignmentFlag.AlignHCenter)
        around.addStretch(3)
        for action in self._recent:
            action.changed.connect(self._draw)
        self.setFocusProxy(self.findChild(QToolButton))
        self._draw()

    def _draw(self) -> None:
        for action, button in zip(self._recent, self._recent_buttons, strict=True):
            button.setVisible(action.isVisible())
        self._recent_title.setVisible(any(action.isVisible() for action in self._recent))


def _button(action: QAction) -> QToolButton:
    button = QToolButton()
    button.setDefaultAction(action)
    button.setObjectName(f"start_{action.objectName().removeprefix('action_')}")
    button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
    button.setAutoRaise(True)
    button.setCursor(Qt.CursorShape.PointingHandCursor)
    button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    button.setMinimumHeight(round(2.2 * button.fontMetrics().height()))
    return button
