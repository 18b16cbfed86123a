"""Keypoints as spheres of constant size on the screen, with their names beside them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import vtk
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QImage, QPainter, QPen, QRadialGradient

from annotator.scene.colors import ACTIVE, TEXT
from annotator.scene.picking import SPHERE_PX, Picture
from annotator.scene.sprites import Sprite, blank, text_picture, text_size_px
from annotator.session.editing.keypoint_marks import KeypointMark

_MARKER_PX = 28.0  # the sphere, and room for the ring round the active one
_RING_PX = 4.0
_GAP_PX = 2.0


class KeypointsLayer:
    """A marker and a name for each keypoint that has a position; the nearest one lies on top."""

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._renderer = renderer
        self._drawn: dict[str, _DrawnKeypoint] = {}
        self._shown: object = None
        self._named: tuple[QRectF, ...] = ()

    @property
    def named(self) -> tuple[QRectF, ...]:
        """Where names stand, in Qt's pixels."""
        return self._named

    def show(
        self,
        marks: Sequence[KeypointMark],
        picture: Picture,
        font: QFont,
        *,
        names: bool,
        clear_px: float = SPHERE_PX / 2,
        unnamed: frozenset[str] = frozenset(),
    ) -> None:
        """Draw these keypoints and no others, with their names.

        Parameters
        ----------
        clear_px : float
            How far from a keypoint's middle a name is at least.
        unnamed : frozenset of str
            The keypoints that are named otherwise.
        """
        wanted = (tuple(marks), picture, font, names, clear_px, unnamed)
        if wanted == self._shown:
            return
        self._shown = wanted
        for name in self._drawn.keys() - {mark.name for mark in marks}:
            for sprite in self._drawn.pop(name).sprites:
                self._renderer.RemoveViewProp(sprite.actor)
        places = picture.project([mark.position_um for mark in marks])
        markers = [_marker_place(mark, place, clear_px) for mark, place in zip(marks, places, strict=True)]
        taken: list[QRectF] = []
        # The farthest first; what has a higher layer number is drawn later.
        for layer, index in enumerate(np.argsort(-places[:, 2])):
            mark, place = marks[index], places[index]
            if mark.name not in self._drawn:
                self._drawn[mark.name] = _DrawnKeypoint()
                for sprite in self._drawn[mark.name].sprites:
                    self._renderer.AddViewProp(sprite.actor)
            label = None
            if names and mark.name not in unnamed and not np.isnan(place).any():
                size_px = text_size_px(_text(mark), font)
                label = label_place(markers[index], size_px, [*markers, *taken])
                taken.append(label)
            self._drawn[mark.name].show(mark, place, label, layer, picture, font)
        self._named = tuple(taken)


class _DrawnKeypoint:
    def __init__(self) -> None:
        self._marker = Sprite()
        self._name = Sprite()
        self._painted: tuple[KeypointMark, float, QFont] | None = None

    @property
    def sprites(self) -> tuple[Sprite, Sprite]:
        return (self._marker, self._name)

    def show(
        self,
        mark: KeypointMark,
        place: Sequence[float],
        label: QRectF | None,
        layer: int,
        picture: Picture,
        font: QFont,
    ) -> None:
        # Wherever it is, it is the same picture.
        wanted = (replace(mark, position_um=(0.0, 0.0, 0.0)), picture.ratio, font)
        if wanted != self._painted:
            self._painted = wanted
            self._marker.paint(marker_picture(mark, font, picture.ratio))
            self._name.paint(text_picture(_text(mark), font, TEXT, picture.ratio))
        if np.isnan(place).any():
            self._marker.hide()
        else:
            left_px, top_px = place[0] - _MARKER_PX / 2, place[1] - _MARKER_PX / 2
            self._marker.place(left_px, top_px, picture.height_px)
            self._marker.actor.SetLayerNumber(2 * layer)
        if label is None:
            self._name.hide()
        else:
            self._name.place(label.left(), label.top(), picture.height_px)
            self._name.actor.SetLayerNumber(2 * layer + 1)


def label_place(marker: QRectF, size_px: tuple[float, float], taken: Sequence[QRectF]) -> QRectF:
    """Return where a name stands: beside its sphere, and if it can on nothing that is already there.

    Parameters
    ----------
    marker : QRectF
        Where the sphere is, in Qt's pixels.
    size_px : (float, float)
        Width and height of the name.
    taken : sequence of QRectF
        Every sphere, and the names that have their places.
    """
    width, height = size_px
    x, y = marker.center().x(), marker.center().y()
    away = marker.width() / 2 + _GAP_PX
    choices = [
        QRectF(x + away, y - height / 2, width, height),
        QRectF(x - away - width, y - height / 2, width, height),
        QRectF(x - width / 2, y - away - height, width, height),
        QRectF(x - width / 2, y + away, width, height),
        QRectF(x + away, y - away - height, width, height),
        QRectF(x + away, y + away, width, height),
        QRectF(x - away - width, y - away - height, width, height),
        QRectF(x - away - width, y + away, width, height),
    ]
    overlaps = []
    for choice in choices:
        overlaps.append(sum(_overlap(choice, other) for other in taken))
        if not overlaps[-1]:
            return choice
    return choices[overlaps.index(min(overlaps))]


def marker_picture(mark: KeypointMark, font: QFont, ratio: float) -> QImage:
    """Paint a keypoint: what it is like shows in its form, not in its colour alone."""
    image = blank(_MARKER_PX, _MARKER_PX, ratio)
    middle, radius = QPointF(_MARKER_PX / 2, _MARKER_PX / 2), SPHERE_PX / 2
    color = QColor(mark.color)
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if mark.preview:
            dotted = QPen(color, 2.5, Qt.PenStyle.DotLine)
            _outline(painter, "circle", middle, radius + _RING_PX, dotted, around=True)
            painter.setPen(QPen(QColor("black"), 1))
            painter.setBrush(color)
            painter.drawEllipse(middle, 3, 3)
        elif mark.state == "out_of_view":
            _outline(painter, "square", middle, radius - 0.5, QPen(color, 2))
        elif mark.state == "occluded":
            painter.setBrush(QColor(color.red(), color.green(), color.blue(), 70))
            _outline(painter, "circle", middle, radius - 0.5, QPen(color, 2))
        else:
            _sphere(painter, middle, radius, color.lighter(135) if mark.unsure else color, hazy=mark.unsure)
        if mark.unsure:
            small = QFont(font)
            small.setBold(True)
            small.setPixelSize(11)
            painter.setFont(small)
            painter.setPen(QColor("black") if mark.state == "placed" and not mark.preview else TEXT)
            whole = QRectF(0, 0, _MARKER_PX, _MARKER_PX)
            painter.drawText(whole, Qt.AlignmentFlag.AlignCenter, "?")
        if mark.active and not mark.preview:
            _outline(painter, "circle", middle, radius + _RING_PX, QPen(ACTIVE, 1.75), around=True)
    return image


def _sphere(painter: QPainter, middle: QPointF, radius: float, color: QColor, *, hazy: bool) -> None:
    light = QRadialGradient(middle, radius * 1.15, middle - QPointF(radius, radius) * 0.4)
    light.setColorAt(0, color.lighter(170))
    light.setColorAt(0.45, color)
    light.setColorAt(1, color.darker(190))
    painter.setOpacity(0.75 if hazy else 1.0)
    painter.setBrush(QBrush(light))
    painter.setPen(QPen(QColor(0, 0, 0, 200), 1))
    painter.drawEllipse(middle, radius, radius)
    painter.setOpacity(1.0)


def _outline(
    painter: QPainter,
    form: Literal["circle", "square"],
    middle: QPointF,
    radius: float,
    pen: QPen,
    *,
    around: bool = False,
) -> None:
    """Draw an outline over a dark one that is wider: it shows on any ground."""
    fill = QBrush(Qt.BrushStyle.NoBrush) if around else painter.brush()
    for stroke, brush in (
        (QPen(QColor(0, 0, 0, 200), pen.widthF() + 2), QBrush(Qt.BrushStyle.NoBrush)),
        (pen, fill),
    ):
        painter.setPen(stroke)
        painter.setBrush(brush)
        if form == "circle":
            painter.drawEllipse(middle, radius, radius)
        else:
            painter.drawRect(QRectF(middle.x() - radius, middle.y() - radius, 2 * radius, 2 * radius))
    painter.setBrush(Qt.BrushStyle.NoBrush)


def _text(mark: KeypointMark) -> str:
    """Return the name as it is written, with dots for what is on its way."""
    return mark.text + (" …" if mark.preview else "")


def _marker_place(mark: KeypointMark, place: Sequence[float], clear_px: float) -> QRectF:
    """Return what a marker covers, or is to be clear; nothing where its keypoint is behind the eye."""
    if np.isnan(place).any():
        return QRectF()
    size_px = max(SPHERE_PX + (2 * _RING_PX if mark.active else 0), 2 * clear_px)
    return QRectF(place[0] - size_px / 2, place[1] - size_px / 2, size_px, size_px)


def _overlap(first: QRectF, second: QRectF) -> float:
    both = first.intersected(second)
    return both.width() * both.height()
