"""The names by which tests and assistive tools find a control."""

from typing import TypeVar

from PySide6.QtWidgets import QWidget

W = TypeVar("W", bound=QWidget)


def named(widget: W, name: str, *, title: str = "", tooltip: str = "") -> W:
    """Return a control with its stable name, an accessible name where its text is none, and a tooltip."""
    widget.setObjectName(name)
    if title:
        widget.setAccessibleName(title)
    if tooltip:
        widget.setToolTip(tooltip)
    return widget
