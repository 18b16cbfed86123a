"""Small pictures in a link's colour, which stand before its parts in lists and tables."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap


def part_swatch(color: QColor, *, hollow: bool) -> QIcon:
    """Return a disc in a link's colour; a ring for a part that is not placed."""
    side = 32
    pixmap = QPixmap(side, side)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(color, 4))
    painter.setBrush(Qt.BrushStyle.NoBrush if hollow else color)
    painter.drawEllipse(5, 5, side - 10, side - 10)
    painter.end()
    return QIcon(pixmap)


def link_swatch(color: QColor) -> QIcon:
    """Return a square in a link's colour."""
    pixmap = QPixmap(16, 16)
    pixmap.fill(color)
    return QIcon(pixmap)
