"""A report as one self-contained HTML file, to be read without the program."""

import base64
from collections.abc import Callable
from pathlib import Path

from annotations.agreement.report.contents import Contents, Formula, Item, Note, Paragraph, Photo, Plot, Table
from annotations.agreement.report.pictures import picture_bytes
from annotations.errors import Cancelled

_TEMPLATE = "report.html.jinja"
_KINDS: dict[type[Item], str] = {
    Paragraph: "paragraph",
    Note: "note",
    Formula: "formula",
    Table: "table",
    Plot: "picture",
    Photo: "picture",
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
        contents=contents, picture=lambda item: pictures[id(item)]
    )
    return text.encode("utf-8", "backslashreplace")


def _pictures(
    contents: Contents, progress: Callable[[float], None], cancelled: Callable[[], bool]
) -> dict[int, str]:
    """Return each picture as a data URI, by the identity of its item."""
    items = [
        item for section in contents.sections for item in section.items if isinstance(item, Plot | Photo)
    ]
    drawn = {}
    for number, item in enumerate(items):
        if cancelled():
            raise Cancelled
        progress(number / len(items))
        if isinstance(item, Photo):
            drawn[id(item)] = _data_uri("image/png", item.png)
        else:
            drawn[id(item)] = _data_uri("image/svg+xml", picture_bytes(item.size_in, item.draw, "svg"))
    progress(1.0)
    return drawn


def _data_uri(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
