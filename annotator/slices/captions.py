"""Short texts over an image, readable on dark and bright ground."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter

BACKGROUND = QColor(0, 0, 0, 150)
PADDING_PX = 3.0


def paint_caption(
    painter: QPainter, anchor: QPointF, text: str, color: QColor, alignment: Qt.AlignmentFlag
) -> QRectF:
    """Draw a text on a dark ground and return the rectangle that it takes.

    Parameters
    ----------
    painter : QPainter
        With the font to use.
    anchor : QPointF
        Where the text's edge or corner lies.
    text : str
    color : QColor
    alignment : Qt.AlignmentFlag
        Which edge or corner of the text the anchor is: ``AlignLeft | AlignTop`` writes to its lower right.
    """
    metrics = painter.fontMetrics()
    width = metrics.horizontalAdvance(text) + 2 * PADDING_PX
    height = metrics.height() + PADDING_PX
    left, top = anchor.x(), anchor.y()
    if alignment & Qt.AlignmentFlag.AlignRight:
        left -= width
    elif alignment & Qt.AlignmentFlag.AlignHCenter:
        left -= width / 2
    if alignment & Qt.AlignmentFlag.AlignBottom:
        top -= height
    elif alignment & Qt.AlignmentFlag.AlignVCenter:
        top -= height / 2
    area = QRectF(left, top, width, height)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(BACKGROUND)
    painter.drawRoundedRect(area, 3.0, 3.0)
    painter.setPen(color)
    painter.drawText(area, Qt.AlignmentFlag.AlignCenter, text)
    return area
