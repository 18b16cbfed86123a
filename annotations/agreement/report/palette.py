"""Colours that people with any colour vision tell apart, and marks and lines that do so without colour.

The colours are those of Okabe and Ito (2008), without yellow, which is too faint on white.
"""

from dataclasses import dataclass
from typing import Literal

from annotations.documents.record import Method

LineStyle = Literal["-", "--", "-.", ":"]

INK = "#1a1a1a"
FAINT = "#6b6b6b"
GRID = "#d9d9d9"

_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
# No disc: over an image it would be taken for a keypoint of one's own, and all forms are the same in both.
_MARKERS = ("*", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h")


@dataclass(frozen=True)
class Look:
    """How one of several is drawn, as matplotlib names it."""

    color: str
    marker: str
    line: LineStyle


KEYPOINTS = Look("#0072b2", "o", "-")
BOXES = Look("#d55e00", "s", "--")


def method_look(method: Method) -> Look:
    """Return how a method is drawn."""
    return KEYPOINTS if method == "keypoints" else BOXES


def numbered_look(number: int) -> Look:
    """Return how one of several is drawn, by its place among all; the first 77 are all different."""
    lines: tuple[LineStyle, ...] = ("-", "--", "-.", ":")
    return Look(_COLORS[number % len(_COLORS)], _MARKERS[number % len(_MARKERS)], lines[number % len(lines)])
