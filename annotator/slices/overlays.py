"""Draws keypoints and links over a slice."""

from collections.abc import Container, Iterable, Mapping

from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen

from annotations.geometry.frames import Vector
from annotations.geometry.tool import ToolSpecification
from annotator.slices.captions import paint_caption
from annotator.slices.marks import NEAR_UM, Mark
from annotator.slices.viewport import Viewport

OUTLINE = QColor(0, 0, 0, 190)
ACTIVE = QColor("#ffffff")
PREVIEW = QColor("#ffab5e")
LINK_WIDTH_PX = 2.0
FAR_OPACITY = 0.4
ORIGIN_RADIUS_PX = 3.0
RING_GAP_PX = 3.5
Line = tuple[tuple[float, float], tuple[float, float]]


def paint_links(
    painter: QPainter,
    viewport: Viewport,
    index: int,
    tool: ToolSpecification,
    positions_um: Mapping[str, Vector],
) -> None:
    """Draw the tool's links between the keypoints that are there: solid near the plane, dashed elsewhere."""
    for link in tool.links:
        if link.base not in positions_um or link.tip not in positions_um:
            continue
        near, far = split_at_plane(viewport, index, positions_um[link.base], positions_um[link.tip])
        color = QColor(link.color)
        faint = QColor(color)
        faint.setAlphaF(FAR_OPACITY)
        painter.setPen(QPen(faint, LINK_WIDTH_PX, Qt.PenStyle.DashLine, Qt.PenCapStyle.FlatCap))
        painter.drawLines([_line(part) for part in far])
        painter.setPen(QPen(color, LINK_WIDTH_PX, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
        painter.drawLines([_line(part) for part in near])


def split_at_plane(
    viewport: Viewport, index: int, base_um: Vector, tip_um: Vector
) -> tuple[list[Line], list[Line]]:
    """Return the parts of a link, projected, that lie near a plane, and those that do not.

    Returns
    -------
    near, far : list of ((x, y), (x, y))
        In pixels of the widget; "near" is within `NEAR_UM` of the plane.
    """
    start, end = (viewport.plane.distance_um(position, index) for position in (base_um, tip_um))
    if start == end:
        enter, leave = (0.0, 1.0) if abs(start) <= NEAR_UM else (1.0, 1.0)
    else:
        crossings = sorted(((side - start) / (end - start)) for side in (-NEAR_UM, NEAR_UM))
        enter, leave = (min(max(share, 0.0), 1.0) for share in crossings)
    first, last = viewport.pixel(base_um), viewport.pixel(tip_um)

    def part(begin: float, stop: float) -> list[Line]:
        return [(_between(first, last, begin), _between(first, last, stop))] if stop > begin else []

    return part(enter, leave), part(0.0, enter) + part(leave, 1.0)


def paint_marks(
    painter: QPainter, shown: Iterable[Mark], *, names: bool, unnamed: Container[str] = ()
) -> list[QRectF]:
    """Draw keypoints, the active one above all others, and return where their names stand.

    Parameters
    ----------
    unnamed : container of str
        The keypoints that are named otherwise.
    """
    named = []
    for mark in sorted(shown, key=lambda one: (one.active, one.nearness)):
        painter.setOpacity(FAR_OPACITY + (1 - FAR_OPACITY) * mark.nearness if not mark.active else 1.0)
        if mark.preview:
            _paint_way(painter, mark)
        if mark.is_near or mark.preview:
            _paint_near(painter, mark)
        else:
            _paint_far(painter, mark)
        if mark.locked:
            _paint_lock(painter, mark)
        if names and mark.name not in unnamed:
            named.append(_paint_name(painter, mark))
    painter.setOpacity(1.0)
    return named


def _paint_way(painter: QPainter, mark: Mark) -> None:
    """Connect a keypoint on its way with where the document has it."""
    if mark.origin_px is None:
        return
    painter.setPen(QPen(PREVIEW, 1.0, Qt.PenStyle.DotLine))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    origin = QPointF(*mark.origin_px)
    painter.drawLine(QLineF(origin, _center(mark)))
    painter.setPen(QPen(PREVIEW, 1.0))
    painter.drawEllipse(origin, ORIGIN_RADIUS_PX, ORIGIN_RADIUS_PX)


def _paint_near(painter: QPainter, mark: Mark) -> None:
    center, radius = _center(mark), mark.radius_px
    color = QColor(mark.color)
    square = mark.state == "out_of_view"
    hollow = mark.state == "occluded" or square or not mark.is_on_plane
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(OUTLINE, 4.0))
    _outline(painter, center, radius, square=square)
    if not hollow:
        painter.setBrush(color)
    elif mark.state == "placed":
        # Off the plane but seen: filled as much as it is near.
        filled = QColor(color)
        filled.setAlphaF(0.6 * mark.nearness)
        painter.setBrush(filled)
    dashed = Qt.PenStyle.DashLine if mark.preview else Qt.PenStyle.SolidLine
    painter.setPen(QPen(PREVIEW if mark.preview else color, 2.0, dashed))
    _outline(painter, center, radius, square=square)
    if mark.is_on_plane:
        painter.setPen(QPen(OUTLINE if not hollow else color, 1.5))
        painter.drawPoint(center)
    if mark.active:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(PREVIEW if mark.preview else ACTIVE, 1.5))
        _outline(painter, center, radius + RING_GAP_PX, square=square)


def _paint_far(painter: QPainter, mark: Mark) -> None:
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(mark.color), 1.2, Qt.PenStyle.DashLine))
    _outline(painter, _center(mark), mark.radius_px, square=mark.state == "out_of_view")
    if mark.active:
        painter.setPen(QPen(ACTIVE, 1.0, Qt.PenStyle.DashLine))
        _outline(painter, _center(mark), mark.radius_px + RING_GAP_PX, square=mark.state == "out_of_view")


def _paint_lock(painter: QPainter, mark: Mark) -> None:
    """A padlock at the lower left of a keypoint."""
    body = QRectF(mark.x - mark.radius_px - 7.0, mark.y + mark.radius_px - 1.0, 7.0, 5.0)
    painter.setPen(QPen(OUTLINE, 1.0))
    painter.setBrush(ACTIVE)
    painter.drawRect(body)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(ACTIVE, 1.3))
    painter.drawArc(QRectF(body.left() + 1.5, body.top() - 3.5, 4.0, 7.0), 0, 180 * 16)


def _paint_name(painter: QPainter, mark: Mark) -> QRectF:
    font = QFont(painter.font())
    font.setBold(mark.active)
    painter.save()
    painter.setFont(font)
    anchor = QPointF(mark.x + mark.radius_px + 5.0, mark.y - mark.radius_px)
    color = PREVIEW if mark.preview else ACTIVE if mark.active else QColor(mark.color)
    area = paint_caption(
        painter, anchor, mark.text, color, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom
    )
    painter.restore()
    return area


def _outline(painter: QPainter, center: QPointF, radius: float, *, square: bool) -> None:
    if square:
        painter.drawRect(QRectF(center.x() - radius, center.y() - radius, 2 * radius, 2 * radius))
    else:
        painter.drawEllipse(center, radius, radius)


def _center(mark: Mark) -> QPointF:
    return QPointF(mark.x, mark.y)


def _line(part: Line) -> QLineF:
    return QLineF(QPointF(*part[0]), QPointF(*part[1]))


def _between(first: tuple[float, float], last: tuple[float, float], share: float) -> tuple[float, float]:
    return (first[0] + (last[0] - first[0]) * share, first[1] + (last[1] - first[1]) * share)
