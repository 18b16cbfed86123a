"""How truth and prediction are told apart over an image: by colour and by form."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPen

RING_RADIUS_PX = 12.5
"""Of the truth: around a keypoint of one's own, and the ring around the active one."""
CROSS_PX = 5.5
"""From the middle of the prediction's cross to its ends, along each axis."""
LINE_WIDTH_PX = 2.0

_DOT_PX = 1.6
_COVERED_PX = 9.0  # of a mark to each side: what a ring leaves free in its corners is room for words
_NEAR_PX = 40.0
_HALO = QColor(0, 0, 0, 200)
_GROUND = QColor(0, 0, 0, 150)
_INK = QColor("#f4f6f8")
_SIGN_PX = 20.0
_PADDING_PX = 4.0
_MARGIN_PX = 5.0
_LARGEST_LEGEND, _FEWEST_ENTRIES = 0.22, 2
"""Of the height of a picture, and how many are written at least."""
_CLOUD_OPACITIES = (0.3, 0.5)

Entry = tuple[str, str]
"""A sign, as `annotator.session.predictions.drawn_prediction.Sign`, and its meaning."""


@dataclass(frozen=True)
class ReviewLook:
    """The colours of a review, for dark ground and for the images on it."""

    truth: QColor
    prediction: QColor


REVIEW_LOOKS: Mapping[str, ReviewLook] = {
    "green_red": ReviewLook(QColor("#3ddc6b"), QColor("#ff5a52")),
    "blue_orange": ReviewLook(QColor("#56b4e9"), QColor("#ff9d1c")),
}
"""By `annotator.session.viewing.view.ReviewColors`; the second ones are close to those of Okabe and Ito."""


def paint_truth(painter: QPainter, center: QPointF, color: QColor, *, faint: bool = False) -> None:
    """Paint where a keypoint is in truth: a ring with a dot; dashed where it is not near the plane."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    dashes = Qt.PenStyle.DashLine if faint else Qt.PenStyle.SolidLine
    for pen in (_pen(_HALO, 4.0), QPen(color, 2.0, dashes, Qt.PenCapStyle.FlatCap)):
        painter.setPen(pen)
        painter.drawEllipse(center, RING_RADIUS_PX, RING_RADIUS_PX)
    for pen in (_pen(_HALO, 2 * _DOT_PX + 2), _pen(color, 2 * _DOT_PX)):
        painter.setPen(pen)
        painter.drawPoint(center)


def paint_prediction(painter: QPainter, center: QPointF, color: QColor, *, faint: bool = False) -> None:
    """Paint where a keypoint is predicted: a cross; thin where it is not near the plane."""
    arms = []
    for turn in (1, -1):
        arm = QPointF(CROSS_PX, turn * CROSS_PX)
        arms.append(QLineF(center - arm, center + arm))
    width_px = 1.4 if faint else 2.6
    for pen in (_pen(_HALO, width_px + 2.4), _pen(color, width_px)):
        painter.setPen(pen)
        painter.drawLines(arms)


def distance_text(distance_um: float) -> str:
    """Return how far a prediction is off: in mm from 1 mm on, else in µm."""
    return f"{distance_um / 1000:.2f} mm" if round(distance_um) >= 1000 else f"{distance_um:.0f} µm"


def label_text(name: str, distance_um: float | None) -> str:
    """Return what stands beside a pair of marks."""
    return " ".join(
        part for part in (name, "" if distance_um is None else distance_text(distance_um)) if part
    )


def covered(places: Sequence[tuple[float, float]]) -> QRectF:
    """Return what the marks cover that words are to stand beside: the first one's, and others near to it.

    Parameters
    ----------
    places : sequence of (float, float)
        Where marks are, in pixels.
    """
    near = [place for place in places if math.dist(place, places[0]) <= _NEAR_PX]
    left, top = (min(each) - _COVERED_PX for each in zip(*near, strict=True))
    right, bottom = (max(each) + _COVERED_PX for each in zip(*near, strict=True))
    return QRectF(left, top, right - left, bottom - top)


def legend_place(
    entries: Sequence[Entry], font: QFont, picture: QRectF, *, at_top: bool = True
) -> tuple[Sequence[Entry], QRectF]:
    """Return which entries of a legend have room in a corner at the left, and what of the picture they take.

    Parameters
    ----------
    entries : sequence of (str, str)
        The first ones are kept where there is not room for all.
    """
    line_px = _line_px(font)
    kept = entries[: max(_FEWEST_ENTRIES, int(_LARGEST_LEGEND * picture.height() / line_px))]
    metrics = QFontMetricsF(font)
    widest = max((metrics.horizontalAdvance(text) for _, text in kept), default=0.0)
    width = min(_SIGN_PX + widest + 3 * _PADDING_PX + 1, picture.width() - 2 * _MARGIN_PX)
    height = len(kept) * line_px + 2 * _PADDING_PX if kept else 0.0
    top = picture.top() + _MARGIN_PX if at_top else picture.bottom() - _MARGIN_PX - height
    return kept, QRectF(picture.left() + _MARGIN_PX, top, width, height)


def paint_legend(
    painter: QPainter, area: QRectF, entries: Sequence[Entry], look: ReviewLook, font: QFont
) -> None:
    """Write what each sign stands for; what is too long loses its middle.

    Parameters
    ----------
    area : QRectF
        As `legend_place` has told.
    entries : sequence of (str, str)
    """
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(_GROUND)
    painter.drawRoundedRect(area, 3.0, 3.0)
    painter.setFont(font)
    metrics, line_px = QFontMetricsF(font), _line_px(font)
    left = area.left() + _SIGN_PX + 2 * _PADDING_PX
    room_px = area.right() - _PADDING_PX - left
    for place, (sign, text) in enumerate(entries):
        line = QRectF(left, area.top() + _PADDING_PX + place * line_px, room_px + 1, line_px)
        _paint_sign(painter, QPointF(area.left() + _PADDING_PX + _SIGN_PX / 2, line.center().y()), sign, look)
        painter.setPen(_INK)
        shown = metrics.elidedText(text, Qt.TextElideMode.ElideMiddle, room_px + 0.5)
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, shown)


def _paint_sign(painter: QPainter, center: QPointF, sign: str, look: ReviewLook) -> None:
    if sign in ("truth", "prediction"):
        painter.save()
        painter.translate(center)
        painter.scale(0.62, 0.62)
        paint = paint_truth if sign == "truth" else paint_prediction
        paint(painter, QPointF(), look.truth if sign == "truth" else look.prediction)
        painter.restore()
    elif sign == "error":
        painter.setPen(_pen(look.prediction, LINE_WIDTH_PX))
        painter.drawLine(QLineF(center - QPointF(7, 0), center + QPointF(7, 0)))
    elif sign == "tool":
        painter.setPen(_pen(look.prediction, 1.0))
        painter.setBrush(_faint(look.prediction, 0.15))
        painter.drawRoundedRect(QRectF(center.x() - 7, center.y() - 3.5, 14, 7), 2, 2)
    else:
        painter.setPen(Qt.PenStyle.NoPen)
        for radius_px, opacity in zip((7.0, 4.0), _CLOUD_OPACITIES, strict=True):
            painter.setBrush(_faint(look.prediction, opacity))
            painter.drawEllipse(center, radius_px, radius_px)


def _line_px(font: QFont) -> float:
    return max(QFontMetricsF(font).height(), RING_RADIUS_PX * 1.5)


def _faint(color: QColor, opacity: float) -> QColor:
    faint = QColor(color)
    faint.setAlphaF(opacity)
    return faint


def _pen(color: QColor, width_px: float) -> QPen:
    return QPen(color, width_px, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
