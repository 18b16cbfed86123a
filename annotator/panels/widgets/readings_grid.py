"""Quantities below each other, each a title and its value in words that wrap."""

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from annotator.looks.labels import WrappedText


@dataclass(frozen=True)
class Line:
    """One quantity as it is written.

    Attributes
    ----------
    name : str
        Of the label that shows the value.
    title, text : str
        For a person; the text may have several lines.
    is_known : bool
        Else the text says why it is not.
    doubt : str
        Below the value, in the colour of warnings; empty where there is none.
    """

    name: str
    title: str
    text: str
    is_known: bool = True
    doubt: str = ""


class ReadingsGrid(QWidget):
    """A row for each quantity; rows are rewritten in place, so that nothing jumps while values change."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._rows: list[tuple[QLabel, WrappedText, WrappedText]] = []
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setColumnStretch(1, 1)
        self._grid.setHorizontalSpacing(12)

    def show_lines(self, lines: Sequence[Line]) -> None:
        """Write the quantities."""
        self._fit_rows(len(lines))
        for (title, value, doubt), line in zip(self._rows, lines, strict=True):
            title.setText(line.title)
            value.setObjectName(line.name)
            value.setAccessibleName(line.title)
            value.setText(line.text)
            value.set_color(None if line.is_known else lambda colors: colors.muted)
            doubt.setObjectName(f"{line.name}_doubt")
            doubt.setAccessibleName(f"What speaks against {line.title}")
            doubt.setText(line.doubt)
            doubt.setVisible(bool(line.doubt))

    def _fit_rows(self, count: int) -> None:
        while len(self._rows) > count:
            for label in self._rows.pop():
                self._grid.removeWidget(label)
                label.deleteLater()
        while len(self._rows) < count:
            row = 2 * len(self._rows)
            title, value, doubt = QLabel(), WrappedText(), WrappedText()
            doubt.set_color(lambda colors: colors.warning)
            self._grid.addWidget(title, row, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(value, row, 1)
            self._grid.addWidget(doubt, row + 1, 1)
            self._rows.append((title, value, doubt))
