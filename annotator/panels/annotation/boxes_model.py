"""The boxes of the open document as a table that asks the session for every change."""

from collections.abc import Callable
from dataclasses import replace
from enum import IntEnum
from functools import partial

from PySide6.QtCore import QObject, Qt

from annotations.documents.annotation import Annotation, BoxAnnotation
from annotations.geometry.boxes import Box
from annotations.geometry.tool import Link
from annotator.looks.typed_numbers import NotUnderstood, SizeUnit, parse_size_um, split_triple
from annotator.panels.annotation.parts_model import PartColumn, PartsModel
from annotator.session import Session


class Column(IntEnum):
    """What a column shows."""

    LINK = 0
    LENGTH = 1
    WIDTH = 2
    HEIGHT = 3
    RESIDUAL = 4
    STATE = 5
    SURE = 6
    LOCK = 7
    CLEAR = 8
    SOURCE = 9


SIZES = (Column.LENGTH, Column.WIDTH, Column.HEIGHT)
FIXED_SECTION = "The cross-section is held as it is: tick “Free cross-section” to change it"
"""Why width and height cannot be changed."""

# There is no room for it in the headings; buttons above the table say it.
_UNITS: dict[SizeUnit, str] = {"um": "µm", "mm": "mm"}
_COLUMNS = (
    PartColumn("name", "Link", "Link, and its ends; the number is the key that makes it active"),
    PartColumn("number", "Length", "Along the box's own x, from the base to the tip; its centre stays"),
    PartColumn("number", "Width", "Along the box's own y, the hinge's axis; its centre stays"),
    PartColumn("number", "Height", "Along the box's own z; its centre stays"),
    PartColumn(
        "residual",
        "Δ",
        "Residual in µm: how far the fitted tool is from the end of the box that fits less; in colour where "
        "clicks alone do not explain it",
    ),
    PartColumn(
        "state", "State", "How it is seen: placed, occluded, out of view, or unplaced (which removes the box)"
    ),
    PartColumn("sure", "Sure", "Whether you are sure of the box"),
    PartColumn("lock", "Lock", "A locked box refuses every change"),
    PartColumn("clear", "Clear", "Remove the box"),
    PartColumn("source", "Source", "How the box came about"),
)


class BoxesModel(PartsModel[BoxAnnotation]):
    """One row a link; the size of its box in µm or mm, a draft in place of the document's box."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        self._unit: SizeUnit = "um"
        super().__init__(session, _COLUMNS, parent)

    @property
    def unit(self) -> SizeUnit:
        """In what sizes are shown, and what a bare typed number means."""
        return self._unit

    def set_unit(self, unit: SizeUnit) -> None:
        """Show sizes in µm or in mm."""
        if unit != self._unit:
            self._unit = unit
            self._redraw(range(self.rowCount()))
            self.headerDataChanged.emit(Qt.Orientation.Horizontal, Column.LENGTH, Column.HEIGHT)

    def _parts_of(self, document: Annotation) -> tuple[BoxAnnotation, ...]:
        return document.boxes

    def _label(self, part: BoxAnnotation) -> str:
        link = self._link(part.name)
        return f"{link.base}–{link.tip}" if link is not None else ""

    def _link(self, name: str) -> Link | None:
        tool = self._session.tool
        return next((link for link in tool.links if link.name == name), None) if tool is not None else None

    def _number(self, part: BoxAnnotation, column: int, *, exact: bool) -> str:
        if part.size_um is None:
            return ""
        size_um = part.size_um[column - Column.LENGTH]
        if self._unit == "mm":
            return f"{size_um / 1000:.{6 if exact else 3}f}"
        return f"{size_um:.{3 if exact else 0}f}"

    def _takes_number(self, part: BoxAnnotation, column: int) -> bool:
        if part.box is None:
            return False
        return column == Column.LENGTH or part.link in self._session.view.free_links

    def _wish(self, part: BoxAnnotation, column: int, text: str) -> Callable[[], object]:
        return partial(self._session.type_box, part.link, self._read(part, column, text))

    def _read(self, part: BoxAnnotation, column: int, text: str) -> Box:
        if part.box is None:
            raise NotUnderstood("Place the box first")
        triple = split_triple(text)
        if triple is not None:
            if part.link not in self._session.view.free_links:
                raise NotUnderstood(FIXED_SECTION)
            length_um, width_um, height_um = (parse_size_um(each, self._unit) for each in triple)
            return replace(part.box, size_um=(length_um, width_um, height_um))
        sizes_um = list(part.box.size_um)
        sizes_um[column - Column.LENGTH] = parse_size_um(text, self._unit)
        return replace(part.box, size_um=(sizes_um[0], sizes_um[1], sizes_um[2]))

    def _residual_um(self, part: BoxAnnotation) -> float | None:
        fit, link = self._session.tool_fit, self._link(part.name)
        if fit is None or link is None or part.box is None:
            return None
        return max(
            (fit.residuals_um[end] for end in (link.base, link.tip) if end in fit.residuals_um), default=None
        )

    def _number_tooltip(self, part: BoxAnnotation, column: int) -> str:
        if part.box is None:
            return "Not placed yet: click the two ends of the link, or type its centre below."
        came = f", {part.source}" if part.source else ""
        shown = f"{self._number(part, column, exact=True)} {_UNITS[self._unit]}{came}"
        return shown if self._takes_number(part, column) else f"{shown}. {FIXED_SECTION}"
