"""An agreement as one self-contained HTML file, to be read without the program."""

import base64
import io
import warnings
from collections.abc import Callable
from pathlib import Path

from annotations.agreement.report.contents import Contents, Formula, Item, Note, Paragraph, Plot, Table
from annotations.errors import Cancelled

_TEMPLATE = "report.html.jinja"
_PHOTO_DPI = 130
_KINDS: dict[type[Item], str] = {
    Paragraph: "paragraph",
    Note: "note",
    Formula: "formula",
    Table: "table",
    Plot: "plot",
}


def html_bytes(
    contents: Contents,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> bytes:
    """Return a report as UTF-8 HTML: styles and pictures are inside, and nothing is fetched or run.

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
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        # Names of files and annotators come from anybody: they stay text wherever they stand.
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["kind"] = lambda item: _KINDS[type(item)]
    pictures = _pictures(contents, progress, cancelled)
    text = environment.get_template(_TEMPLATE).render(
        contents=contents, picture=lambda plot: pictures[id(plot)]
    )
    return text.encode("utf-8", "backslashreplace")


def _pictures(
    contents: Contents, progress: Callable[[float], None], cancelled: Callable[[], bool]
) -> dict[int, str]:
    """Draw each plot and return it as a data URI, by the plot's identity."""
    plots = [item for section in contents.sections for item in section.items if isinstance(item, Plot)]
    drawn = {}
    for number, plot in enumerate(plots):
        if cancelled():
            raise Cancelled
        progress(number / len(plots))
        drawn[id(plot)] = _data_uri(plot)
    progress(1.0)
    return drawn


def _data_uri(plot: Plot) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=plot.size_in, layout="constrained")
    plot.draw(figure)
    stream = io.BytesIO()
    with warnings.catch_warnings():
        # A name may be of letters that the font lacks: the tables beside the plot have it whole.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        if plot.is_photo:
            figure.savefig(stream, format="png", dpi=_PHOTO_DPI)
            kind = "image/png"
        else:
            figure.savefig(stream, format="svg", metadata={"Date": None})
            kind = "image/svg+xml"
    return f"data:{kind};base64,{base64.b64encode(stream.getvalue()).decode('ascii')}"
