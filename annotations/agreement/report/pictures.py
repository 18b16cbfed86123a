"""Drawings as the bytes of picture files."""

import io
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from annotations.agreement.report.contents import Surface

_DPI = 130
_SALT = "annotations"
# Half the time of the usual 6, for a twentieth more bytes.
_PNG = {"compress_level": 3}


def picture_bytes(
    size_in: tuple[float, float], draw: Callable[["Surface"], None], kind: Literal["svg", "png"]
) -> bytes:
    """Return a drawing as SVG, or as PNG of 130 pixels an inch; pixels in an SVG are twice as fine.

    Parameters
    ----------
    size_in : (float, float)
        Width and height in inches.
    draw : callable
        Draws it into an empty figure.
    kind : str

    Returns
    -------
    bytes
        The same for the same drawing.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=size_in)
    draw(figure)
    stream = io.BytesIO()
    with warnings.catch_warnings():
        # A name may be of letters that the font lacks: the tables beside the picture have it whole.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        if kind == "png":
            figure.savefig(stream, format="png", dpi=_DPI, pil_kwargs=_PNG)
        else:
            # Names of parts come from random numbers otherwise.
            with rc_context({"svg.hashsalt": _SALT}):
                figure.savefig(stream, format="svg", dpi=2 * _DPI, metadata={"Date": None})
    take_apart(figure)
    return stream.getvalue()


def take_apart(figure: "Figure") -> None:
    """Let a figure go that nobody needs any more.

    Its thousands of parts hold each other. Left to Python's collector, those of a report keep the thread that
    collects, which is the window's, busy for a quarter of a second.
    """
    for part in figure.findobj():
        vars(part).clear()
