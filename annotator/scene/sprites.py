"""Small pictures of constant size on the screen, painted by Qt: markers, names, the triad, the scale bar."""

import numpy as np
import vtk
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QImage, QPainter, QPainterPath, QPen

from annotator.scene.textured_quad import TexturedQuad

_HALO_PX = 3.0
_HALO = QColor(0, 0, 0, 190)


class Sprite:
    """A picture in the overlays, over everything that has a place in space.

    Attributes
    ----------
    actor : vtkTexturedActor2D
    """

    def __init__(self) -> None:
        self._quad = TexturedQuad()
        mapper = vtk.vtkPolyDataMapper2D()
        mapper.SetInputData(self._quad.surface)
        self.actor = vtk.vtkTexturedActor2D()
        self.actor.SetMapper(mapper)
        self.actor.SetTexture(self._quad.texture)
        self.actor.GetPositionCoordinate().SetCoordinateSystemToViewport()
        self.actor.VisibilityOff()
        self._height_px = 0.0
        self._ratio = 1.0

    def paint(self, image: QImage) -> None:
        """Show another picture."""
        straight = image.convertToFormat(QImage.Format.Format_RGBA8888)
        width, height = straight.width(), straight.height()
        pixels = np.frombuffer(straight.constBits(), np.uint8).reshape(height, width, 4)[::-1]
        self._quad.show(pixels, ((0, 0, 0), (width, 0, 0), (width, height, 0), (0, height, 0)))
        self._ratio = image.devicePixelRatio()
        self._height_px = height / self._ratio

    def place(self, left_px: float, top_px: float, picture_height_px: float) -> None:
        """Show it with its upper left corner at a place, in Qt's pixels of a picture of that height."""
        from_bottom_px = picture_height_px - top_px - self._height_px
        self.actor.SetPosition(round(left_px * self._ratio), round(from_bottom_px * self._ratio))
        self.actor.VisibilityOn()

    def hide(self) -> None:
        """Show it no longer."""
        self.actor.VisibilityOff()


def blank(width_px: float, height_px: float, ratio: float) -> QImage:
    """Return a transparent picture to paint on, of a size in Qt's pixels."""
    image = QImage(
        max(1, round(width_px * ratio)),
        max(1, round(height_px * ratio)),
        QImage.Format.Format_ARGB32_Premultiplied,
    )
    image.setDevicePixelRatio(ratio)
    image.fill(Qt.GlobalColor.transparent)
    return image


def text_size_px(text: str, font: QFont) -> tuple[float, float]:
    """Return the width and height of a text with its halo, in Qt's pixels."""
    metrics = QFontMetricsF(font)
    return metrics.horizontalAdvance(text) + 2 * _HALO_PX, metrics.height() + 2 * _HALO_PX


def paint_text(
    painter: QPainter, left_px: float, top_px: float, text: str, font: QFont, color: QColor
) -> None:
    """Paint a text that can be read on any ground: with a dark halo."""
    path = QPainterPath()
    path.addText(QPointF(left_px + _HALO_PX, top_px + _HALO_PX + QFontMetricsF(font).ascent()), font, text)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    halo = QPen(_HALO, _HALO_PX)
    halo.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    painter.strokePath(path, halo)
    painter.fillPath(path, color)


def text_picture(text: str, font: QFont, color: QColor, ratio: float) -> QImage:
    """Return a picture of a text."""
    image = blank(*text_size_px(text, font), ratio)
    with QPainter(image) as painter:
        paint_text(painter, 0, 0, text, font, color)
    return image
