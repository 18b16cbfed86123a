"""An agreement as a PDF of A4 pages, from the same contents as the HTML."""

import io
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from annotations.agreement.report.contents import Contents, Formula, Item, Note, Paragraph, Photo, Plot, Table
from annotations.agreement.report.marks import WIDTH_IN
from annotations.agreement.report.palette import FAINT, INK
from annotations.agreement.report.pictures import take_apart
from annotations.agreement.report.typesetting import broken, column_widths_in, line_height_in
from annotations.errors import Cancelled

if TYPE_CHECKING:
    from matplotlib.backends.backend_pdf import PdfPages

_PAGE_IN = (8.27, 11.69)
_LEFT_IN = (_PAGE_IN[0] - WIDTH_IN) / 2
_TOP_IN = 0.6
_BOTTOM_IN = 0.7
_GAP_IN = 0.12
_CELL_GAP_IN = 0.1
_RULE_IN = 0.03
_HEADING_IN = 0.5
_KEPT_WHOLE_IN = 4.5
_HEAD_IN = 0.9
"""About what a table's caption and headings take."""

_TITLE, _HEADING, _TEXT, _CELL, _SMALL = 16.0, 12.0, 9.0, 7.5, 7.0
_MAIN_CELL = 10.0


def pdf_bytes(
    contents: Contents,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> bytes:
    """Return a report as PDF.

    Parameters
    ----------
    contents : Contents
    progress, cancelled : callable
        As in `annotations.agreement.report.exporting.export`.

    Raises
    ------
    Cancelled
        `cancelled` returned true.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    stream = io.BytesIO()
    with warnings.catch_warnings():
        # A name may be of letters that the font lacks; the HTML has it whole.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        with PdfPages(stream, metadata={"Title": contents.title, "CreationDate": None}) as pdf:
            pages = _Pages(pdf, contents.title)
            _write_title(pages, contents)
            for number, section in enumerate(contents.sections):
                if cancelled():
                    raise Cancelled
                progress(number / len(contents.sections))
                pages.need(_HEADING_IN + _least_in(section.items[0]))
                pages.space(2 * _GAP_IN)
                pages.text(section.heading, _HEADING, weight="bold")
                for item in section.items:
                    _write_item(pages, item)
            pages.finish()
    progress(1.0)
    return stream.getvalue()


class _Pages:
    """Pages that fill from above.

    Parameters
    ----------
    pdf : PdfPages
        Takes each page when it is full.
    title : str
        For the foot of the pages.
    """

    def __init__(self, pdf: "PdfPages", title: str) -> None:
        self._pdf = pdf
        self._title = title
        self._number = 0
        self._begin()

    def need(self, height_in: float) -> bool:
        """Turn the page unless that much room is left on it; return whether it was turned."""
        if self._y_in + height_in <= _PAGE_IN[1] - _BOTTOM_IN or self._y_in <= _TOP_IN:
            return False
        self.finish()
        self._begin()
        return True

    def space(self, height_in: float) -> None:
        """Leave room, but not at the head of a page."""
        if self._y_in > _TOP_IN:
            self._y_in += height_in

    def text(self, text: str, size: float, *, weight: str = "normal", color: str = INK) -> None:
        """Write text over the whole width, in as many lines as it needs."""
        for line in broken(text, size, WIDTH_IN, is_bold=weight == "bold"):
            self.need(line_height_in(size))
            self.put(line, 0.0, size, weight=weight, color=color)
            self._y_in += line_height_in(size)

    def put(
        self,
        line: str,
        x_in: float,
        size: float,
        *,
        down_in: float = 0.0,
        align: str = "left",
        weight: str = "normal",
        color: str = INK,
    ) -> None:
        """Write one line at a distance from the left margin and below where the page is filled to."""
        self._page.text(
            (_LEFT_IN + x_in) / _PAGE_IN[0],
            1 - (self._y_in + down_in) / _PAGE_IN[1],
            line,
            fontsize=size,
            fontweight=weight,
            color=color,
            horizontalalignment=align,
            verticalalignment="top",
            parse_math=False,
        )

    def rule(self, length_in: float, *, width: float, color: str = INK) -> None:
        """Draw a line from the left margin."""
        from matplotlib.lines import Line2D

        y = 1 - self._y_in / _PAGE_IN[1]
        ends = (_LEFT_IN / _PAGE_IN[0], (_LEFT_IN + length_in) / _PAGE_IN[0])
        self._page.add_artist(Line2D(ends, (y, y), color=color, linewidth=width))

    def advance(self, height_in: float) -> None:
        """Fill the page by what was put there."""
        self._y_in += height_in

    def plot(self, plot: Plot) -> None:
        """Draw a plot over the whole width, at the size that it was made for."""
        height_in = plot.size_in[1] * WIDTH_IN / plot.size_in[0]
        self.need(height_in)
        below_in = max(0.01, _PAGE_IN[1] - self._y_in - height_in)
        grid = self._page.add_gridspec(
            3,
            3,
            width_ratios=(_LEFT_IN, WIDTH_IN, _LEFT_IN),
            height_ratios=(self._y_in, height_in, below_in),
        )
        part = self._page.add_subfigure(grid[1, 1])
        plot.draw(part)
        self._y_in += height_in

    def photo(self, photo: Photo) -> None:
        """Put a picture over the whole width."""
        from matplotlib.image import imread

        height_in = photo.size_in[1] * WIDTH_IN / photo.size_in[0]
        self.need(height_in)
        low = 1 - (self._y_in + height_in) / _PAGE_IN[1]
        place = (_LEFT_IN / _PAGE_IN[0], low, WIDTH_IN / _PAGE_IN[0], height_in / _PAGE_IN[1])
        axes = self._page.add_axes(place)
        axes.imshow(imread(io.BytesIO(photo.png)), aspect="auto")
        axes.set_axis_off()
        self._y_in += height_in

    def finish(self) -> None:
        """Number the page, and hand it over."""
        self._y_in = _PAGE_IN[1] - _BOTTOM_IN / 2
        self.put(broken(self._title, _SMALL, 0.8 * WIDTH_IN)[0], 0.0, _SMALL, color=FAINT)
        self.put(str(self._number), WIDTH_IN, _SMALL, align="right", color=FAINT)
        self._pdf.savefig(self._page)  # type: ignore[no-untyped-call]
        take_apart(self._page)

    def _begin(self) -> None:
        from matplotlib.figure import Figure

        self._number += 1
        self._page: Figure = Figure(figsize=_PAGE_IN)
        self._y_in = _TOP_IN


def _write_title(pages: _Pages, contents: Contents) -> None:
    pages.text(contents.title, _TITLE, weight="bold")
    pages.space(_GAP_IN)
    pages.text(contents.subtitle, _TEXT)
    pages.space(_GAP_IN)
    for name, value in contents.facts:
        pages.text(f"{name}: {value}", _SMALL + 1, color=INK)


def _least_in(item: Item) -> float:
    """Return the room without which an item is better begun on a new page."""
    match item:
        case Table():
            size = _size(item)
            whole_in = _HEAD_IN + sum(_height_in(cells, size) + _RULE_IN for cells in _cells(item))
            # Of a long table the head and some rows.
            return whole_in if whole_in < _KEPT_WHOLE_IN else 2 * _HEAD_IN
        case Plot() | Photo():
            return item.size_in[1]
        case _:
            return 3 * line_height_in(_TEXT)


def _write_item(pages: _Pages, item: Item) -> None:
    pages.space(_GAP_IN)
    match item:
        case Paragraph():
            pages.text(item.text, _TEXT)
        case Note():
            pages.text(f"Note: {item.text}", _TEXT, weight="bold")
        case Formula():
            pages.text(item.text, _TEXT, color="#00457a")
        case Table():
            _write_table(pages, item)
        case Plot():
            pages.plot(item)
            pages.text(item.caption, _SMALL + 0.5, color=FAINT)
        case Photo():
            pages.photo(item)
            pages.text(item.caption, _SMALL + 0.5, color=FAINT)


def _write_table(pages: _Pages, table: Table) -> None:
    size, widths_in = _size(table), _widths_in(table)
    pages.need(_least_in(table))
    pages.text(table.caption, _SMALL + 0.5, color=FAINT)
    pages.space(_GAP_IN / 2)
    _write_head(pages, table, widths_in, size)
    for cells in _cells(table):
        if pages.need(_height_in(cells, size)):
            _write_head(pages, table, widths_in, size)
        _write_row(pages, table, cells, widths_in, size, weight="normal")
        pages.rule(_length_in(widths_in), width=0.3, color=FAINT)
        pages.advance(_RULE_IN)


def _write_head(pages: _Pages, table: Table, widths_in: Sequence[float], size: float) -> None:
    if table.groups:
        x_in, place = 0.0, 0
        lines = []
        for heading, count in table.groups:
            width_in = sum(widths_in[place : place + count]) + _CELL_GAP_IN * (count - 1)
            lines.append((broken(heading, size, width_in, is_bold=True), x_in + width_in))
            x_in, place = x_in + width_in + _CELL_GAP_IN, place + count
        for heading_lines, right_in in lines:
            for number, line in enumerate(heading_lines):
                down_in = number * line_height_in(size)
                pages.put(line, right_in, size, down_in=down_in, align="right", weight="bold")
        pages.advance(max(len(each) for each, _ in lines) * line_height_in(size) + 0.03)
    cells = [
        broken(cell, size, width, is_bold=True) for cell, width in zip(table.columns, widths_in, strict=True)
    ]
    _write_row(pages, table, cells, widths_in, size, weight="bold")
    pages.rule(_length_in(widths_in), width=0.9)
    pages.advance(0.04)


def _write_row(
    pages: _Pages,
    table: Table,
    cells: Sequence[Sequence[str]],
    widths_in: Sequence[float],
    size: float,
    *,
    weight: str,
) -> None:
    x_in = 0.0
    for column, (lines, width_in) in enumerate(zip(cells, widths_in, strict=True)):
        is_words = column == 0 or column in table.words
        for number, line in enumerate(lines):
            pages.put(
                line,
                x_in if is_words else x_in + width_in,
                size,
                down_in=number * line_height_in(size),
                align="left" if is_words else "right",
                weight=weight,
            )
        x_in += width_in + _CELL_GAP_IN
    pages.advance(_height_in(cells, size))


def _size(table: Table) -> float:
    return _MAIN_CELL if table.is_main else _CELL


@lru_cache(maxsize=4)
def _widths_in(table: Table) -> list[float]:
    return column_widths_in((table.columns, *table.rows), _size(table), WIDTH_IN, _CELL_GAP_IN)


@lru_cache(maxsize=4)
def _cells(table: Table) -> list[list[list[str]]]:
    """Return the lines of each cell of each row."""
    widths_in = _widths_in(table)
    return [
        [broken(cell, _size(table), width) for cell, width in zip(row, widths_in, strict=True)]
        for row in table.rows
    ]


def _length_in(widths_in: Sequence[float]) -> float:
    return sum(widths_in) + _CELL_GAP_IN * (len(widths_in) - 1)


def _height_in(cells: Sequence[Sequence[str]], size: float) -> float:
    return max(map(len, cells)) * line_height_in(size) + 0.03
