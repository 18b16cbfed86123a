"""How wide text is in print, and where its lines are broken."""

from collections.abc import Sequence
from functools import lru_cache

_POINTS_PER_INCH = 72.0
_LEADING = 1.35


def line_height_in(size: float) -> float:
    """Return the distance between two lines, in inches; ``size`` is that of the letters in points."""
    return size * _LEADING / _POINTS_PER_INCH


def line_width_in(text: str, size: float, *, is_bold: bool = False) -> float:
    """Return the width of text in one line, in inches."""
    words = text.split(" ")
    # Word by word: the same words come again and again, the same lines do not.
    return sum(_word_width_in(word, size, is_bold) for word in words) + (len(words) - 1) * _word_width_in(
        " ", size, is_bold
    )


def broken(text: str, size: float, width_in: float, *, is_bold: bool = False) -> list[str]:
    """Return text as lines that fit a width; a word that is wider is broken too, so that nothing is lost."""
    lines: list[str] = []
    line = ""
    for word in printable(text).split(" "):
        longer = f"{line} {word}" if line else word
        if line_width_in(longer, size, is_bold=is_bold) <= width_in:
            line = longer
            continue
        if line:
            lines.append(line)
        line = word
        while line_width_in(line, size, is_bold=is_bold) > width_in and len(line) > 1:
            count = _fitting(line, size, width_in, is_bold)
            lines.append(line[:count])
            line = line[count:]
    return [*lines, line]


def column_widths_in(
    rows: Sequence[Sequence[str]], size: float, width_in: float, gap_in: float
) -> list[float]:
    """Return the widths of a table's columns in inches, so that they fill no more than a width.

    Each column is as wide as its widest cell where there is room; else those give way whose cells can be
    broken between words.

    Parameters
    ----------
    rows : sequence of sequence of str
        The first has the headings, in bold, which may be broken whenever a cell below is narrower.
    size : float
        Of the letters, in points.
    width_in, gap_in : float
        Of the whole table, and between two columns.
    """
    columns = list(zip(*rows, strict=True))
    room_in = width_in - gap_in * (len(columns) - 1)
    least = [max(_widest_word_in(cell, size) for cell in column) for column in columns]
    most = [
        max([low, *(line_width_in(printable(cell), size, is_bold=False) for cell in column[1:])])
        for low, column in zip(least, columns, strict=True)
    ]
    if sum(most) <= room_in:
        return most
    if sum(least) < room_in:
        share = (room_in - sum(least)) / (sum(most) - sum(least))
        return [low + share * (high - low) for low, high in zip(least, most, strict=True)]
    # Even single words do not fit: the widest columns break theirs.
    return _leveled(least, room_in)


def printable(text: str) -> str:
    """Return text in one line, without what has no shape."""
    return "".join(letter if letter.isprintable() or letter == "\u00a0" else "�" for letter in text)


def _leveled(widths_in: Sequence[float], room_in: float) -> list[float]:
    """Return widths cut to a common largest one, so that they fit."""
    low, high = 0.0, max(widths_in)
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (
            (middle, high) if sum(min(each, middle) for each in widths_in) <= room_in else (low, middle)
        )
    return [min(each, low) for each in widths_in]


def _widest_word_in(cell: str, size: float) -> float:
    return max(line_width_in(word, size, is_bold=True) for word in printable(cell).split(" "))


def _fitting(word: str, size: float, width_in: float, is_bold: bool) -> int:
    """Return how many letters of a word fit, at least one."""
    low, high = 1, len(word)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (
            (middle, high)
            if line_width_in(word[:middle], size, is_bold=is_bold) <= width_in
            else (low, middle)
        )
    return low


@lru_cache(maxsize=20_000)
def _word_width_in(word: str, size: float, is_bold: bool) -> float:
    import warnings

    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    if not word:
        return 0.0
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        properties = FontProperties(size=size, weight="bold" if is_bold else "normal")
        width, _, _ = text_to_path.get_text_width_height_descent(word, properties, False)
    return float(width) / _POINTS_PER_INCH
