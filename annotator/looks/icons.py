"""The tool bar's icons: lines in the colour of the theme's text."""

from functools import lru_cache

from PySide6.QtCore import QByteArray, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPainter, QPalette, QPixmap
from PySide6.QtSvg import QSvgRenderer

# On a grid of 24 units; strokes take the colour that they are asked for.
_SHAPES = {
    "open_file": "<path d='M3 19V5.5h6l2 2.5h10v11z M3 11h18'/>",
    "open_folder": "<path d='M3 19V5.5h6l2 2.5h10v11z M7 12h10 M7 15.5h7'/>",
    "new_study": "<path d='M3 19V5.5h6l2 2.5h10v11z M12 10.5v6 M9 13.5h6'/>",
    "open_demo": "<path d='M6 19l4-5 4-2 4-6'/><circle cx='6' cy='19' r='1.2'/>"
    "<circle cx='10' cy='14' r='1.2'/><circle cx='14' cy='12' r='1.2'/><circle cx='18' cy='6' r='1.2'/>",
    "recent": "<circle cx='12' cy='12' r='8.5'/><path d='M12 7v5l3.5 2'/>",
    "save": "<path d='M4.5 4.5h12l3 3v12h-15z M8 4.5v5h7v-5 M7.5 19.5v-6.5h9v6.5'/>",
    "navigate_mode": "<path d='M6 3.5v15l4-3.8 2.6 5.8 2.6-1.2-2.6-5.6 5.4-.4z'/>",
    "place_mode": "<circle cx='12' cy='12' r='6'/><path d='M12 2.5v6 M12 15.5v6 M2.5 12h6 M15.5 12h6'/>"
    "<circle cx='12' cy='12' r='.6'/>",
    "pose_mode": "<path d='M3 17l6.5-3.5 M11.5 11.5l3.5-4.5 M17 5.5h4.5' stroke-width='3.4'/>"
    "<path d='M13 20a8 8 0 0 0 7.5-6 M20.9 17.6l-.4-3.8-3.7 1'/>",
    "undo": "<path d='M8.5 5l-5 5 5 5 M4 10h10.5a5 5 0 0 1 0 10H9'/>",
    "redo": "<path d='M15.5 5l5 5-5 5 M20 10H9.5a5 5 0 0 0 0 10H15'/>",
    "next_unplaced": "<circle cx='9' cy='12' r='5.5' stroke-dasharray='2.6 2.2'/>"
    "<path d='M17 7.5l4.5 4.5-4.5 4.5'/>",
    "mark_done": "<circle cx='12' cy='12' r='8.5'/><path d='M8 12.3l2.8 2.8 5.2-5.8'/>",
    "previous_volume": "<path d='M14.5 5.5L8 12l6.5 6.5'/>",
    "next_volume": "<path d='M9.5 5.5L16 12l-6.5 6.5'/>",
    "shortcut_sheet": "<rect x='2.5' y='6' width='19' height='12' rx='1.5'/>"
    "<path d='M6 10h.5 M9.8 10h.5 M13.7 10h.5 M17.5 10h.5 M7.5 14.5h9'/>",
    "sure": "<path d='M4.5 12.8l5 5L19.5 7'/>",
    "lock": "<rect x='5' y='10.5' width='14' height='9.5' rx='1.5'/><path d='M8 10.5V8a4 4 0 0 1 8 0v2.5'/>",
    "maximize": "<path d='M9 4H4v5 M15 4h5v5 M4 15v5h5 M20 15v5h-5'/>",
    "restore": "<path d='M4 9h5V4 M20 9h-5V4 M9 20v-5H4 M15 20v-5h5'/>",
}
_APPLICATION = (
    "<rect x='1' y='1' width='22' height='22' rx='5' fill='#1c1e21' stroke='none'/>"
    "<path d='M5 17l5.5-4' stroke='#4f9dff' stroke-width='2.2'/>"
    "<path d='M10.5 13l4.5-5' stroke='#ffb454' stroke-width='2.2'/>"
    "<path d='M15 8l4-1.5' stroke='#5bd68a' stroke-width='2.2'/>"
    "<g fill='#ffffff' stroke='none'><circle cx='5' cy='17' r='1.7'/><circle cx='10.5' cy='13' r='1.7'/>"
    "<circle cx='15' cy='8' r='1.7'/><circle cx='19' cy='6.5' r='1.7'/></g>"
)
_SIZES_PX = (16, 24, 32, 48)


def icon(name: str, palette: QPalette) -> QIcon:
    """Return the icon of an action in a palette's colours, greyed where it is disabled; KeyError if none."""
    made = QIcon()
    for mode, group in (
        (QIcon.Mode.Normal, QPalette.ColorGroup.Active),
        (QIcon.Mode.Disabled, QPalette.ColorGroup.Disabled),
    ):
        color = palette.color(group, QPalette.ColorRole.ButtonText)
        _add_pixmaps(made, _SHAPES[name], color, mode)
    return made


def has_icon(name: str) -> bool:
    """Say whether an action has an icon."""
    return name in _SHAPES


def application_icon() -> QIcon:
    """Return the icon of the program's windows."""
    made = QIcon()
    _add_pixmaps(made, _APPLICATION, QColor("white"), QIcon.Mode.Normal)
    return made


def _add_pixmaps(made: QIcon, shape: str, color: QColor, mode: QIcon.Mode) -> None:
    for image in _images(shape, color.name()):
        made.addPixmap(QPixmap.fromImage(image), mode)


@lru_cache(maxsize=128)
def _images(shape: str, color: str) -> tuple[QImage, ...]:
    """Draw a shape in each size; images, because pixmaps must not outlive the application."""
    drawing = (
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 24 24'><g fill='none' "
        f"stroke='{color}' stroke-width='1.7' stroke-linecap='round' stroke-linejoin='round'>"
        f"{shape}</g></svg>"
    )
    renderer = QSvgRenderer(QByteArray(drawing.encode()))
    images = []
    for size in _SIZES_PX:
        image = QImage(size, size, QImage.Format.Format_ARGB32_Premultiplied)
        image.fill(Qt.GlobalColor.transparent)
        painter = QPainter(image)
        renderer.render(painter, QRectF(0, 0, size, size))
        painter.end()
        images.append(image)
    return tuple(images)
