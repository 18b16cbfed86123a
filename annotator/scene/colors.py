"""The scene's colours: a dark ground in every theme, as is the custom for OCT, and what is read on it."""

from PySide6.QtGui import QColor, QPalette

from annotator import theme

Rgba = tuple[int, int, int, int]

TEXT = QColor("#f2f4f7")
FRAME: Rgba = (150, 158, 170, 150)
CROPPING: Rgba = (242, 193, 78, 255)
ACTIVE = QColor("#ffffff")

_GROUND = {True: "#0c0e11", False: "#2a2f37"}


def rgba(color: QColor | str, alpha: int = 255) -> Rgba:
    """Return a colour as four numbers from 0 to 255."""
    named = QColor(color)
    return (named.red(), named.green(), named.blue(), alpha)


def ground(palette: QPalette) -> tuple[float, float, float]:
    """Return the scene's ground under a theme's palette: red, green, blue from 0 to 1."""
    color = QColor(_GROUND[theme.is_dark(palette)])
    return (color.redF(), color.greenF(), color.blueF())


def axis_colors() -> tuple[QColor, QColor, QColor]:
    """Return the colours of the axes x, y, z on the scene's dark ground."""
    return theme.colors(theme.palette(dark=True)).axes
