"""The table of keypoints, and the position of the active one."""

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from annotations.documents.annotation import Annotation
from annotator.looks.labels import WrappedText
from annotator.looks.naming import named
from annotator.panels.keypoints_model import Column, KeypointsModel
from annotator.panels.parts_table import PartsTable
from annotator.panels.position_editor import PositionEditor
from annotator.session import Session

_UNITS = (
    ("um", "µm", "Show and type positions in micrometres"),
    ("voxel", "Voxels", "Show and type voxel indices"),
)

# The widest that a coordinate's column shows, and the words that are its heading.
_SAMPLES: dict[int, tuple[str, ...]] = {
    Column.X: ("000000", "x / µm"),
    Column.Y: ("000000", "y / µm"),
    Column.Z: ("000000", "z / µm"),
}


class KeypointsPanel(QWidget):
    """Choose, type, judge, lock and clear keypoints; the selected row is the active keypoint."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.setObjectName("keypoints_panel")
        self.setAccessibleName("Keypoints")

        self._model = KeypointsModel(session, self)
        self._model.not_understood.connect(self._on_model_not_understood)
        self._table = PartsTable(session, self._model, _SAMPLES, name="keypoints_table", title="Keypoints")
        self._editor = PositionEditor(session, self)
        self._progress = named(QLabel(), "keypoints_progress")
        self._progress.setAccessibleName("Keypoints placed")
        self._message = WrappedText(name="keypoints_message")
        self._message.set_color(lambda colors: colors.error)
        self._message.setVisible(False)
        self._units = QButtonGroup(self)

        header = QHBoxLayout()
        header.addWidget(self._progress, 1)
        for unit, text, tooltip in _UNITS:
            button = named(QToolButton(), f"keypoints_unit_{unit}")
            button.setText(text)
            button.setToolTip(tooltip)
            button.setAccessibleName(tooltip)
            button.setCheckable(True)
            button.setChecked(unit == self._model.unit)
            button.setProperty("unit", unit)
            self._units.addButton(button)
            header.addWidget(button)
        self._units.buttonClicked.connect(self._on_unit_button_clicked)

        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[self.fontMetrics().height() // 3] * 4)
        layout.addLayout(header)
        layout.addWidget(self._table)
        layout.addWidget(self._message)
        layout.addWidget(self._editor)
        layout.addStretch(1)

        session.document_changed.connect(self._on_session_document_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw_progress()

    @Slot(object)
    def _on_unit_button_clicked(self, button: QToolButton) -> None:
        unit = button.property("unit")
        self._model.set_unit(unit)
        self._editor.set_unit(unit)

    @Slot(str)
    def _on_model_not_understood(self, message: str) -> None:
        self._message.setText(message)
        self._message.setVisible(True)

    @Slot(object, object)
    def _on_session_document_changed(self, before: Annotation | None, after: Annotation | None) -> None:
        self._message.setVisible(False)
        self._draw_progress()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._message.setVisible(False)
        self._draw_progress()

    def _draw_progress(self) -> None:
        document = self._session.document
        if document is None:
            self._progress.setText("No volume is open")
        else:
            self._progress.setText(
                f"{len(document.positions_um)} of {len(document.keypoints)} have a position"
            )
