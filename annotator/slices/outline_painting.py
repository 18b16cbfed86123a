"""Draws boxes, the fitted tool and the tool as the volume proposes it, where a slice cuts them."""

import math
from collections.abc import Iterable

from PySide6.QtCore import QLineF, QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from annotator.session.solids import SolidKind
from annotator.slices.overlays import OUTLINE, PREVIEW
from annotator.slices.solid_outlines import HingeSense, SolidOutline

HALO = QColor(0, 0, 0, 120)
FILL_OPACITY = 0.08
ACTIVE_FILL_OPACITY = 0.16
WIDTH_PX = 1.5
ACTIVE_WIDTH_PX = 2.5
THIN_PX = 1.2
# Boxes are what a person said, and lie over what was computed.
_ORDER: dict[SolidKind, int] = {"ghost": 0, "proposal": 1, "box": 2}
_DASHES: dict[SolidKind, list[float]] = {"ghost": [5.0, 4.0], "proposal": [8.0, 3.0, 1.5, 3.0]}

ARROW_PX = 15.0
_HEAD_PX = 5.0
_CIRCLE_PX = 5.5
# A direction that looks at the person by more than this (about 70°) is drawn as one that does so.
_STEEP = 0.94


def paint_outlines(painter: QPainter, outlines: Iterable[SolidOutline]) -> None:
    """Draw bodies: boxes firm and lightly filled, the fitted tool dashed, a proposal dash-dotted."""
    for outline in sorted(outlines, key=lambda one: (_ORDER[one.solid.kind], one.solid.active)):
        polygon = QPolygonF([QPointF(*point) for point in outline.points])
        if outline.solid.kind == "box":
            _paint_box(painter, polygon, outline)
        else:
            _paint_computed(painter, polygon, outline)


def _paint_box(painter: QPainter, polygon: QPolygonF, outline: SolidOutline) -> None:
    solid = outline.solid
    color, width_px = QColor(solid.color), ACTIVE_WIDTH_PX if solid.active else WIDTH_PX
    fill = QColor(color)
    fill.setAlphaF(ACTIVE_FILL_OPACITY if solid.active else FILL_OPACITY)
    painter.setPen(_pen(HALO, width_px + 2))
    painter.setBrush(fill)
    painter.drawConvexPolygon(polygon)
    painter.setPen(_pen(color, width_px))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawConvexPolygon(polygon)
    if outline.hinge is not None:
        _paint_hinge(painter, outline.hinge, color)


def _paint_computed(painter: QPainter, polygon: QPolygonF, outline: SolidOutline) -> None:
    solid = outline.solid
    pen = _pen(PREVIEW if solid.kind == "proposal" else QColor(solid.color), THIN_PX)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    pen.setDashPattern(_DASHES[solid.kind])
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_pen(HALO, THIN_PX + 1.5))
    painter.drawConvexPolygon(polygon)
    painter.setPen(pen)
    painter.drawConvexPolygon(polygon)


def _paint_hinge(painter: QPainter, hinge: HingeSense, color: QColor) -> None:
    """Draw +y as an arrow out of the outline; as its point or feathers where it runs across the slice."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if abs(hinge.away) > _STEEP:
        _paint_across(painter, QPointF(*hinge.inner), color, away=hinge.away > 0)
        return
    length_px = math.hypot(hinge.right, hinge.down)
    way = QPointF(hinge.right / length_px, hinge.down / length_px)
    foot = QPointF(*hinge.outer)
    point = foot + way * ARROW_PX * length_px
    side = QPointF(-way.y(), way.x()) * _HEAD_PX * 0.8
    back = point - way * _HEAD_PX
    lines = [QLineF(foot, point), QLineF(point, back + side), QLineF(point, back - side)]
    for pen in (_pen(OUTLINE, 4.5), _pen(color, 2.0)):
        painter.setPen(pen)
        painter.drawLines(lines)


def _paint_across(painter: QPainter, center: QPointF, color: QColor, *, away: bool) -> None:
    reach = _CIRCLE_PX * math.sqrt(0.5)
    for pen in (_pen(OUTLINE, 4.0), _pen(color, 1.6)):
        painter.setPen(pen)
        painter.drawEllipse(center, _CIRCLE_PX, _CIRCLE_PX)
        if away:
            for turn in (1, -1):
                arm = QPointF(reach, turn * reach)
                painter.drawLine(QLineF(center - arm, center + arm))
    if not away:
        painter.setPen(_pen(color, 4.0))
        painter.drawPoint(center)


def _pen(color: QColor, width_px: float) -> QPen:
    return QPen(color, width_px, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
