"""Draws boxes and the tool, as fitted, predicted or proposed by the volume, where a slice cuts them."""

import math
from collections.abc import Iterable

from PySide6.QtCore import QLineF, QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from annotator.session.editing.solids import Solid, SolidKind
from annotator.slices.captions import paint_caption
from annotator.slices.overlays import OUTLINE, PREVIEW
from annotator.slices.solid_outlines import HingeSense, SolidOutline

HALO = QColor(0, 0, 0, 120)
FILL_OPACITY = 0.08
ACTIVE_FILL_OPACITY = 0.16
WIDTH_PX = 1.5
ACTIVE_WIDTH_PX = 2.5
# Wider lines take Qt five times as long.
THIN_PX = 1.0
FIRM_PX = 1.8
# Boxes are what a person said, and lie over what was computed.
_ORDER: dict[SolidKind, int] = {"ghost": 0, "prediction": 1, "proposal": 2, "box": 3}
_DASHES_PX: dict[SolidKind, list[float]] = {
    "ghost": [5.0, 4.0],
    "prediction": [2.0, 3.0],
    "proposal": [8.0, 3.0, 1.5, 3.0],
}

ARROW_PX = 15.0
_HEAD_PX = 5.0
_CIRCLE_PX = 5.5
_NAME_GAP_PX = 8.0
# A direction that looks at the person by more than this (about 70°) is drawn as one that does so.
_STEEP = 0.94


def paint_outlines(painter: QPainter, outlines: Iterable[SolidOutline], *, names: bool, posing: bool) -> None:
    """Draw bodies: boxes firm and lightly filled, the tool dashed, predicted dotted, a proposal dash-dotted.

    Parameters
    ----------
    names : bool
        Whether the hinge's axis of the active box is named.
    posing : bool
        Whether the tool is what a person moves, and so drawn more firmly.
    """
    for outline in sorted(outlines, key=lambda one: (_ORDER[one.solid.kind], one.solid.active)):
        polygon = QPolygonF([QPointF(*point) for point in outline.points])
        if outline.solid.kind == "box":
            _paint_box(painter, polygon, outline)
            if names and outline.solid.active:
                _paint_hinge_name(painter, outline)
        else:
            _paint_computed(painter, polygon, outline.solid, FIRM_PX if posing else THIN_PX)


def _paint_box(painter: QPainter, polygon: QPolygonF, outline: SolidOutline) -> None:
    solid = outline.solid
    color, width_px = QColor(solid.color), ACTIVE_WIDTH_PX if solid.active else WIDTH_PX
    fill = QColor(color)
    fill.setAlphaF(ACTIVE_FILL_OPACITY if solid.active else FILL_OPACITY)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(fill)
    # The edge is drawn over, and smooth ones of large areas take long.
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    painter.drawConvexPolygon(polygon)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if solid.active:
        painter.setPen(_pen(HALO, width_px + 2))
        painter.drawConvexPolygon(polygon)
    painter.setPen(_pen(color, width_px))
    painter.drawConvexPolygon(polygon)
    if outline.hinge is not None:
        _paint_hinge(painter, outline.hinge, color)


def _paint_computed(painter: QPainter, polygon: QPolygonF, solid: Solid, width_px: float) -> None:
    pen = _pen(PREVIEW if solid.kind == "proposal" else QColor(solid.color), width_px)
    pen.setCapStyle(Qt.PenCapStyle.FlatCap)
    pen.setDashPattern([length_px / width_px for length_px in _DASHES_PX[solid.kind]])
    painter.setBrush(Qt.BrushStyle.NoBrush)
    # Dark between the dashes: so they are seen on bright ground, too.
    painter.setPen(_pen(OUTLINE, width_px))
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


def _paint_hinge_name(painter: QPainter, outline: SolidOutline) -> None:
    """Write +y beside the arrow's point, on the side that it points to."""
    hinge = outline.hinge
    if hinge is None:
        return
    if abs(hinge.away) > _STEEP:
        anchor, across, down = QPointF(*hinge.inner), 0.0, 1.0
    else:
        point = QPointF(*hinge.outer) + QPointF(hinge.right, hinge.down) * ARROW_PX
        anchor, across, down = point, hinge.right, hinge.down
    if abs(across) > abs(down):
        anchor += QPointF(math.copysign(_NAME_GAP_PX, across), 0)
        side = Qt.AlignmentFlag.AlignLeft if across > 0 else Qt.AlignmentFlag.AlignRight
        alignment = side | Qt.AlignmentFlag.AlignVCenter
    else:
        anchor += QPointF(0, math.copysign(_NAME_GAP_PX, down))
        side = Qt.AlignmentFlag.AlignTop if down > 0 else Qt.AlignmentFlag.AlignBottom
        alignment = Qt.AlignmentFlag.AlignHCenter | side
    paint_caption(painter, anchor, "+y", QColor(outline.solid.color), alignment)


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
