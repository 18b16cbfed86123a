"""Fusion, with marks and pressed buttons that can be told apart in a dark theme too."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPalette, QPen
from PySide6.QtWidgets import QProxyStyle, QStyle, QStyleOption, QWidget

_BOXES = (QStyle.PrimitiveElement.PE_IndicatorCheckBox, QStyle.PrimitiveElement.PE_IndicatorItemViewItemCheck)


class ApplicationStyle(QProxyStyle):
    """Draws check boxes with a light outline, and buttons that are on in the colour of a selection.

    Fusion outlines both in a darker shade of the window: on a dark window nobody sees whether they are on.
    """

    def __init__(self) -> None:
        super().__init__("Fusion")

    def drawPrimitive(
        self,
        element: QStyle.PrimitiveElement,
        option: QStyleOption,
        painter: QPainter,
        widget: QWidget | None = None,
    ) -> None:
        if element in _BOXES:
            _draw_box(option, painter)
        elif (
            element == QStyle.PrimitiveElement.PE_PanelButtonTool and option.state & QStyle.StateFlag.State_On
        ):
            _draw_pressed(option, painter)
        else:
            super().drawPrimitive(element, option, painter, widget)


def _draw_box(option: QStyleOption, painter: QPainter) -> None:
    palette, enabled = option.palette, bool(option.state & QStyle.StateFlag.State_Enabled)
    group = QPalette.ColorGroup.Active if enabled else QPalette.ColorGroup.Disabled
    checked = bool(option.state & (QStyle.StateFlag.State_On | QStyle.StateFlag.State_NoChange))
    # On a selected row the box stays a box of its own: filled, so that its outline needs no second colour.
    fill = palette.color(group, QPalette.ColorRole.Highlight if checked else QPalette.ColorRole.Base)
    outline = palette.color(group, QPalette.ColorRole.Text)
    outline.setAlphaF(0.65)
    side = min(option.rect.width(), option.rect.height()) - 2.0
    box = QRectF(0, 0, side, side)
    box.moveCenter(QRectF(option.rect).center())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(outline, 2.0 if option.state & QStyle.StateFlag.State_HasFocus else 1.2))
    painter.setBrush(fill)
    painter.drawRoundedRect(box, 2.5, 2.5)
    if checked:
        _draw_tick(box, palette.color(group, QPalette.ColorRole.HighlightedText), painter)
    painter.restore()


def _draw_tick(box: QRectF, color: QColor, painter: QPainter) -> None:
    unit = box.width() / 16
    painter.setPen(
        QPen(color, 2 * unit, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
    )
    corner = box.topLeft()
    painter.drawPolyline([corner + QPointF(x, y) * unit for x, y in ((3.8, 8.4), (6.8, 11.4), (12.2, 5))])


def _draw_pressed(option: QStyleOption, painter: QPainter) -> None:
    accent = option.palette.color(QPalette.ColorRole.Highlight)
    fill = QColor(accent)
    fill.setAlphaF(0.45 if option.state & QStyle.StateFlag.State_Enabled else 0.2)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(accent, 1))
    painter.setBrush(fill)
    painter.drawRoundedRect(QRectF(option.rect).adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)
    painter.restore()
