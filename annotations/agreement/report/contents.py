"""What a report consists of, whoever prints it: sections of paragraphs, tables, plots and formulas."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # Half a second that only those wait for who draw.
    from matplotlib.figure import Figure, SubFigure

    Surface = Figure | SubFigure


@dataclass(frozen=True)
class Paragraph:
    """Plain text."""

    text: str


@dataclass(frozen=True)
class Note:
    """Plain text that a reader should not miss."""

    text: str


@dataclass(frozen=True)
class Formula:
    """A formula in plain characters, with what its letters mean."""

    text: str


@dataclass(frozen=True)
class Table:
    """Rows under named columns; the first cell of a row names it.

    Attributes
    ----------
    caption : str
        What is shown, with the statistic's name.
    columns : tuple of str
        Headings, with units.
    rows : tuple of tuple of str
        Each as long as ``columns``.
    groups : tuple of (str, int)
        Headings over several columns each, from left to right; empty where there are none.
    words : frozenset of int
        The columns that hold words, besides the first; the others hold numbers.
    is_main : bool
        Whether it is what most readers come for.
    """

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    words: frozenset[int] = frozenset()
    is_main: bool = False


@dataclass(frozen=True)
class Plot:
    """A picture that can be drawn at any size.

    Attributes
    ----------
    caption : str
        What is shown and how to read it.
    alternative : str
        What it shows, for those who cannot see it.
    size_in : (float, float)
        Width and height in inches at which the text in it has the right size.
    draw : callable
        Draws it into an empty matplotlib figure or part of one.
    """

    caption: str
    alternative: str
    size_in: tuple[float, float]
    draw: Callable[["Surface"], None]


@dataclass(frozen=True)
class Photo:
    """A picture that is kept as pixels; ``png`` is a PNG file, the rest is as for a `Plot`."""

    caption: str
    alternative: str
    size_in: tuple[float, float]
    png: bytes


Item = Paragraph | Note | Formula | Table | Plot | Photo


@dataclass(frozen=True)
class Section:
    """A part of a report under a heading; ``anchor`` is unique."""

    anchor: str
    heading: str
    items: tuple[Item, ...]


@dataclass(frozen=True)
class Contents:
    """A whole report: ``facts`` are the named lines under its title."""

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    sections: Sequence[Section]
