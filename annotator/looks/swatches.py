"""Small pictures in a link's colour, which stand before its parts in lists and tables."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap


class PartSwatches:
    """Swatches of parts, each drawn once, as long as what shows them lives.

    Qt keeps what it makes of an icon, smaller or selected, under the icon's own number. Of one that is drawn
    anew for each painting it would keep as many pictures as there were paintings, up to ten megabytes.
    """

    def __init__(self) -> None:
        self._icons: dict[tuple[str, bool], QIcon] = {}

    def icon(self, color: QColor, *, hollow: bool) -> QIcon:
        """Return a disc in a link's colour; a ring for a part that is not placed."""
        key = (color.name(), hollow)
        if key not in self._icons:
            self._icons[key] = _part_swatch(color, hollow=hollow)
        return self._icons[key]


def link_swatch(color: QColor) -> QIcon:
    """Return a square in a link's colour."""
    pixmap = QPixmap(16, 16)
    pixmap.fill(color)
    return QIcon(pixmap)


def _part_swatch(color: QColor, *, hollow: bool) -> QIcon:
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
