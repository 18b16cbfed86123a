"""Handles at constant size on the screen, each kind in a form of its own, with the stems of knobs."""

import math
from collections.abc import Sequence

import numpy as np
import vtk
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPainterPath, QPainterPathStroker, QPen, QPolygonF

from annotator.scene.colors import ACTIVE, rgb
from annotator.scene.picking import Picture
from annotator.scene.segments import Segment, Segments
from annotator.scene.sprites import Sprite, blank
from annotator.session.editing.handles import Handle, HandleKind

_SIZE_PX = 36.0  # the largest form, with its lines
_OUTLINE_PX = 1.5
_HALO_PX = 2.0
_HALO = QColor(0, 0, 0, 200)
_END_PX = (11.0, 8.5)  # radii of a ring round the sphere of a keypoint
_ABOVE_KEYPOINTS = 10_000


class HandlesLayer:
    """A picture for each handle; the nearest one lies on top, and all of them over the keypoints.

    Attributes
    ----------
    actor : vtkActor
        The stems.
    """

    def __init__(self, renderer: vtk.vtkRenderer) -> None:
        self._renderer = renderer
        self._stems = Segments(width_px=1.5)
        self.actor = self._stems.actor
        self._drawn: dict[str, _DrawnHandle] = {}
        self._shown: tuple[tuple[Handle, ...], Picture, str | None] | None = None

    def show(self, handles: Sequence[Handle], picture: Picture, pointed: str | None) -> None:
        """Draw these handles and no others; ``pointed`` names the one that is held or under the cursor."""
        wanted = (tuple(handles), picture, pointed)
        if wanted == self._shown:
            return
        self._shown = wanted
        self._stems.show(
            [
                Segment(handle.stem_um, handle.position_um, rgb(handle.color))
                for handle in handles
                if handle.stem_um is not None
            ],
            picture.ratio,
        )
        for name in self._drawn.keys() - {handle.name for handle in handles}:
            self._renderer.RemoveViewProp(self._drawn.pop(name).sprite.actor)
        places = picture.project([handle.position_um for handle in handles])
        for layer, index in enumerate(np.argsort(-places[:, 2])):
            handle = handles[index]
            if handle.name not in self._drawn:
                self._drawn[handle.name] = _DrawnHandle()
                self._renderer.AddViewProp(self._drawn[handle.name].sprite.actor)
            drawn = self._drawn[handle.name]
            drawn.show(handle, places[index], picture, pointed=handle.name == pointed)
            drawn.sprite.actor.SetLayerNumber(_ABOVE_KEYPOINTS + layer)


class _DrawnHandle:
    def __init__(self) -> None:
        self.sprite = Sprite()
        self._painted: tuple[HandleKind, str, bool, float] | None = None

    def show(self, handle: Handle, place: Sequence[float], picture: Picture, *, pointed: bool) -> None:
        wanted = (handle.kind, handle.color, pointed, picture.ratio)
        if wanted != self._painted:
            self._painted = wanted
            self.sprite.paint(handle_picture(handle.kind, handle.color, picture.ratio, pointed=pointed))
        if np.isnan(place).any():
            self.sprite.hide()
        else:
            self.sprite.place(place[0] - _SIZE_PX / 2, place[1] - _SIZE_PX / 2, picture.height_px)


def handle_picture(kind: HandleKind, color: str, ratio: float, *, pointed: bool) -> QImage:
    """Paint a handle: in the link's colour with a white outline, the other way round when pointed at."""
    image = blank(_SIZE_PX, _SIZE_PX, ratio)
    form = _FORMS[kind]()
    fill, line = QColor(color), ACTIVE
    if pointed:
        fill, line = line, fill
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.translate(_SIZE_PX / 2, _SIZE_PX / 2)
        halo = QPen(_HALO, 2 * (_HALO_PX + _OUTLINE_PX))
        halo.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
        outline = QPen(line, 2 * _OUTLINE_PX)
        outline.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
        # The form last: of each line the outer half is seen.
        painter.strokePath(form, halo)
        painter.strokePath(form, outline)
        painter.fillPath(form, fill)
    return image


def _four_arrows() -> QPainterPath:
    half, head, reach = 1.5, 4.0, 11.0
    arrow = [
        QPointF(-half, 0),
        QPointF(-half, head - reach),
        QPointF(-head, head - reach),
        QPointF(0, -reach),
        QPointF(head, head - reach),
        QPointF(half, head - reach),
        QPointF(half, 0),
    ]
    form = QPainterPath()
    for _ in range(4):
        one = QPainterPath()
        one.addPolygon(QPolygonF(arrow))
        one.closeSubpath()
        form = form.united(one)
        arrow = [QPointF(-point.y(), point.x()) for point in arrow]
    return form


def _ring() -> QPainterPath:
    form = QPainterPath()
    for radius in _END_PX:
        form.addEllipse(QPointF(0, 0), radius, radius)
    return form


def _square() -> QPainterPath:
    form = QPainterPath()
    form.addRect(QRectF(-4.5, -4.5, 9, 9))
    return form


def _knob() -> QPainterPath:
    """Return a disc with an arrow that runs round it."""
    form = QPainterPath()
    form.addEllipse(QPointF(0, 0), 4, 4)
    radius, begin_deg, span_deg = 9.0, -30.0, 240.0
    around = QRectF(-radius, -radius, 2 * radius, 2 * radius)
    arc = QPainterPath()
    arc.arcMoveTo(around, begin_deg)
    arc.arcTo(around, begin_deg, span_deg)
    stroker = QPainterPathStroker()
    stroker.setWidth(2)
    end = math.radians(begin_deg + span_deg)
    outwards = QPointF(math.cos(end), -math.sin(end))
    onwards = QPointF(-math.sin(end), -math.cos(end))
    head = QPainterPath()
    head.addPolygon(
        QPolygonF([outwards * (radius - 3.5), outwards * (radius + 3.5), outwards * radius + onwards * 5.0])
    )
    head.closeSubpath()
    return form.united(stroker.createStroke(arc)).united(head)


def _diamond() -> QPainterPath:
    form = QPainterPath()
    for radius in (13.0, 9.5):
        form.addPolygon(
            QPolygonF([QPointF(radius, 0), QPointF(0, radius), QPointF(-radius, 0), QPointF(0, -radius)])
        )
        form.closeSubpath()
    return form


_FORMS = {"move": _four_arrows, "end": _ring, "face": _square, "turn": _knob, "bend": _diamond}
