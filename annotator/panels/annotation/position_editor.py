"""The position of the active keypoint in three spin boxes: everything moves with the value."""

from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QWidget

from annotations.geometry.frames import Vector, um_to_voxel, vector, voxel_to_um
from annotator.looks.labels import ColoredLabel, ElidedText, axis_color
from annotator.looks.typed_numbers import Unit
from annotator.panels.widgets.number_fields import NumberField, NumberFields
from annotator.session import Session


class PositionEditor(QWidget):
    """Previews while values are typed or stepped; keeps them on Enter, on leaving, or once stepping rests.

    What is being edited is the session's preview: Esc drops it here as everywhere. Going from one of the
    boxes to the next is not leaving: x, y and z typed in a row are one edit.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._unit: Unit = "um"
        self.setObjectName("position_editor")
        self._title = ElidedText(name="position_title")
        # Elided, it never makes the panel wide.
        self._title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._title, 0, 0, 1, 6)
        fields = [NumberField(f"position_{letter}", f"{letter} of the active keypoint") for letter in "xyz"]
        for axis, field in enumerate(fields):
            label = ColoredLabel(f"&{'xyz'[axis]}")
            label.set_color(axis_color(axis))
            label.setBuddy(field)
            layout.addWidget(label, 1, axis * 2)
            layout.addWidget(field, 1, axis * 2 + 1)
            layout.setColumnStretch(axis * 2 + 1, 1)
        self._fields = NumberFields(fields, self)
        self._fields.number_requested.connect(self._on_fields_number_requested)
        self._fields.settled.connect(self._on_fields_settled)
        session.view_changed.connect(self._on_session_view_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw()

    def set_unit(self, unit: Unit) -> None:
        """Show and read µm or voxels; a step is one voxel in either."""
        self._unit = unit
        self._draw()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape:
            super().keyPressEvent(event)
            return
        self._fields.stop()
        # With nothing to drop, Esc goes on to the window: a person wants out of the box.
        event.setAccepted(self._is_editing())
        if self._is_editing():
            self._session.drop_preview()
        self._draw(over_typing=True)

    @Slot(int, float)
    def _on_fields_number_requested(self, axis: int, number: float) -> None:
        name, position_um = self._session.view.active_part, self._shown_um()
        spacing_um = self._session.spacing_um
        if name is None or position_um is None or spacing_um is None:
            return
        moved = list(position_um)
        moved[axis] = number if self._unit == "um" else float(voxel_to_um(number, spacing_um[axis]))
        self._session.begin_preview(name, vector(moved), "typed")
        self._session.look(crosshair_um=vector(moved))

    @Slot()
    def _on_fields_settled(self) -> None:
        # Not `keep_preview`: that is for clicks, and goes on to the next keypoint, as typing should not.
        self._session.settle_typing()

    @Slot(object, object)
    def _on_session_view_changed(self, before: object, after: object) -> None:
        self._draw()

    @Slot(object, object)
    def _on_session_document_changed(self, before: object, after: object) -> None:
        self._draw()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._draw()

    def _is_editing(self) -> bool:
        preview = self._session.view.preview
        return preview is not None and preview.source == "typed"

    def _shown_um(self) -> Vector | None:
        """Where the active keypoint is; where the slices meet, as an offer, if it is not placed."""
        name = self._session.view.active_part
        document = self._session.document
        if name is None or document is None or document.method != "keypoints":
            return None
        return self._session.shown_positions_um().get(name, self._session.view.crosshair_um)

    def _draw(self, *, over_typing: bool = False) -> None:
        name, spacing_um = self._session.view.active_part, self._session.spacing_um
        position_um = self._shown_um()
        document = self._session.document
        usable = False
        if name is None or position_um is None or spacing_um is None or document is None:
            none_active = "No active keypoint: choose one in the table or by its number key"
            self._title.setText("No volume is open" if document is None else none_active)
            for field in self._fields.fields:
                field.show_nothing()
        else:
            keypoint = document.keypoint(name)
            usable = not keypoint.locked and not self._session.read_only_reason
            if self._is_editing():
                state = "Enter keeps it, Esc drops it"
            elif self._session.read_only_reason:
                state = "read-only"
            elif keypoint.locked:
                state = "locked"
            elif keypoint.position_um is None:
                state = "unplaced, begins at the crosshair"
            else:
                state = keypoint.state.replace("_", " ")
            self._title.setText(f"{name} · {state}")
            shown = position_um if self._unit == "um" else um_to_voxel(position_um, spacing_um)
            steps = (1.0, 1.0, 1.0) if self._unit == "voxel" else spacing_um
            for field, number, step in zip(self._fields.fields, shown, steps, strict=True):
                field.show_number(float(number), step, over_typing=over_typing)
        for axis, field in enumerate(self._fields.fields):
            field.setEnabled(usable)
            field.setToolTip(
                f"Position along {'xyz'[axis]} in {'µm' if self._unit == 'um' else 'voxels'}; "
                "the arrows step by one voxel. Everything moves with the value; Enter keeps it, Esc drops it"
            )
