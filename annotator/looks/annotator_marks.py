"""How the other annotators of a volume are told apart over an image: a colour, a form and initials each."""

import math
from collections.abc import Container, Iterable, Sequence
from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap, QPolygonF

from annotations.agreement.report.palette import numbered_look

MARK_RADIUS_PX = 4.5
"""Smaller than a keypoint of one's own, and no disc: nobody takes one for the other."""

LABEL_REACH_PX = 18.0
"""Marks nearer together than this share one label."""

_HALO = QColor(0, 0, 0, 200)
# On paper it is black.
_BLACK_ON_DARK = QColor("#d0d4da")
_DARKEST_TEXT = 140
_NAME = QColor("#f4f6f8")

Word = tuple[str, int | None]
"""Initials with the annotator's place in the order, or the name of a keypoint with None."""


def _corners(count: int, first_deg: float, inner: float = 0.0) -> tuple[tuple[float, float], ...]:
    """Return a regular polygon with its first corner so far from the right, or a star with inner corners."""
    steps = 2 * count if inner else count
    radii = [inner if inner and step % 2 else 1.2 for step in range(steps)]
    turns = [math.radians(first_deg + 360 * step / steps) for step in range(steps)]
    return tuple((r * math.cos(turn), r * math.sin(turn)) for r, turn in zip(radii, turns, strict=True))


_FORMS = {
    "*": _corners(5, -90, inner=0.5),
    "s": _corners(4, -45),
    "^": _corners(3, -90),
    "D": _corners(4, -90),
    "v": _corners(3, 90),
    "P": _corners(4, 0, inner=0.35),
    "X": _corners(4, 45, inner=0.35),
    "<": _corners(3, 180),
    ">": _corners(3, 0),
    "p": _corners(5, -90),
    "h": _corners(6, -90),
}
"""By the report's name of the mark: corners around (0, 0), y downwards."""


# Each of hundreds of marks asks, in every frame.
@lru_cache(maxsize=64)
def annotator_color(number: int) -> QColor:
    """Return the colour of the annotator with a place in the order of all: the report's, for dark ground."""
    color = QColor(numbered_look(number).color)
    return color if color.lightness() else _BLACK_ON_DARK


@lru_cache(maxsize=64)
def text_color(number: int | None) -> QColor:
    """Return the colour in which an annotator's initials, or nobody's, can be read on dark ground."""
    if number is None:
        return _NAME
    color = annotator_color(number)
    return color.lighter(145) if color.lightness() < _DARKEST_TEXT else color


def paint_annotator_mark(
    painter: QPainter, center: QPointF, number: int, radius_px: float = MARK_RADIUS_PX, *, filled: bool = True
) -> None:
    """Paint the mark of the annotator with a place in the order; hollow where it is not near the plane."""
    form = _form(number, radius_px).translated(center)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(_pen(_HALO, 3.5))
    painter.drawPolygon(form)
    if filled:
        painter.setBrush(annotator_color(number))
    painter.setPen(_pen(text_color(number), 1.3))
    painter.drawPolygon(form)


def annotator_swatch(number: int) -> QIcon:
    """Return the mark as an icon for lists, on their light or dark ground."""
    pixmap = QPixmap(32, 32)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    paint_annotator_mark(painter, QPointF(16, 16), number, 10.0)
    painter.end()
    return QIcon(pixmap)


def gathered(
    places: Sequence[tuple[float, float]], reach_px: float = LABEL_REACH_PX
) -> tuple[tuple[int, ...], ...]:
    """Return which marks share a label: indices of those near the first one of their group, all once.

    Parameters
    ----------
    places : sequence of (float, float)
        In pixels.
    """
    groups: list[list[int]] = []
    for index, place in enumerate(places):
        for group in groups:
            if math.dist(places[group[0]], place) <= reach_px:
                group.append(index)
                break
        else:
            groups.append([index])
    return tuple(tuple(group) for group in groups)


def label_words(marks: Iterable[tuple[str, str, int]], unnamed: Container[str]) -> tuple[Word, ...]:
    """Return what stands beside marks that lie together: keypoints that nothing else names, then initials.

    Parameters
    ----------
    marks : iterable of (str, str, int)
        Keypoint, initials and place in the order of each mark's annotator.
    unnamed : container of str
        The keypoints that are to be named.
    """
    known = list(marks)
    names: list[Word] = [(keypoint, None) for keypoint, _, _ in known if keypoint in unnamed]
    return tuple(dict.fromkeys([*names, *((initials, number) for _, initials, number in known)]))


def covered(places: Sequence[tuple[float, float]]) -> QRectF:
    """Return what marks at some places, in pixels, cover."""
    left, top = (min(each) - MARK_RADIUS_PX for each in zip(*places, strict=True))
    right, bottom = (max(each) + MARK_RADIUS_PX for each in zip(*places, strict=True))
    return QRectF(left, top, right - left, bottom - top)


@lru_cache(maxsize=64)
def _form(number: int, radius_px: float) -> QPolygonF:
    corners = _FORMS[numbered_look(number).marker]
    return QPolygonF([QPointF(x, y) * radius_px for x, y in corners])


def _pen(color: QColor, width_px: float) -> QPen:
    return QPen(color, width_px, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
