"""A slice as it stands on the screen, drawn anew only when something about the image changed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from annotations.volumes import SliceImage
from annotator.slices.slice_image import color_table, image, indices
from annotator.slices.viewport import Viewport

# From this size on voxels are shown as what they are, below it the eye is better served by smooth shades.
CRISP_VOXEL_PX = 6.0


@dataclass(frozen=True, eq=False)
class _Indices:
    """The 8-bit indices of a slice, rows downwards."""

    source: SliceImage
    window: tuple[float, float]
    pixels: NDArray[np.uint8]


class SlicePicture:
    """Draws a slice into an image of the widget's size, and keeps it.

    A QImage rather than a QPixmap: it may be forgotten in whatever thread Python happens to tidy up.

    Parameters
    ----------
    colormaps : mapping of str to ndarray of uint8, shape (256, 4)
        RGBA colours by name.
    background : QColor
        Around the volume.
    """

    def __init__(self, colormaps: Mapping[str, NDArray[np.uint8]], background: QColor) -> None:
        self._colormaps = colormaps
        self._background = background
        self._indices: _Indices | None = None
        self._key: tuple[Any, ...] = ()
        self._drawn = QImage()
        self.times_drawn = 0

    def drawn(
        self,
        source: SliceImage | None,
        viewport: Viewport,
        window: tuple[float, float],
        colormap: str,
        pixel_ratio: float,
    ) -> QImage:
        """Return the picture of a slice: the area of the viewport, in device pixels.

        Parameters
        ----------
        source : SliceImage or None
            None draws the background alone.
        viewport : Viewport
        window : (float, float)
            Intensities drawn darkest and brightest.
        colormap : str
            Name of a colour map.
        pixel_ratio : float
            Device pixels per logical pixel.
        """
        key = (source, viewport, window, colormap, pixel_ratio)
        if key != self._key:
            self._key = key
            self._draw(source, viewport, window, colormap, pixel_ratio)
        return self._drawn

    def _draw(
        self,
        source: SliceImage | None,
        viewport: Viewport,
        window: tuple[float, float],
        colormap: str,
        pixel_ratio: float,
    ) -> None:
        self.times_drawn += 1
        area = viewport.area
        size = (math.ceil(area.width * pixel_ratio), math.ceil(area.height * pixel_ratio))
        if (self._drawn.width(), self._drawn.height()) != size:
            self._drawn = QImage(*size, QImage.Format.Format_RGB32)
        self._drawn.setDevicePixelRatio(pixel_ratio)
        self._drawn.fill(self._background)
        if source is None:
            return
        pixels = self._pixels(source, viewport, window)
        table = color_table(self._colormaps[colormap], window, source.data.dtype)
        painter = QPainter(self._drawn)
        painter.translate(-area.left, -area.top)
        self._paint(painter, source, pixels, table, viewport)
        painter.end()

    def _pixels(
        self, source: SliceImage, viewport: Viewport, window: tuple[float, float]
    ) -> NDArray[np.uint8]:
        held = self._indices
        # Bytes are their own indices, so that another window needs no other ones.
        if (
            held is None
            or held.source is not source
            or (held.window != window and source.data.dtype != np.uint8)
        ):
            pixels = indices(viewport.plane.on_screen(source.data), window)
            held = self._indices = _Indices(source, window, pixels)
        return held.pixels

    def _paint(
        self,
        painter: QPainter,
        source: SliceImage,
        pixels: NDArray[np.uint8],
        table: list[int],
        viewport: Viewport,
    ) -> None:
        plane, area = viewport.plane, viewport.area
        step_um, origin_um = source.spacing_um, source.origin_um
        if plane.is_transposed:
            across_um, down_um, left_um, top_um = step_um[0], step_um[1], origin_um[0], origin_um[1]
        else:
            across_um, down_um, left_um, top_um = step_um[1], step_um[0], origin_um[1], origin_um[0]
        first = viewport.flat_um(area.left, area.top)
        last = viewport.flat_um(area.left + area.width, area.top + area.height)
        rows, columns = pixels.shape
        # Only what is seen is drawn, and Qt is spared coordinates that overflow its fixed-point numbers.
        start_column, stop_column = _seen(first[0], last[0], left_um, across_um, columns)
        start_row, stop_row = _seen(first[1], last[1], top_um, down_um, rows)
        if start_column >= stop_column or start_row >= stop_row:
            return
        upper_left = viewport.pixel_of_flat(
            (left_um + (start_column - 0.5) * across_um, top_um + (start_row - 0.5) * down_um)
        )
        lower_right = viewport.pixel_of_flat(
            (left_um + (stop_column - 0.5) * across_um, top_um + (stop_row - 0.5) * down_um)
        )
        # The outermost pixels of a coarse slice can reach beyond the volume.
        low, high = viewport.pixel_of_flat(plane.low_um), viewport.pixel_of_flat(plane.high_um)
        painter.setClipRect(QRectF(QPointF(*low), QPointF(*high)))
        crisp = source.sharp and viewport.scale * min(across_um, down_um) >= CRISP_VOXEL_PX
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, not crisp)
        seen = image(pixels[start_row:stop_row, start_column:stop_column], table)
        painter.drawImage(QRectF(QPointF(*upper_left), QPointF(*lower_right)), seen, QRectF(seen.rect()))


def _seen(first_um: float, last_um: float, origin_um: float, step_um: float, count: int) -> tuple[int, int]:
    """Return the range of pixels that an interval touches, with one more at each side for smooth edges."""
    start = math.floor((first_um - origin_um) / step_um + 0.5) - 1
    stop = math.ceil((last_um - origin_um) / step_um + 0.5) + 1
    return (min(max(start, 0), count), min(max(stop, 0), count))
