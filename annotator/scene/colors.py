"""The scene's colours: a dark ground in every theme, as is the custom for OCT, and what is read on it."""

from functools import lru_cache

from PySide6.QtGui import QColor, QPalette

from annotator.looks import theme

Rgb = tuple[int, int, int]
"""Red, green, blue from 0 to 255. No alpha: without a GPU one translucent line costs a frame 20 ms."""

TEXT = QColor("#f2f4f7")
FRAME: Rgb = (96, 102, 112)
CROPPING: Rgb = (242, 193, 78)
RAY: Rgb = (170, 170, 170)
ACTIVE = QColor("#ffffff")

_GROUND = {True: "#0c0e11", False: "#2a2f37"}


def rgb(color: QColor | str) -> Rgb:
    """Return a colour as three numbers."""
    named = QColor(color)
    return (named.red(), named.green(), named.blue())


def ground(palette: QPalette) -> tuple[float, float, float]:
    """Return the scene's ground under a theme's palette: red, green, blue from 0 to 1."""
    color = QColor(_GROUND[theme.is_dark(palette)])
    return (color.redF(), color.greenF(), color.blueF())


@lru_cache(maxsize=1)
def axis_colors() -> tuple[QColor, QColor, QColor]:
    """Return the colours of the axes x, y, z on the scene's dark ground."""
    return theme.colors(theme.palette(dark=True)).axes
