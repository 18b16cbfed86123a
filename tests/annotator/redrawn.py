"""What is drawn only after the scene, drawn now: tests that are about what it says need not wait for it."""

from typing import TypeVar

from PySide6.QtCore import QObject

from annotator.looks.redrawing import Redrawing

Shown = TypeVar("Shown", bound=QObject)


def redrawn(shown: Shown) -> Shown:
    """Return a panel or a model with everything drawn that it owes."""
    # What is drawn may have more drawn after it.
    while owed := [redrawing for redrawing in shown.findChildren(Redrawing) if redrawing.is_owed]:
        for redrawing in owed:
            redrawing.draw_now()
    return shown
