"""Intensities to colours: a slice of any real type becomes a QImage of 8-bit indices and a colour table."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

# No shipped colour map passes near it, so it never looks like an intensity.
NAN_RGB = (0, 120, 255)
# The index that stands for "not a number" in slices that are scaled; the 255 below it are intensities.
NAN_INDEX = 255


def indices(data: NDArray[Any], window: tuple[float, float]) -> NDArray[np.uint8]:
    """Return one byte a pixel: what `color_table` gives a colour to.

    Bytes stay as they are, whatever the window: changing it costs nothing but another table. Everything else
    is scaled so that the window spans 0 to 254, and NaN becomes 255.

    Parameters
    ----------
    data : ndarray
        Intensities of any real type, in any shape.
    window : (float, float)
        Intensities drawn darkest and brightest.
    """
    if data.dtype == np.uint8:
        return data
    precision = np.float64 if data.dtype.itemsize > 4 else np.float32
    with np.errstate(over="ignore", invalid="ignore"):
        scaled: NDArray[np.floating] = data.astype(precision)
        np.subtract(scaled, window[0], out=scaled)
        np.multiply(scaled, (NAN_INDEX - 1) / _width(window), out=scaled)
        np.add(scaled, 0.5, out=scaled)
        np.clip(scaled, 0, NAN_INDEX - 1, out=scaled)
        if data.dtype.kind == "f":
            np.copyto(scaled, NAN_INDEX, where=np.isnan(scaled))
    return scaled.astype(np.uint8)


def color_table(colors: NDArray[np.uint8], window: tuple[float, float], dtype: np.dtype[Any]) -> list[int]:
    """Return the 256 colours, as Qt's 0xAARRGGBB, of the indices that `indices` makes of a type.

    Parameters
    ----------
    colors : ndarray of uint8, shape (256, 4)
        The colour map, RGBA, darkest first.
    window : (float, float)
        Intensities drawn darkest and brightest.
    dtype : numpy.dtype
        Of the slice.
    """
    if dtype == np.uint8:
        share = (np.arange(256) - window[0]) / _width(window)
    else:
        share = np.arange(256) / (NAN_INDEX - 1)
    rgb = colors[np.rint(np.clip(share, 0, 1) * 255).astype(int), :3].astype(np.uint32)
    if dtype != np.uint8:
        rgb[NAN_INDEX] = NAN_RGB
    table = (0xFF << 24) | (rgb[:, 0] << 16) | (rgb[:, 1] << 8) | rgb[:, 2]
    return [int(color) for color in table]


def image(pixels: NDArray[np.uint8], table: list[int]) -> QImage:
    """Return an image of indices, shape (rows, columns), in their colours; ready to be scaled fast."""
    rows, columns = pixels.shape
    # Qt takes the address of the first byte alone, and fails on an array that has gaps.
    pixels = np.ascontiguousarray(pixels)
    shared = QImage(pixels.data, columns, rows, pixels.strides[0], QImage.Format.Format_Indexed8)
    shared.setColorTable(table)
    # Qt scales 32-bit images several times faster, and this makes the copy that outlives the array.
    return shared.convertToFormat(QImage.Format.Format_RGB32)


def _width(window: tuple[float, float]) -> float:
    low, high = window
    # A window without width shows a step; the smallest one must not overflow 32-bit numbers.
    return max(high - low, 1e-6 * max(abs(low), abs(high)), 1e-30)
