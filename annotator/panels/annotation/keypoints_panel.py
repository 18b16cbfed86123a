"""The table of keypoints, and the position of the active one."""

from PySide6.QtWidgets import QWidget

from annotations.documents.annotation import Annotation, KeypointAnnotation
from annotator.looks.typed_numbers import Unit
from annotator.panels.annotation.keypoints_model import Column, KeypointsModel
from annotator.panels.annotation.parts_panel import PartsPanel
from annotator.panels.annotation.parts_table import PartsTable
from annotator.panels.annotation.position_editor import PositionEditor
from annotator.session import Session

_UNITS = (
    ("um", "µm", "Show and type positions in micrometres"),
    ("voxel", "Voxels", "Show and type voxel indices"),
)

# The widest that a column shows, numbers in µm and in voxels, and the words that are its heading.
_SAMPLES: dict[int, tuple[str, ...]] = {
    Column.KEYPOINT: ("k0",),
    Column.X: ("00000", "0000.0", "x / µm"),
    Column.Y: ("00000", "0000.0", "y / µm"),
    Column.Z: ("00000", "0000.0", "z / µm"),
    Column.RESIDUAL: ("0000", "Δ"),
}


class KeypointsPanel(PartsPanel[KeypointAnnotation]):
    """Choose, type, judge, lock and clear keypoints; the selected row is the active keypoint."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(session, "keypoints", "Keypoints", parent)
        self._model = KeypointsModel(session, self)
        self._editor = PositionEditor(session, self)
        table = PartsTable(session, self._model, _SAMPLES, name="keypoints_table", title="Keypoints")
        self._fill(self._model, table, self._editor, _UNITS)

    def _parts_of(self, document: Annotation) -> tuple[KeypointAnnotation, ...]:
        return document.keypoints

    def _take_unit(self, unit: Unit) -> None:
        self._model.set_unit(unit)
        self._editor.set_unit(unit)
