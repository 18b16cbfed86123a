"""What the window shows as long as nothing is open: the ways to open something."""

from collections.abc import Iterable

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QCommandLinkButton, QFrame, QHBoxLayout, QVBoxLayout, QWidget

from annotator.looks.labels import Heading, WrappedText

_COLUMN_LETTERS = 84
_TITLE = "Open a volume to annotate"


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
        column.setMaximumWidth(_COLUMN_LETTERS * self.fontMetrics().averageCharWidth())
        layout = QVBoxLayout(column)
        self._title = Heading(_TITLE)
        self._title.setObjectName("start_title")
        layout.addWidget(self._title)
        layout.addWidget(WrappedText("Drop a file or a folder anywhere on the window, or choose:"))
        links = [_ActionLink(action) for action in opening]
        for link in links:
            layout.addWidget(link)
        self._recent_title = Heading("Recent")
        layout.addSpacing(self.fontMetrics().height())
        layout.addWidget(self._recent_title)
        for action in self._recent:
            layout.addWidget(_ActionLink(action))
        beside = QHBoxLayout()
        beside.addStretch(1)
        beside.addWidget(column, 100)
        beside.addStretch(1)
        around = QVBoxLayout(self)
        around.addStretch(2)
        around.addLayout(beside)
        around.addStretch(3)
        for action in self._recent:
            action.changed.connect(self._draw)
        self.setFocusProxy(links[0])
        self._draw()

    def show_opening(self, title: str) -> None:
        """Say what is being opened; an empty text says that nothing is."""
        self._title.setText(f"{title} …" if title else _TITLE)

    def _draw(self) -> None:
        self._recent_title.setVisible(any(action.isVisible() for action in self._recent))


class _ActionLink(QCommandLinkButton):
    """A large button for an action: its name, and below it what it opens."""

    def __init__(self, action: QAction) -> None:
        super().__init__()
        self._action = action
        self.setObjectName(f"start_{action.objectName().removeprefix('action_')}")
        self.clicked.connect(action.trigger)
        action.changed.connect(self._draw)
        self._draw()

    def _draw(self) -> None:
        name, _, place = self._action.text().replace("&&", "&").partition(" – ")
        self.setText(name.removesuffix("…"))
        self.setDescription(place or self._action.toolTip())
        self.setAccessibleName(name)
        self.setIcon(self._action.icon())
        self.setVisible(self._action.isVisible())
