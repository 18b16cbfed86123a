"""A section of a panel or dialog that folds away under its title."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtWidgets import QScrollArea, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from annotator.looks.naming import named


class Folding(QWidget):
    """A title with an arrow, and content that it shows and hides.

    Signals
    -------
    toggled : bool
        The content is shown now, or hidden.
    """

    toggled = Signal(bool)

    def __init__(
        self, title: str, content: QWidget, *, name: str, unfolded: bool, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._content = content
        self._unfolded = unfolded
        self._button = named(QToolButton(), name)
        self._button.setText(title)
        self._button.setAccessibleName(title)
        self._button.setAutoRaise(True)
        self._button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        font = self._button.font()
        font.setBold(True)
        self._button.setFont(font)
        self._button.clicked.connect(self._on_button_clicked)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2)
        layout.addWidget(self._button)
        layout.addWidget(content)
        self._draw()

    @Slot()
    def _on_button_clicked(self) -> None:
        self._unfolded = not self._unfolded
        self._draw()
        self.toggled.emit(self._unfolded)

    def _draw(self) -> None:
        self._content.setVisible(self._unfolded)
        self._button.setArrowType(Qt.ArrowType.DownArrow if self._unfolded else Qt.ArrowType.RightArrow)
        self._button.setAccessibleDescription("Unfolded" if self._unfolded else "Folded away")


def scrolling_column(widgets: Sequence[QWidget], name: str) -> QScrollArea:
    """Return widgets below each other, in an area that scrolls where they do not fit."""
    inside = QWidget()
    column = QVBoxLayout(inside)
    for widget in widgets:
        column.addWidget(widget)
    column.addStretch(1)
    return scrolling(inside, name)


def scrolling(widget: QWidget, name: str) -> QScrollArea:
    """Return a widget in an area that is filled by it, and scrolls where there is less room than it needs."""
    scroll = QScrollArea()
    scroll.setObjectName(name)
    scroll.setWidgetResizable(True)
    scroll.setFrameShape(QScrollArea.Shape.NoFrame)
    scroll.setWidget(widget)
    return scroll
