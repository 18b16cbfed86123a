"""The volume's outline in space, the cropping box, and a triad that says which way x, y and z run."""

import math

import numpy as np
import vtk
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QFont, QImage, QPainter, QPen

from annotations.geometry.frames import Vector
from annotator.scene.camera import Camera
from annotator.scene.colors import CROPPING, FRAME, axis_colors
from annotator.scene.picking import Picture
from annotator.scene.segments import Segments, box_edges
from annotator.scene.sprites import Sprite, blank, paint_text, text_size_px

_TRIAD_PX = 92.0
_ARM_PX = 30.0
_MARGIN_PX = 8.0


class AxesLayer:
    """Outlines and triad."""

    def __init__(self) -> None:
        self._frame = Segments(width_px=1)
        self._cropping = Segments(width_px=1.5)
        self._triad = Sprite()
        self._painted: tuple[Camera, float, QFont] | None = None

    @property
    def actors(self) -> tuple[vtk.vtkProp, ...]:
        """What is drawn."""
        return (self._frame.actor, self._cropping.actor, self._triad.actor)

    def show_outlines(
        self,
        box_um: tuple[Vector, Vector] | None,
        cropping_um: tuple[Vector, Vector] | None,
        ratio: float,
    ) -> None:
        """Draw the edges of the volume, and those of the cropping box."""
        self._frame.show(box_edges(*box_um, FRAME) if box_um else (), ratio)
        self._cropping.show(box_edges(*cropping_um, CROPPING) if cropping_um else (), ratio)

    def show_triad(self, picture: Picture, font: QFont, *, visible: bool) -> None:
        """Draw the directions of the axes in the lower left corner."""
        if not visible:
            self._triad.hide()
            return
        wanted = (picture.camera, picture.ratio, font)
        if wanted != self._painted:
            self._painted = wanted
            self._triad.paint(triad_picture(picture.camera, font, picture.ratio))
        self._triad.place(_MARGIN_PX, picture.height_px - _MARGIN_PX - _TRIAD_PX, picture.height_px)


def triad_picture(camera: Camera, font: QFont, ratio: float) -> QImage:
    """Paint the three axes as the camera sees their directions, the one that comes nearest last."""
    image = blank(_TRIAD_PX, _TRIAD_PX, ratio)
    middle = QPointF(_TRIAD_PX / 2, _TRIAD_PX / 2)
    bold = QFont(font)
    bold.setBold(True)
    colors = axis_colors()
    with QPainter(image) as painter:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for axis in np.argsort(camera.forward)[::-1]:
            arm = QPointF(camera.right[axis] * _ARM_PX, -camera.up[axis] * _ARM_PX)
            _paint_arm(painter, middle, arm, "xyz"[axis], bold, colors[axis])
    return image


def _paint_arm(
    painter: QPainter, middle: QPointF, arm: QPointF, name: str, font: QFont, color: QColor
) -> None:
    pen = QPen(color, 2.5)
    pen.setCapStyle(Qt.PenCapStyle.RoundCap)
    painter.setPen(pen)
    painter.drawLine(middle, middle + arm)
    length_px = math.hypot(arm.x(), arm.y())
    # An axis that points at the eye has no direction on the screen: its name stands beside the middle.
    outwards = arm / length_px if length_px > 4 else QPointF(0.7, 0.7)
    width_px, height_px = text_size_px(name, font)
    centre = middle + arm + outwards * 8
    paint_text(painter, centre.x() - width_px / 2, centre.y() - height_px / 2, name, font, color)
