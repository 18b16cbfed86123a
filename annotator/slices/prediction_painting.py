"""Draws a prediction beside the truth over a slice: heatmaps, bodies, marks, and how far all are off."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from annotations.geometry.frames import Vector, vector
from annotator.looks.label_places import label_areas
from annotator.looks.prediction_marks import (
    LINE_WIDTH_PX,
    REVIEW_LOOKS,
    covered,
    label_text,
    legend_place,
    paint_legend,
    paint_prediction,
    paint_truth,
)
from annotator.session.predictions.drawn_prediction import DrawnPrediction
from annotator.slices.captions import PADDING_PX, paint_caption
from annotator.slices.guides import INK
from annotator.slices.marks import nearness
from annotator.slices.outline_painting import paint_outlines
from annotator.slices.overlays import FAR_OPACITY, OUTLINE, split_at_plane
from annotator.slices.solid_outlines import solid_outlines
from annotator.slices.viewport import Viewport

if TYPE_CHECKING:
    # Half a second that only those wait for who predict.
    from annotations.prediction.heatmap_cloud import HeatmapCloud

_EDGE_OPACITY, _PEAK_OPACITY = 0.2, 0.55
"""Of a heatmap where 95 % of it begin, and where it is highest."""
_FAINTEST_WORDS = 0.65
_CORNER = Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft


@dataclass(frozen=True)
class ReviewMark:
    """Where a keypoint is, or is predicted, on a slice.

    Attributes
    ----------
    x, y : float
        Its projection onto the plane, in pixels of the widget.
    nearness : float
        As for `annotator.slices.marks.Mark`.
    """

    x: float
    y: float
    nearness: float

    @property
    def center(self) -> QPointF:
        """Where it is drawn."""
        return QPointF(self.x, self.y)

    @property
    def opacity(self) -> float:
        """How firmly it is drawn."""
        return FAR_OPACITY + (1 - FAR_OPACITY) * self.nearness


class PredictionPainter:
    """What is left of a prediction on the plane with an index, worked out once."""

    def __init__(self, prediction: DrawnPrediction, viewport: Viewport, index: int) -> None:
        self._prediction, self._viewport, self._index = prediction, viewport, index
        area = viewport.area
        self._whole = QRectF(area.left, area.top, area.width, area.height)
        self._look = REVIEW_LOOKS[prediction.colors]
        self._true = review_marks(prediction.true_um, viewport, index)
        self._predicted = review_marks(prediction.predicted_um, viewport, index)
        solids = prediction.solids_in(self._look.prediction.name())
        self._outlines = solid_outlines(solids, viewport, index)
        tints = (tint(cloud, viewport, index, self._look.prediction) for cloud in prediction.heatmap_clouds())
        self._tints = tuple(each for each in tints if each is not None)

    @property
    def named(self) -> frozenset[str]:
        """The keypoints that are named in place of one's own marks."""
        return self._prediction.named

    def paint_beneath(self, painter: QPainter) -> None:
        """Draw what one's own keypoints lie on: heatmaps, bodies, and rings around where keypoints are."""
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        for image, area in self._tints:
            painter.drawImage(area, image)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
        paint_outlines(painter, self._outlines, names=False, posing=False)
        for mark in self._true:
            painter.setOpacity(mark.opacity)
            paint_truth(painter, mark.center, self._look.truth, faint=not mark.nearness)
        painter.setOpacity(1.0)

    def paint_above(self, painter: QPainter, named: Iterable[QRectF] = ()) -> None:
        """Draw what lies over one's own keypoints: lines, crosses, distances, clear of what is ``named``."""
        self._paint_lines(painter)
        for mark in sorted(self._predicted, key=lambda one: one.nearness):
            painter.setOpacity(mark.opacity)
            paint_prediction(painter, mark.center, self._look.prediction, faint=not mark.nearness)
        painter.setOpacity(1.0)
        self._paint_labels(painter, named)

    def paint_legend(self, painter: QPainter) -> None:
        """Write what each sign means, in the lower left corner."""
        font = painter.font()
        entries, area = legend_place(self._prediction.legend, font, self._whole, at_top=False)
        paint_legend(painter, area, entries, self._look, font)

    def _paint_lines(self, painter: QPainter) -> None:
        parts = [split_at_plane(self._viewport, self._index, *ends) for ends in self._prediction.lines_um]
        for place, opacity in ((1, FAR_OPACITY), (0, 1.0)):
            lines = [QLineF(QPointF(*first), QPointF(*last)) for part in parts for first, last in part[place]]
            painter.setOpacity(opacity)
            for pen in (QPen(OUTLINE, LINE_WIDTH_PX + 2), QPen(self._look.prediction, LINE_WIDTH_PX)):
                painter.setPen(pen)
                painter.drawLines(lines)
        painter.setOpacity(1.0)

    def _paint_labels(self, painter: QPainter, named: Iterable[QRectF]) -> None:
        whole, metrics = self._whole, painter.fontMetrics()
        shown, wanted = [], []
        for label in self._prediction.labels:
            marks = review_marks(label.places_um, self._viewport, self._index)
            # One of a pair may be out of view, as where a keypoint is predicted beyond the volume.
            marks = tuple(mark for mark in marks if whole.contains(mark.center))
            if marks:
                text = label_text(label.name, label.distance_um)
                width_px = metrics.horizontalAdvance(text) + 2 * PADDING_PX
                shown.append((text, max(marks[0].opacity, _FAINTEST_WORDS)))
                wanted.append(
                    (covered([(mark.x, mark.y) for mark in marks]), width_px, metrics.height() + PADDING_PX)
                )
        taken = [*named, *(covered([(mark.x, mark.y)]) for mark in (*self._true, *self._predicted))]
        for (text, opacity), place in zip(shown, label_areas(wanted, taken, whole), strict=True):
            painter.setOpacity(opacity)
            paint_caption(painter, place.topLeft(), text, INK, _CORNER)
        painter.setOpacity(1.0)


def review_marks(positions_um: Iterable[Vector], viewport: Viewport, index: int) -> tuple[ReviewMark, ...]:
    """Return keypoints as the plane with an index shows them."""
    plane = viewport.plane
    half_um = plane.spacing_um[plane.axis] / 2
    return tuple(
        ReviewMark(*viewport.pixel(position_um), nearness(plane.distance_um(position_um, index), half_um))
        for position_um in positions_um
    )


def tint(
    cloud: "HeatmapCloud", viewport: Viewport, index: int, color: QColor
) -> tuple[QImage, QRectF] | None:
    """Return a heatmap where a plane cuts it, and what of the widget it covers; None where none does.

    It begins where the surface is that the scene draws around 95 % of it.
    """
    plane = viewport.plane
    place = (plane.depth_um(index) - cloud.origin_um[plane.axis]) / cloud.spacing_um[plane.axis]
    if not 0 <= place <= cloud.likelihood.shape[plane.axis] - 1:
        return None
    before = min(int(place), cloud.likelihood.shape[plane.axis] - 2)
    first, second = (cloud.likelihood.take(at, axis=plane.axis) for at in (before, before + 1))
    section = first + (place - before) * (second - first)
    if plane.is_transposed:
        section = section.T
    if section.max() < cloud.most:
        return None
    width = max(float(cloud.likelihood.max()) - cloud.most, 1e-12)
    height = np.sqrt(np.clip((section - cloud.most) / width, 0, 1))
    opacity = np.where(section >= cloud.most, _EDGE_OPACITY + (_PEAK_OPACITY - _EDGE_OPACITY) * height, 0)
    premultiplied = opacity[..., None] * (color.blue(), color.green(), color.red(), 255)
    pixels = np.ascontiguousarray(np.rint(premultiplied).astype(np.uint8))
    rows, columns = section.shape
    image = QImage(pixels.data, columns, rows, 4 * columns, QImage.Format.Format_ARGB32_Premultiplied)
    low, high = (
        vector(np.add(cloud.origin_um, np.multiply(ends, cloud.spacing_um)))
        for ends in (np.full(3, -0.5), np.array(cloud.likelihood.shape) - 0.5)
    )
    # The copy outlives the array.
    return image.copy(), QRectF(QPointF(*viewport.pixel(low)), QPointF(*viewport.pixel(high)))
