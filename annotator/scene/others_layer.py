"""The other annotators' keypoints and boxes in their colours, and lines that show how far all are apart."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import numpy as np
import vtk
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QFont, QImage, QPainter

from annotator.looks.annotator_marks import (
    MARK_RADIUS_PX,
    Word,
    annotator_color,
    covered,
    gathered,
    label_words,
    paint_annotator_mark,
    text_color,
)
from annotator.looks.label_places import label_area
from annotator.scene.colors import rgb
from annotator.scene.picking import Picture
from annotator.scene.pictures import BENEATH, Drawn, Pictures
from annotator.scene.segments import Segment, Segments, block_edges
from annotator.scene.solids_layer import corners_um
from annotator.scene.sprites import blank, paint_text, text_size_px
from annotator.session.agreement.differences import Difference
from annotator.session.agreement.others import OtherAnnotation

_MARK_PX = 4 * MARK_RADIUS_PX

Place = tuple[float, float]
Mark = tuple[OtherAnnotation, str, Place]
Look = tuple[Sequence[OtherAnnotation], Sequence[Difference], Picture, QFont, frozenset[str]]


class OthersLayer:
    """A small mark for each keypoint, initials beside those that lie together, and the edges of boxes."""

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._edges = Segments(width_px=1.5)
        self._lines = Segments(width_px=2)
        self._marks = Pictures(renderer, BENEATH)
        self._labels = Pictures(renderer, BENEATH)
        self._shown: Look | None = None
        self._lettered: tuple[QRectF, ...] = ()

    @property
    def lettered(self) -> tuple[QRectF, ...]:
        """What the initials cover."""
        return self._lettered

    @property
    def actors(self) -> tuple[vtk.vtkActor, ...]:
        """What has a place in space."""
        return (self._edges.actor, self._lines.actor)

    def show(
        self,
        others: Sequence[OtherAnnotation],
        lines: Sequence[Difference],
        picture: Picture,
        font: QFont,
        unnamed: frozenset[str] = frozenset(),
    ) -> None:
        """Draw these annotations and differences and no others; ``unnamed`` keypoints with their names."""
        wanted = (others, lines, picture, font, unnamed)
        if wanted == self._shown:
            return
        self._shown = wanted
        self._edges.show(_box_edges(others), picture.ratio)
        self._lines.show(_difference_lines(lines), picture.ratio)
        marks = list(_marks(others, picture))
        is_anew = self._marks.show([_drawn_mark(mark, picture) for mark in marks], picture)
        labels, self._lettered = _drawn_labels(marks, font, picture, unnamed)
        self._labels.show(labels, picture, raised=is_anew)


def _marks(others: Sequence[OtherAnnotation], picture: Picture) -> Iterator[Mark]:
    """Yield whose keypoints appear where, without those behind the eye."""
    owners = [(other, name) for other in others for name in other.positions_um]
    positions_um = [position_um for other in others for position_um in other.positions_um.values()]
    for (owner, name), place in zip(owners, picture.project(positions_um), strict=True):
        if not np.isnan(place).any():
            yield owner, name, (float(place[0]), float(place[1]))


def _drawn_mark(mark: Mark, picture: Picture) -> Drawn:
    owner, _, (x, y) = mark
    paint = partial(mark_picture, owner.number, picture.ratio)
    return (owner.number, picture.ratio), paint, (x - _MARK_PX / 2, y - _MARK_PX / 2)


def _drawn_labels(
    marks: Sequence[Mark], font: QFont, picture: Picture, unnamed: frozenset[str]
) -> tuple[list[Drawn], tuple[QRectF, ...]]:
    """Return the initials of those whose marks lie together, and what they cover."""
    labels: list[Drawn] = []
    taken: list[QRectF] = []
    whole = QRectF(0, 0, picture.width_px, picture.height_px)
    for group in gathered([place for _, _, place in marks]):
        together = [marks[index] for index in group]
        letters = label_words([(name, owner.initials, owner.number) for owner, name, _ in together], unnamed)
        widths_px, heights_px = zip(*(text_size_px(text, font) for text, _ in letters), strict=True)
        around = covered([place for _, _, place in together])
        taken.append(label_area(around, sum(widths_px), max(heights_px), taken, whole))
        key = (letters, font.key(), picture.ratio)
        paint = partial(initials_picture, letters, font, picture.ratio)
        labels.append((key, paint, (taken[-1].left(), taken[-1].top())))
    return labels, tuple(taken)


def mark_picture(number: int, ratio: float) -> QImage:
    """Paint the mark of the annotator with a place in the order of all."""
    image = blank(_MARK_PX, _MARK_PX, ratio)
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paint_annotator_mark(painter, QPointF(_MARK_PX / 2, _MARK_PX / 2), number)
    return image


def initials_picture(letters: Sequence[Word], font: QFont, ratio: float) -> QImage:
    """Paint initials side by side, each in the colour of its annotator's place in the order."""
    widths_px = [text_size_px(text, font)[0] for text, _ in letters]
    image = blank(sum(widths_px), text_size_px("", font)[1], ratio)
    left_px = 0.0
    with QPainter(image) as painter:
        for (text, number), width_px in zip(letters, widths_px, strict=True):
            paint_text(painter, left_px, 0, text, font, text_color(number))
            left_px += width_px
    return image


def _box_edges(others: Iterable[OtherAnnotation]) -> Iterator[Segment]:
    for other in others:
        for box in other.boxes.values():
            yield from block_edges(corners_um(box), rgb(annotator_color(other.number)))


def _difference_lines(lines: Iterable[Difference]) -> Iterator[Segment]:
    for line in lines:
        yield Segment(line.position_um, line.reference_um, rgb(text_color(line.number)))
