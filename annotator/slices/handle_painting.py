"""Draws the handles of a box or of the posed tool over a slice, each kind in a form of its own."""

from collections.abc import Iterable

from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from annotator.slices.captions import paint_caption
from annotator.slices.handle_marks import HandleMark
from annotator.slices.overlays import ACTIVE, FAR_OPACITY, OUTLINE, PREVIEW
from annotator.slices.viewport import Area

RADIUS_PX = 6.0
HELD_RADIUS_PX = 7.5
FAR_RADIUS_PX = 3.5
FARTHEST_OPACITY = 0.6
_HINT_GAP_PX = 14.0


def paint_handles(
    painter: QPainter, shown: Iterable[HandleMark], *, pointed_at: str | None, held: str | None
) -> None:
    """Draw handles; the one under the cursor is larger, and the one that is held is in the colour of placing.

    Parameters
    ----------
    pointed_at, held : str or None
        Names of handles.
    """
    marks = tuple(shown)
    for mark in marks:
        _set_opacity(painter, mark, held)
        _paint_stem(painter, mark)
    for mark in marks:
        _set_opacity(painter, mark, held)
        if mark.handle.name == held:
            _paint_form(painter, mark, HELD_RADIUS_PX, PREVIEW)
        elif not mark.is_reachable:
            _paint_form(painter, mark, FAR_RADIUS_PX, QColor(mark.handle.color))
        else:
            radius_px = HELD_RADIUS_PX if mark.handle.name == pointed_at else RADIUS_PX
            _paint_form(painter, mark, radius_px, QColor(mark.handle.color))
    painter.setOpacity(1.0)


def paint_hint(painter: QPainter, area: Area, mark: HandleMark) -> None:
    """Write below a handle what a drag of it does, within an area."""
    text = mark.handle.hint
    half_px = painter.fontMetrics().horizontalAdvance(text) / 2 + 6
    x = min(max(mark.x, area.left + half_px), area.left + area.width - half_px)
    is_low = mark.y + _HINT_GAP_PX + painter.fontMetrics().height() + 6 > area.top + area.height
    y = mark.y - _HINT_GAP_PX if is_low else mark.y + _HINT_GAP_PX
    edge = Qt.AlignmentFlag.AlignBottom if is_low else Qt.AlignmentFlag.AlignTop
    paint_caption(painter, QPointF(x, y), text, ACTIVE, Qt.AlignmentFlag.AlignHCenter | edge)


def _set_opacity(painter: QPainter, mark: HandleMark, held: str | None) -> None:
    if mark.handle.name == held:
        painter.setOpacity(1.0)
    elif not mark.is_reachable:
        painter.setOpacity(FAR_OPACITY)
    else:
        painter.setOpacity(FARTHEST_OPACITY + (1 - FARTHEST_OPACITY) * mark.nearness)


def _paint_stem(painter: QPainter, mark: HandleMark) -> None:
    if mark.stem_px is None:
        return
    line = QLineF(QPointF(*mark.stem_px), _center(mark))
    for color, width_px in ((OUTLINE, 4.0), (QColor(mark.handle.color), 2.0)):
        painter.setPen(QPen(color, width_px))
        painter.drawLine(line)


def _paint_form(painter: QPainter, mark: HandleMark, radius: float, color: QColor) -> None:
    """A cross moves the body, a disc its end, a square a face; a ring with an arc turns, a rhomb bends."""
    center = _center(mark)
    painter.setBrush(Qt.BrushStyle.NoBrush if not mark.is_reachable else color)
    for pen in (QPen(OUTLINE, 4.0), QPen(ACTIVE if mark.is_reachable else color, 1.5)):
        painter.setPen(pen)
        match mark.handle.kind:
            case "face":
                side = 1.6 * radius
                painter.drawRect(QRectF(center.x() - side / 2, center.y() - side / 2, side, side))
            case "bend":
                reach = 1.25 * radius
                tips = [QPointF(reach, 0), QPointF(0, reach), QPointF(-reach, 0), QPointF(0, -reach)]
                painter.drawPolygon(QPolygonF([center + tip for tip in tips]))
            case _:
                painter.drawEllipse(center, radius, radius)
    if not mark.is_reachable:
        return
    painter.setPen(QPen(OUTLINE, 1.8))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    inner = 0.6 * radius
    match mark.handle.kind:
        case "move":
            for arm in (QPointF(inner, 0), QPointF(0, inner)):
                painter.drawLine(QLineF(center - arm, center + arm))
        case "turn":
            ring = QRectF(center.x() - inner, center.y() - inner, 2 * inner, 2 * inner)
            painter.drawArc(ring, 40 * 16, 280 * 16)
        case "end":
            painter.setBrush(OUTLINE)
            painter.drawEllipse(center, radius / 4, radius / 4)


def _center(mark: HandleMark) -> QPointF:
    return QPointF(mark.x, mark.y)
