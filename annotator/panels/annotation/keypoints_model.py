"""The keypoints of the open document as a table that asks the session for every change."""

from collections.abc import Callable
from enum import IntEnum
from functools import partial

from PySide6.QtCore import QObject, Qt
from PySide6.QtGui import QColor, QGuiApplication

from annotations.documents.annotation import Annotation, KeypointAnnotation
from annotations.geometry.frames import Vector, is_inside, um_to_voxel
from annotations.geometry.tool import Link
from annotator.looks import theme
from annotator.looks.typed_numbers import NotUnderstood, Unit, parse_length_um, split_triple
from annotator.panels.annotation.parts_model import PartColumn, PartsModel
from annotator.session import Session


class Column(IntEnum):
    """What a column shows."""

    KEYPOINT = 0
    X = 1
    Y = 2
    Z = 3
    RESIDUAL = 4
    STATE = 5
    SURE = 6
    LOCK = 7
    CLEAR = 8
    SOURCE = 9


COORDINATES = (Column.X, Column.Y, Column.Z)
_COLUMNS = (
    PartColumn(
        "name",
        "Name",
        "Name, and where on the tool it is; the number is the key that makes it active",
    ),
    *(
        PartColumn("number", letter, f"Position along {letter}; type a value, or three at once")
        for letter in "xyz"
    ),
    PartColumn(
        "residual",
        "Δ",
        "Residual in µm: how far the fitted tool is from it; in colour where clicks alone do not explain it",
    ),
    PartColumn(
        "state",
        "State",
        "How it is seen: placed, occluded, out of view, or unplaced (which removes its position)",
    ),
    PartColumn("sure", "Sure", "Whether you are sure of the position"),
    PartColumn("lock", "Lock", "A locked keypoint refuses every change"),
    PartColumn("clear", "Clear", "Remove the position"),
    PartColumn("source", "Source", "How the position came about"),
)


class KeypointsModel(PartsModel[KeypointAnnotation]):
    """One row a keypoint; positions in µm or voxels, a preview in place of the document's position."""

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        self._unit: Unit = "um"
        super().__init__(session, _COLUMNS, parent)

    @property
    def unit(self) -> Unit:
        """In what positions are shown, and what a bare typed number means."""
        return self._unit

    def set_unit(self, unit: Unit) -> None:
        """Show positions in µm or in voxels."""
        if unit != self._unit:
            self._unit = unit
            self._redraw(range(self.rowCount()))
            self.headerDataChanged.emit(Qt.Orientation.Horizontal, Column.X, Column.Z)

    def _parts_of(self, document: Annotation) -> tuple[KeypointAnnotation, ...]:
        return document.keypoints

    def _heading(self, column: int) -> str:
        unit = {"um": "µm", "voxel": "vox"}[self._unit]
        heading = super()._heading(column)
        return f"{heading} / {unit}" if column in COORDINATES else heading

    def _title_color(self, column: int) -> QColor | None:
        return theme.colors(QGuiApplication.palette()).axes[column - Column.X]

    def _label(self, part: KeypointAnnotation) -> str:
        tool = self._session.tool
        if tool is None:
            return ""
        return next((keypoint.label for keypoint in tool.keypoints if keypoint.name == part.name), "")

    def _link(self, name: str) -> Link | None:
        return self._session.tool.link_of(name) if self._session.tool is not None else None

    def _number(self, part: KeypointAnnotation, column: int, *, exact: bool) -> str:
        position_um, spacing_um = self._position_um(part.name), self._session.spacing_um
        if position_um is None or spacing_um is None:
            return ""
        decimals = 3 if exact else 0 if self._unit == "um" else 1
        shown = position_um if self._unit == "um" else um_to_voxel(position_um, spacing_um)
        # Adding zero turns −0.0 into 0.0.
        return f"{round(float(shown[column - Column.X]), decimals) + 0.0:.{decimals}f}"

    def _wish(self, part: KeypointAnnotation, column: int, text: str) -> Callable[[], object]:
        return partial(self._session.type_position, part.name, self._read(part, column, text))

    def _read(self, part: KeypointAnnotation, column: int, text: str) -> Vector:
        spacing_um = self._session.spacing_um
        if spacing_um is None:
            raise NotUnderstood("No volume is open")
        triple = split_triple(text)
        if triple is not None:
            x, y, z = (
                parse_length_um(each, self._unit, step) for each, step in zip(triple, spacing_um, strict=True)
            )
            return (x, y, z)
        # An unplaced keypoint takes the coordinates that are not typed from where the slices meet.
        position_um = list(self._position_um(part.name) or self._session.view.crosshair_um)
        axis = column - Column.X
        position_um[axis] = parse_length_um(text, self._unit, spacing_um[axis])
        return (position_um[0], position_um[1], position_um[2])

    def _number_tooltip(self, part: KeypointAnnotation, column: int) -> str:
        if self._position_um(part.name) is None:
            return "Not placed yet. A typed value takes the other two from the crosshair."
        if self._is_outside(part.name):
            return "This position is outside the volume, which is allowed."
        unit = "µm" if self._unit == "um" else "voxels"
        came = f", {part.source}" if part.source else ""
        return f"{self._number(part, column, exact=True)} {unit}{came}"

    def _number_color(self, part: KeypointAnnotation) -> QColor | None:
        return theme.colors(QGuiApplication.palette()).outside if self._is_outside(part.name) else None

    def _residual_um(self, part: KeypointAnnotation) -> float | None:
        fit = self._session.tool_fit
        return fit.residuals_um.get(part.name) if fit is not None else None

    def _position_um(self, name: str) -> Vector | None:
        return self._session.shown_positions_um().get(name)

    def _is_outside(self, name: str) -> bool:
        position_um, volume = self._position_um(name), self._session.volume
        spacing_um = self._session.spacing_um
        if position_um is None or volume is None or spacing_um is None:
            return False
        return not is_inside(position_um, volume.shape, spacing_um)
