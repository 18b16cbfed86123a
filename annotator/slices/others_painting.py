"""Draws the other annotators' keypoints and boxes over a slice, and how far all are apart."""

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from annotator.looks.annotator_marks import (
    annotator_color,
    covered,
    gathered,
    label_words,
    paint_annotator_mark,
    text_color,
)
from annotator.looks.label_places import label_area
from annotator.session.agreement.differences import Difference
from annotator.session.agreement.others import OtherAnnotation
from annotator.session.editing.solids import Solid
from annotator.slices.captions import BACKGROUND, PADDING_PX
from annotator.slices.marks import nearness
from annotator.slices.overlays import FAR_OPACITY, OUTLINE, Line, split_at_plane
from annotator.slices.solid_outlines import Point, section_um
from annotator.slices.viewport import Area, Viewport

EDGE_WIDTH_PX = 1.5
LINE_WIDTH_PX = 2.0


@dataclass(frozen=True)
class OtherMark:
    """Where another annotator has a keypoint, on a slice.

    Attributes
    ----------
    keypoint, initials : str
    number : int
        The annotator's place in the order of all.
    x, y : float
        Its projection onto the plane, in pixels of the widget.
    nearness : float
        As for `annotator.slices.marks.Mark`.
    """

    keypoint: str
    initials: str
    number: int
    x: float
    y: float
    nearness: float

    @property
    def opacity(self) -> float:
        """How firmly it is drawn."""
        return FAR_OPACITY + (1 - FAR_OPACITY) * self.nearness


@dataclass(frozen=True)
class OtherOutline:
    """Where a slice cuts another annotator's box: corners in pixels, all the way round."""

    link: str
    number: int
    points: tuple[Point, ...]


def other_marks(others: Iterable[OtherAnnotation], viewport: Viewport, index: int) -> tuple[OtherMark, ...]:
    """Return the others' keypoints as the plane with an index shows them."""
    plane, made = viewport.plane, []
    half_um = plane.spacing_um[plane.axis] / 2
    for other in others:
        for name, position_um in other.positions_um.items():
            near = nearness(plane.distance_um(position_um, index), half_um)
            made.append(OtherMark(name, other.initials, other.number, *viewport.pixel(position_um), near))
    return tuple(made)


def other_outlines(
    others: Iterable[OtherAnnotation], viewport: Viewport, index: int
) -> tuple[OtherOutline, ...]:
    """Return the others' boxes that the plane with an index cuts."""
    made = []
    for other in others:
        for link, box in other.boxes.items():
            color = annotator_color(other.number).name()
            solid = Solid(link=link, kind="box", box=box, is_round=False, color=color)
            points = tuple(viewport.pixel(corner) for corner in section_um(solid, viewport.plane, index))
            if points:
                made.append(OtherOutline(link, other.number, points))
    return tuple(made)


def paint_other_outlines(painter: QPainter, outlines: Iterable[OtherOutline]) -> None:
    """Draw where boxes are cut: an outline without a filling."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for outline in outlines:
        polygon = QPolygonF([QPointF(*point) for point in outline.points])
        for pen in (QPen(OUTLINE, EDGE_WIDTH_PX + 1.5), QPen(text_color(outline.number), EDGE_WIDTH_PX)):
            painter.setPen(pen)
            painter.drawConvexPolygon(polygon)


def paint_differences(painter: QPainter, viewport: Viewport, index: int, lines: Iterable[Difference]) -> None:
    """Draw differences as lines: firm near the plane, faint elsewhere."""
    parts: dict[int, tuple[list[Line], list[Line]]] = {}
    for line in lines:
        near, far = split_at_plane(viewport, index, line.position_um, line.reference_um)
        of_annotator = parts.setdefault(line.number, ([], []))
        of_annotator[0].extend(far)
        of_annotator[1].extend(near)
    for number, of_annotator in parts.items():
        for segments, opacity in zip(of_annotator, (FAR_OPACITY, 1.0), strict=True):
            painter.setOpacity(opacity)
            _paint_lines(painter, segments, text_color(number))
    painter.setOpacity(1.0)


def paint_other_marks(
    painter: QPainter, marks: Sequence[OtherMark], area: Area, unnamed: Container[str] = ()
) -> list[QRectF]:
    """Draw keypoints, and initials beside those that lie together, in sight if the marks are.

    Returns what the initials cover.

    Parameters
    ----------
    unnamed : container of str
        The keypoints whose names stand there too, as one's own document has no mark that they stand at.
    """
    for mark in sorted(marks, key=lambda one: one.nearness):
        painter.setOpacity(mark.opacity)
        paint_annotator_mark(painter, QPointF(mark.x, mark.y), mark.number, filled=mark.nearness > 0)
    taken: list[QRectF] = []
    whole = QRectF(area.left, area.top, area.width, area.height)
    for group in gathered([(mark.x, mark.y) for mark in marks]):
        taken.append(_paint_initials(painter, [marks[index] for index in group], taken, whole, unnamed))
    painter.setOpacity(1.0)
    return taken


def _paint_initials(
    painter: QPainter,
    group: Sequence[OtherMark],
    taken: Sequence[QRectF],
    whole: QRectF,
    unnamed: Container[str],
) -> QRectF:
    """Write the initials of those whose marks lie together, and return what they cover."""
    painter.setOpacity(max(mark.opacity for mark in group))
    metrics = painter.fontMetrics()
    gap = metrics.horizontalAdvance(" ") / 2
    letters = label_words([(mark.keypoint, mark.initials, mark.number) for mark in group], unnamed)
    width = sum(metrics.horizontalAdvance(text) + gap for text, _ in letters) - gap + 2 * PADDING_PX
    around = covered([(mark.x, mark.y) for mark in group])
    area = label_area(around, width, metrics.height(), taken, whole)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(BACKGROUND)
    painter.drawRoundedRect(area, 3.0, 3.0)
    left = area.left() + PADDING_PX
    for text, number in letters:
        painter.setPen(text_color(number))
        painter.drawText(QPointF(left, area.top() + metrics.ascent()), text)
        left += metrics.horizontalAdvance(text) + gap
    return area


def _paint_lines(painter: QPainter, parts: Iterable[Line], color: QColor) -> None:
    lines = [QLineF(QPointF(*first), QPointF(*last)) for first, last in parts]
    for pen in (QPen(OUTLINE, LINE_WIDTH_PX + 2), QPen(color, LINE_WIDTH_PX)):
        painter.setPen(pen)
        painter.drawLines(lines)
