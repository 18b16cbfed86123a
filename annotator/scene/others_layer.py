"""The other annotators' keypoints and boxes in their colours, and lines that show how far all are apart."""

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np
import vtk
from PySide6.QtCore import QPointF
from PySide6.QtGui import QFont, QImage, QPainter

from annotator.looks.annotator_marks import (
    MARK_RADIUS_PX,
    annotator_color,
    gathered,
    paint_annotator_mark,
    text_color,
)
from annotator.scene.colors import rgb
from annotator.scene.picking import Picture
from annotator.scene.segments import Segment, Segments, block_edges
from annotator.scene.solids_layer import corners_um
from annotator.scene.sprites import Sprite, blank, paint_text, text_size_px
from annotator.session.differences import Difference
from annotator.session.others import OtherAnnotation

_MARK_PX = 4 * MARK_RADIUS_PX
_GAP_PX = 8.0
# Under one's own keypoints and their names, which count from 0.
_BENEATH = -1

Place = tuple[float, float]
Look = tuple[Sequence[OtherAnnotation], Sequence[Difference], Picture, QFont]


class OthersLayer:
    """A small mark for each keypoint, initials beside those that lie together, and the edges of boxes."""

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._edges = Segments(width_px=1.5)
        self._lines = Segments(width_px=2)
        self._marks = _Pictures(renderer)
        self._labels = _Pictures(renderer)
        self._shown: Look | None = None

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
    ) -> None:
        """Draw these annotations and differences and no others."""
        wanted = (others, lines, picture, font)
        if wanted == self._shown:
            return
        self._shown = wanted
        self._edges.show(_box_edges(others), picture.ratio)
        self._lines.show(_difference_lines(lines), picture.ratio)
        marks, labels = [], []
        for at in _places_by_keypoint(others, picture):
            marks += at
            labels += [[at[index] for index in group] for group in gathered([place for _, place in at])]
        self._marks.show([_mark(owner, place, picture) for owner, place in marks], picture)
        self._labels.show([_label(group, font, picture) for group in labels], picture)


class _Pictures:
    """Sprites that are painted anew only where they show something else: most of the time they just move."""

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._renderer = renderer
        self._sprites: list[Sprite] = []
        self._painted: list[Hashable] = []

    def show(self, wanted: Sequence[tuple[Hashable, Callable[[], QImage], Place]], picture: Picture) -> None:
        """Show pictures, each with what it depends on, how it is painted, and its upper left corner."""
        while len(self._sprites) > len(wanted):
            self._renderer.RemoveViewProp(self._sprites.pop().actor)
            self._painted.pop()
        while len(self._sprites) < len(wanted):
            sprite = Sprite()
            sprite.actor.SetLayerNumber(_BENEATH)
            self._renderer.AddViewProp(sprite.actor)
            self._sprites.append(sprite)
            self._painted.append(None)
        for index, (key, paint, (left_px, top_px)) in enumerate(wanted):
            if key != self._painted[index]:
                self._sprites[index].paint(paint())
                self._painted[index] = key
            self._sprites[index].place(left_px, top_px, picture.height_px)


def _places_by_keypoint(
    others: Sequence[OtherAnnotation], picture: Picture
) -> Iterator[list[tuple[OtherAnnotation, Place]]]:
    """Yield for each keypoint whose it is and where it appears, without what is behind the eye."""
    for name in dict.fromkeys(name for other in others for name in other.positions_um):
        owners = [other for other in others if name in other.positions_um]
        places = picture.project([other.positions_um[name] for other in owners])
        yield [
            (owner, (float(place[0]), float(place[1])))
            for owner, place in zip(owners, places, strict=True)
            if not np.isnan(place).any()
        ]


def _mark(
    owner: OtherAnnotation, place: Place, picture: Picture
) -> tuple[Hashable, Callable[[], QImage], Place]:
    corner = (place[0] - _MARK_PX / 2, place[1] - _MARK_PX / 2)
    return (owner.number, picture.ratio), partial(mark_picture, owner.number, picture.ratio), corner


def _label(
    group: Sequence[tuple[OtherAnnotation, Place]], font: QFont, picture: Picture
) -> tuple[Hashable, Callable[[], QImage], Place]:
    """Return the initials of those that lie together: to the lower left, where no name of one's own is."""
    letters = tuple((owner.initials, owner.number) for owner, _ in group)
    width_px = sum(text_size_px(text, font)[0] for text, _ in letters)
    left_px = min(place[0] for _, place in group) - _GAP_PX - width_px
    top_px = max(place[1] for _, place in group)
    key = (letters, font.key(), picture.ratio)
    return key, partial(initials_picture, letters, font, picture.ratio), (left_px, top_px)


def mark_picture(number: int, ratio: float) -> QImage:
    """Paint the mark of the annotator with a place in the order of all."""
    image = blank(_MARK_PX, _MARK_PX, ratio)
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paint_annotator_mark(painter, QPointF(_MARK_PX / 2, _MARK_PX / 2), number)
    return image


def initials_picture(letters: Sequence[tuple[str, int]], font: QFont, ratio: float) -> QImage:
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
