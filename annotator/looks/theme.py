"""The application's looks: light, dark or the system's choice, and the colours that carry a meaning."""

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QObject, Qt, Slot
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

from annotator.looks.style import ApplicationStyle

Theme = Literal["system", "light", "dark"]
THEMES: tuple[Theme, ...] = ("system", "light", "dark")


@dataclass(frozen=True)
class Colors:
    """Colours with a meaning, readable as text (contrast of 4.5 or more) on the theme's own backgrounds.

    Attributes
    ----------
    axes : (QColor, QColor, QColor)
        Of the array axes x, y, z, in every view.
    placing : QColor
        Place mode: a click changes the annotation.
    warning, error, success : QColor
    muted : QColor
        Secondary text.
    outside : QColor
        A position outside the volume: legal, but worth a look.
    """

    axes: tuple[QColor, QColor, QColor]
    placing: QColor
    warning: QColor
    error: QColor
    success: QColor
    muted: QColor
    outside: QColor


_LIGHT = Colors(
    axes=(QColor("#b3261e"), QColor("#1b6e34"), QColor("#3b48c0")),
    placing=QColor("#9a4600"),
    warning=QColor("#855600"),
    error=QColor("#b3261e"),
    success=QColor("#1b6e34"),
    muted=QColor("#595f69"),
    outside=QColor("#8a3d9e"),
)
_DARK = Colors(
    axes=(QColor("#ff8a80"), QColor("#6fd28a"), QColor("#9fa8ff")),
    placing=QColor("#ffab5e"),
    warning=QColor("#f2c14e"),
    error=QColor("#ff8a80"),
    success=QColor("#6fd28a"),
    muted=QColor("#a3a9b3"),
    outside=QColor("#dda2f0"),
)

_Roles = tuple[tuple[QPalette.ColorRole, str], ...]
_LIGHT_ROLES: _Roles = (
    (QPalette.ColorRole.Window, "#f3f4f6"),
    (QPalette.ColorRole.WindowText, "#1c1f24"),
    (QPalette.ColorRole.Base, "#ffffff"),
    (QPalette.ColorRole.AlternateBase, "#f7f8fa"),
    (QPalette.ColorRole.ToolTipBase, "#ffffff"),
    (QPalette.ColorRole.ToolTipText, "#1c1f24"),
    (QPalette.ColorRole.PlaceholderText, "#6b717c"),
    (QPalette.ColorRole.Text, "#1c1f24"),
    (QPalette.ColorRole.Button, "#e9ebef"),
    (QPalette.ColorRole.ButtonText, "#1c1f24"),
    (QPalette.ColorRole.BrightText, "#b3261e"),
    (QPalette.ColorRole.Link, "#1f5fbf"),
    (QPalette.ColorRole.LinkVisited, "#6a3fa0"),
    (QPalette.ColorRole.Highlight, "#2f6fd0"),
    (QPalette.ColorRole.HighlightedText, "#ffffff"),
    (QPalette.ColorRole.Accent, "#2f6fd0"),
    (QPalette.ColorRole.Light, "#ffffff"),
    (QPalette.ColorRole.Midlight, "#f0f1f4"),
    (QPalette.ColorRole.Mid, "#b9bec7"),
    (QPalette.ColorRole.Dark, "#9aa0aa"),
    (QPalette.ColorRole.Shadow, "#6b717c"),
)
_DARK_ROLES: _Roles = (
    (QPalette.ColorRole.Window, "#26282c"),
    (QPalette.ColorRole.WindowText, "#e4e6ea"),
    (QPalette.ColorRole.Base, "#1c1e21"),
    (QPalette.ColorRole.AlternateBase, "#222427"),
    (QPalette.ColorRole.ToolTipBase, "#34373c"),
    (QPalette.ColorRole.ToolTipText, "#e4e6ea"),
    (QPalette.ColorRole.PlaceholderText, "#8d939e"),
    (QPalette.ColorRole.Text, "#e4e6ea"),
    (QPalette.ColorRole.Button, "#34373c"),
    (QPalette.ColorRole.ButtonText, "#e4e6ea"),
    (QPalette.ColorRole.BrightText, "#ff8a80"),
    (QPalette.ColorRole.Link, "#7fb2ff"),
    (QPalette.ColorRole.LinkVisited, "#c3a3f0"),
    (QPalette.ColorRole.Highlight, "#2f62b5"),
    (QPalette.ColorRole.HighlightedText, "#ffffff"),
    (QPalette.ColorRole.Accent, "#5f94e6"),
    (QPalette.ColorRole.Light, "#4a4e55"),
    (QPalette.ColorRole.Midlight, "#3e4147"),
    (QPalette.ColorRole.Mid, "#1a1b1e"),
    (QPalette.ColorRole.Dark, "#141517"),
    (QPalette.ColorRole.Shadow, "#0b0c0d"),
)
_DISABLED_TEXT = (
    QPalette.ColorRole.WindowText,
    QPalette.ColorRole.Text,
    QPalette.ColorRole.ButtonText,
    QPalette.ColorRole.HighlightedText,
)
_SCHEMES = {
    "system": Qt.ColorScheme.Unknown,
    "light": Qt.ColorScheme.Light,
    "dark": Qt.ColorScheme.Dark,
}


def apply_theme(theme: Theme) -> None:
    """Give the running application its looks; ``system`` goes on following the system's choice."""
    application = QApplication.instance()
    if not isinstance(application, QApplication):
        raise RuntimeError("a theme needs a QApplication")
    if not isinstance(application.style(), ApplicationStyle):
        application.setStyle(ApplicationStyle())
    follower = application.findChild(_SystemFollower)
    if follower is None:
        follower = _SystemFollower(application)
    follower.apply(theme)


def palette(*, dark: bool) -> QPalette:
    """Return the whole palette of the light or the dark theme.

    Both are the application's own: not every platform has a dark one to ask for.
    """
    made = QPalette()
    for role, name in _DARK_ROLES if dark else _LIGHT_ROLES:
        made.setColor(role, QColor(name))
    disabled = QColor("#767c86" if dark else "#8b919b")
    for role in _DISABLED_TEXT:
        made.setColor(QPalette.ColorGroup.Disabled, role, disabled)
    made.setColor(
        QPalette.ColorGroup.Disabled, QPalette.ColorRole.Highlight, QColor("#4a4e55" if dark else "#c9cdd5")
    )
    return made


def is_dark(of: QPalette) -> bool:
    """Say whether a palette is that of a dark theme."""
    return of.color(QPalette.ColorRole.Window).lightness() < 128


def colors(of: QPalette) -> Colors:
    """Return the colours with a meaning that are readable on a palette's backgrounds."""
    return _DARK if is_dark(of) else _LIGHT


class _SystemFollower(QObject):
    """Changes the palette when the system turns dark or light, as long as the theme is ``system``."""

    def __init__(self, application: QApplication) -> None:
        super().__init__(application)
        self._application = application
        self._theme: Theme = "system"
        application.styleHints().colorSchemeChanged.connect(self._on_system_scheme_changed)

    def apply(self, theme: Theme) -> None:
        self._theme = theme
        # Window frames and native dialogs follow this one, where the platform can.
        self._application.styleHints().setColorScheme(_SCHEMES[theme])
        self._draw()

    @Slot()
    def _on_system_scheme_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        if self._theme == "system":
            dark = self._application.styleHints().colorScheme() == Qt.ColorScheme.Dark
        else:
            dark = self._theme == "dark"
        wanted = palette(dark=dark)
        if wanted != self._application.palette():
            self._application.setPalette(wanted)
