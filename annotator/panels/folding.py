"""A section of a panel that folds away under its title."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtWidgets import QSizePolicy, QToolButton, QVBoxLayout, QWidget

from annotator.naming import named


class Folding(QWidget):
    """A title with an arrow, and content that it shows and hides."""

    def __init__(
        self, title: str, content: QWidget, *, name: str, unfolded: bool, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._content = content
        self._button = named(QToolButton(), name)
        self._button.setText(title)
        self._button.setAccessibleName(title)
        self._button.setCheckable(True)
        self._button.setChecked(unfolded)
        self._button.setAutoRaise(True)
        self._button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        font = self._button.font()
        font.setBold(True)
        self._button.setFont(font)
        self._button.toggled.connect(self._on_button_toggled)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2)
        layout.addWidget(self._button)
        layout.addWidget(content)
        self._draw()

    @Slot()
    def _on_button_toggled(self) -> None:
        self._draw()

    def _draw(self) -> None:
        unfolded = self._button.isChecked()
        self._content.setVisible(unfolded)
        self._button.setArrowType(Qt.ArrowType.DownArrow if unfolded else Qt.ArrowType.RightArrow)
