"""A prediction beside the truth: marks, lines between them, names and distances, and what each sign means."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import vtk
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QFont, QImage, QPainter

from annotations.geometry.frames import Vector
from annotator.looks.label_places import label_areas
from annotator.looks.prediction_marks import (
    LINE_WIDTH_PX,
    REVIEW_LOOKS,
    RING_RADIUS_PX,
    Entry,
    ReviewLook,
    covered,
    label_text,
    legend_place,
    paint_legend,
    paint_prediction,
    paint_truth,
)
from annotator.scene.colors import TEXT, rgb
from annotator.scene.heatmap_layer import HeatmapLayer
from annotator.scene.picking import Picture
from annotator.scene.pictures import ABOVE, BENEATH, Drawn, Pictures
from annotator.scene.segments import Segment, Segments
from annotator.scene.sprites import blank, text_picture, text_size_px
from annotator.session.editing.solids import Solid
from annotator.session.predictions.drawn_prediction import DrawnPrediction

_MARK_PX = 2 * RING_RADIUS_PX + 6
_NOTHING = DrawnPrediction("green_red")

_PaintMark = Callable[[QPainter, QPointF, QColor], None]


class PredictionLayer:
    """Rings under one's own keypoints, crosses over them, and a legend in the upper left corner.

    The bodies of a prediction are drawn with all others, by `SolidsLayer`.
    """

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._lines = Segments(LINE_WIDTH_PX)
        self._heatmaps = HeatmapLayer()
        self._rings = Pictures(renderer, BENEATH)
        self._crosses = Pictures(renderer, ABOVE)
        self._labels = Pictures(renderer, ABOVE)
        self._legend = Pictures(renderer, ABOVE)
        self._shown: tuple[DrawnPrediction, Picture, QFont, Sequence[QRectF]] | None = None

    @property
    def actors(self) -> tuple[vtk.vtkActor, ...]:
        """What has a place in space."""
        return (*self._heatmaps.actors, self._lines.actor)

    def show(
        self, prediction: DrawnPrediction | None, picture: Picture, font: QFont, taken: Sequence[QRectF] = ()
    ) -> None:
        """Draw what is left of a prediction, or nothing; no words stand where it is ``taken``."""
        drawn = prediction or _NOTHING
        wanted = (drawn, picture, font, taken)
        if wanted == self._shown:
            return
        self._shown = wanted
        look, ratio = REVIEW_LOOKS[drawn.colors], picture.ratio
        color = rgb(look.prediction)
        self._lines.show((Segment(*ends_um, color) for ends_um in drawn.lines_um), ratio)
        self._heatmaps.show(drawn.heatmap_clouds(), look.prediction)
        rings = _places(drawn.true_um, picture)
        crosses = _places(drawn.predicted_um, picture)
        self._rings.show([_mark(place, paint_truth, look.truth, ratio) for place in rings], picture)
        over = [_mark(place, paint_prediction, look.prediction, ratio) for place in crosses]
        is_anew = self._crosses.show(over, picture)
        entries, area = legend_place(drawn.legend, font, QRectF(0, 0, picture.width_px, picture.height_px))
        marked = (covered([place]) for place in (*rings, *crosses))
        labels = list(_labels(drawn, [*taken, *marked, area], picture, font))
        is_anew = self._labels.show(labels, picture, raised=is_anew)
        self._legend.show(list(_legend(entries, area, look, font, ratio)), picture, raised=is_anew)


def review_solids(prediction: DrawnPrediction) -> tuple[Solid, ...]:
    """Return the bodies of a prediction in its colour."""
    return prediction.solids_in(REVIEW_LOOKS[prediction.colors].prediction.name())


def _places(positions_um: Sequence[Vector], picture: Picture) -> list[tuple[float, float]]:
    """Return where positions appear, without those behind the eye."""
    places = picture.project(positions_um)
    return [(float(x), float(y)) for x, y, _ in places if not np.isnan((x, y)).any()]


def _mark(place: tuple[float, float], paint: _PaintMark, color: QColor, ratio: float) -> Drawn:
    key = (paint.__name__, color.rgba(), ratio)
    return key, partial(mark_picture, paint, color, ratio), (place[0] - _MARK_PX / 2, place[1] - _MARK_PX / 2)


def mark_picture(paint: _PaintMark, color: QColor, ratio: float) -> QImage:
    """Paint a mark of its own."""
    image = blank(_MARK_PX, _MARK_PX, ratio)
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paint(painter, QPointF(_MARK_PX / 2, _MARK_PX / 2), color)
    return image


def _labels(
    drawn: DrawnPrediction, taken: Sequence[QRectF], picture: Picture, font: QFont
) -> Iterator[Drawn]:
    """Yield the names and distances that stand beside marks in sight."""
    whole = QRectF(0, 0, picture.width_px, picture.height_px)
    texts, wanted = [], []
    for label in drawn.labels:
        # One of a pair may be out of view, as where a keypoint is predicted beyond the volume.
        places = [place for place in _places(label.places_um, picture) if whole.contains(QPointF(*place))]
        if places:
            text = label_text(label.name, label.distance_um)
            texts.append(text)
            wanted.append((covered(places), *text_size_px(text, font)))
    for text, area in zip(texts, label_areas(wanted, taken, whole), strict=True):
        key = (text, font.key(), picture.ratio)
        yield key, partial(text_picture, text, font, TEXT, picture.ratio), (area.left(), area.top())


def _legend(
    entries: Sequence[Entry], area: QRectF, look: ReviewLook, font: QFont, ratio: float
) -> Iterator[Drawn]:
    if entries:
        key = (tuple(entries), look.prediction.rgba(), font.key(), ratio, area.width())
        yield key, partial(legend_picture, entries, area, look, font, ratio), (area.left(), area.top())


def legend_picture(
    entries: Sequence[Entry], area: QRectF, look: ReviewLook, font: QFont, ratio: float
) -> QImage:
    """Paint what the signs mean."""
    image = blank(area.width(), area.height(), ratio)
    with QPainter(image) as painter:
        paint_legend(painter, QRectF(QPointF(), area.size()), entries, look, font)
    return image
