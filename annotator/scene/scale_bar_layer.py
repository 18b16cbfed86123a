"""A bar of a round length, in mm or µm, that is right at every zoom."""

import vtk
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QFont, QImage, QPainter

from annotator.looks.scale_bar import length_text, round_length_um
from annotator.scene.colors import TEXT
from annotator.scene.picking import Picture
from annotator.scene.sprites import Sprite, blank, paint_text, text_size_px

_LONGEST_PX = 160.0
_LONGEST_PART = 0.3
_MARGIN_PX = 12.0
_BAR_PX = 4.0


class ScaleBarLayer:
    """The bar in the lower right corner; in perspective it holds at the middle of the picture."""

    def __init__(self) -> None:
        self._sprite = Sprite()
        self._painted: tuple[float, float, str, float, QFont] | None = None

    @property
    def actors(self) -> tuple[vtk.vtkProp, ...]:
        """What is drawn."""
        return (self._sprite.actor,)

    def show(self, picture: Picture, font: QFont, *, visible: bool) -> None:
        """Draw the bar for a picture."""
        if not visible:
            self._sprite.hide()
            return
        longest_px = min(_LONGEST_PX, _LONGEST_PART * picture.width_px)
        length_um = round_length_um(longest_px * picture.um_per_px)
        length_px = length_um / picture.um_per_px
        text = length_text(length_um) + ("" if picture.camera.parallel else " in the middle")
        text_px = text_size_px(text, font)
        width_px, height_px = max(length_px, text_px[0]) + 2, text_px[1] + _BAR_PX + 2
        wanted = (length_px, width_px, text, picture.ratio, font)
        if wanted != self._painted:
            self._painted = wanted
            self._sprite.paint(bar_picture(length_px, (width_px, height_px), text, font, picture.ratio))
        self._sprite.place(
            picture.width_px - _MARGIN_PX - width_px,
            picture.height_px - _MARGIN_PX - height_px,
            picture.height_px,
        )


def bar_picture(
    length_px: float, size_px: tuple[float, float], text: str, font: QFont, ratio: float
) -> QImage:
    """Paint the bar, and its length above it."""
    image = blank(*size_px, ratio)
    width_px, height_px = size_px
    with QPainter(image) as painter:
        paint_text(painter, (width_px - text_size_px(text, font)[0]) / 2, 0, text, font, TEXT)
        bar = QRectF((width_px - length_px) / 2, height_px - _BAR_PX - 1, length_px, _BAR_PX)
        painter.fillRect(bar.adjusted(-1, -1, 1, 1), QColor(0, 0, 0, 190))
        painter.fillRect(bar, TEXT)
    return image
