"""The colour of a number that calls for a look."""

from PySide6.QtGui import QColor, QGuiApplication

from annotations.fitting.plausibility import Plausibility
from annotator.looks import theme


def plausibility_color(judged: Plausibility) -> QColor | None:
    """Return the theme's colour for a number of some plausibility; None for a plausible one."""
    colors = theme.colors(QGuiApplication.palette())
    return {"plausible": None, "doubtful": colors.warning, "implausible": colors.error}[judged]
