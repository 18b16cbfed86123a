"""The active box by numbers: centre, size and rotation; everything moves with them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.annotation import BoxAnnotation
from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotator.looks.labels import ColoredLabel, ElidedText, PickColor, axis_color
from annotator.looks.naming import named
from annotator.panels.annotation.boxes_model import FIXED_SECTION
from annotator.panels.annotation.quaternion_editor import QuaternionEditor
from annotator.panels.widgets.number_fields import NumberField, NumberFields
from annotator.session import Session

_SIZES = ("length", "width", "height")
_TURNS = ("yaw", "pitch", "roll")
_SMALLEST_UM = 0.01
_LARGEST_TURN_DEG = 360.0
# A rotation that was stored and read again may differ in its last digits.
_SAME_ROTATION = 1e-9
_KEEPING = "Enter keeps it, Esc drops it"
_SIZE_TOOLTIPS = (
    "Length in µm along the box's own x, from the base to the tip",
    "Width in µm along the box's own y, the hinge's axis",
    "Height in µm along the box's own z",
)
_TURN_TOOLTIPS = (
    "Turn about z in degrees; the first of the three",
    "Turn about the y that the yaw leaves, in degrees",
    "Turn about the box's own x in degrees; the last of the three",
)
_TURN_OVER = (
    "Turn the box 180° about its own x. The body stays as it is, but its own +y, the hinge's axis, points "
    "the other way. Seen from the tip of the arrow that shows +y, a positive angle bends the next link "
    "anticlockwise: where an angle has the wrong sign, turn the box over"
)


class BoxEditor(QWidget):
    """Previews while numbers are typed or stepped; keeps them on Enter, on leaving, or once stepping rests.

    What is being edited is the session's draft: Esc drops it here as everywhere. Centre, size, angles and
    quaternion are a group each: going from one number of a group to the next is not leaving.

    Signals
    -------
    refused : str
        Why what was typed is no rotation; empty once it is.
    """

    refused = Signal(str)

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        # Near the vertical many angles make one rotation: those that a person typed go on being shown.
        self._typed_deg: Vector = (0.0, 0.0, 0.0)
        self._kept_deg = self._typed_deg
        self._drawn_nothing = ""
        self.setObjectName("box_editor")
        self._title = ElidedText(name="box_title")
        # Elided, it never makes the panel wide.
        self._title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._title)
        grid = QGridLayout()
        layout.addLayout(grid)
        self._center = self._add_row(
            grid,
            0,
            [NumberField(f"box_{letter}", f"{letter} of the box's centre in µm") for letter in "xyz"],
            [f"{letter} / µm" for letter in "xyz"],
            [axis_color(axis) for axis in range(3)],
        )
        self._center.number_requested.connect(self._on_center_number_requested)
        self._size = self._add_row(
            grid,
            2,
            [NumberField(f"box_{name}", f"{name} of the box in µm", lowest=_SMALLEST_UM) for name in _SIZES],
            [f"{name.title()} / µm" for name in _SIZES],
        )
        self._size.number_requested.connect(self._on_size_number_requested)
        self._free = named(QCheckBox("Free cross-section"), "box_free_cross_section")
        self._free.setToolTip("Let this box change its width and height; otherwise they are held as they are")
        self._free.clicked.connect(self._on_free_clicked)
        self._turn_over = named(QPushButton("Turn over"), "box_turn_over", tooltip=_TURN_OVER)
        self._turn_over.clicked.connect(self._on_turn_over_clicked)
        row = QHBoxLayout()
        row.addWidget(self._free, 1)
        row.addWidget(self._turn_over)
        grid.addLayout(row, 4, 0, 1, 3)
        self._angles = self._add_row(
            grid,
            5,
            [
                NumberField(
                    f"box_{name}",
                    f"{name} of the box in degrees",
                    lowest=-_LARGEST_TURN_DEG,
                    highest=_LARGEST_TURN_DEG,
                )
                for name in _TURNS
            ],
            [f"{name.title()} / °" for name in _TURNS],
        )
        self._angles.number_requested.connect(self._on_angles_number_requested)
        self._quaternion = QuaternionEditor()
        self._quaternion.setToolTip(
            "The rotation as a unit quaternion; of any length, all four together are made one of length 1. "
            + _KEEPING
        )
        self._quaternion.rotation_requested.connect(self._on_quaternion_rotation_requested)
        self._quaternion.settled.connect(self._on_settled)
        self._quaternion.refused.connect(self.refused)
        layout.addWidget(self._quaternion)
        session.view_changed.connect(self._on_session_view_changed)
        session.document_changed.connect(self._on_session_document_changed)
        session.volume_changed.connect(self._on_session_volume_changed)
        self._draw()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape:
            super().keyPressEvent(event)
            return
        self._stop()
        # With nothing to drop, Esc goes on to the window: a person wants out of the field.
        is_editing = self._is_editing() or self._quaternion.is_typed
        event.setAccepted(is_editing)
        if is_editing:
            self._session.drop_preview()
            self.refused.emit("")
        self._draw(over_typing=True)

    def _add_row(
        self,
        grid: QGridLayout,
        row: int,
        fields: Sequence[NumberField],
        titles: Sequence[str],
        colors: Sequence[PickColor | None] = (None, None, None),
    ) -> NumberFields:
        """Add three fields under their titles to a grid, and return them as one group."""
        for column, (field, title, color) in enumerate(zip(fields, titles, colors, strict=True)):
            label = ColoredLabel(title)
            label.set_color(color)
            label.setBuddy(field)
            grid.addWidget(label, row, column)
            grid.addWidget(field, row + 1, column)
            grid.setColumnStretch(column, 1)
        group = NumberFields(fields, self)
        group.settled.connect(self._on_settled)
        return group

    @Slot(int, float)
    def _on_center_number_requested(self, axis: int, number: float) -> None:
        if (box := self._shown()) is not None:
            center_um = list(box.center_um)
            center_um[axis] = number
            self._preview(replace(box, center_um=vector(center_um)))
            self._session.look(crosshair_um=vector(center_um))

    @Slot(int, float)
    def _on_size_number_requested(self, axis: int, number: float) -> None:
        if (box := self._shown()) is not None:
            size_um = list(box.size_um)
            size_um[axis] = number
            self._preview(replace(box, size_um=vector(size_um)))

    @Slot(int, float)
    def _on_angles_number_requested(self, axis: int, number: float) -> None:
        if (box := self._shown()) is not None:
            angles_deg = list(self._angles_of(box))
            angles_deg[axis] = number
            self._typed_deg = vector(angles_deg)
            self._preview(replace(box, rotation_wxyz=rotations.from_yaw_pitch_roll(*angles_deg)))

    @Slot(tuple)
    def _on_quaternion_rotation_requested(self, rotation_wxyz: rotations.Quaternion) -> None:
        if (box := self._shown()) is not None:
            self._preview(replace(box, rotation_wxyz=rotation_wxyz))

    @Slot()
    def _on_settled(self) -> None:
        self._keep()

    @Slot(bool)
    def _on_free_clicked(self, checked: bool) -> None:
        self._keep()
        if (part := self._part()) is not None:
            self._session.free_cross_section(part.link, checked)

    @Slot()
    def _on_turn_over_clicked(self) -> None:
        self._keep()
        self._session.turn_over()

    @Slot(object, object)
    def _on_session_view_changed(self, before: object, after: object) -> None:
        self._draw()

    @Slot(object, object)
    def _on_session_document_changed(self, before: object, after: object) -> None:
        self._draw()

    @Slot()
    def _on_session_volume_changed(self) -> None:
        self._draw()

    def _part(self) -> BoxAnnotation | None:
        """Return the active box as the document has it."""
        document, name = self._session.document, self._session.view.active_part
        return next((box for box in document.boxes if box.link == name), None) if document else None

    def _shown(self) -> Box | None:
        """Return the active box as shown; where it is unplaced, an offer: the tool's, at the crosshair."""
        part, tool = self._part(), self._session.tool
        if part is None or tool is None:
            return None
        shown = self._session.active_box()
        if shown is not None:
            return shown
        link = tool.link(part.link)
        size_um = (link.length_um, *link.cross_section_um)
        return Box(self._session.view.crosshair_um, size_um, (1.0, 0.0, 0.0, 0.0))

    def _angles_of(self, box: Box) -> Vector:
        """Return yaw, pitch and roll of a box: those that were typed, as long as they make its rotation."""
        for angles_deg in (self._typed_deg, self._kept_deg):
            if _is_same_rotation(rotations.from_yaw_pitch_roll(*angles_deg), box.rotation_wxyz):
                return angles_deg
        self._typed_deg = rotations.yaw_pitch_roll_deg(box.rotation_wxyz)
        return self._typed_deg

    def _preview(self, box: Box) -> None:
        if (part := self._part()) is not None:
            self._session.preview_box(part.link, box)
            # Where the session refused, everything goes back to how it is.
            self._draw()

    def _is_editing(self) -> bool:
        draft = self._session.view.draft
        return draft is not None and draft.is_typed

    def _stop(self) -> None:
        for group in (self._center, self._size, self._angles):
            group.stop()

    def _keep(self) -> None:
        self._stop()
        self._session.settle_typing()
        if (box := self._shown()) is not None:
            self._kept_deg = self._angles_of(box)
        self._draw(over_typing=True)

    def _draw(self, *, over_typing: bool = False) -> None:
        part, box, spacing_um = self._part(), self._shown(), self._session.spacing_um
        if part is None or box is None or spacing_um is None:
            self._draw_nothing()
            return
        self._drawn_nothing = ""
        is_read_only = bool(self._session.read_only_reason)
        usable, is_free = not part.locked and not is_read_only, part.link in self._session.view.free_links
        if self._is_editing():
            state = _KEEPING
        elif is_read_only:
            state = "read-only"
        elif part.locked:
            state = "locked"
        elif part.box is None:
            state = "unplaced, begins at the crosshair"
        else:
            state = part.state.replace("_", " ")
        self._title.setText(f"{part.link} · {state}")
        # What one voxel is along each of the box's own axes.
        own_steps_um = 1 / np.linalg.norm(box.axes / np.asarray(spacing_um)[:, None], axis=0)
        for group, numbers, steps in (
            (self._center, box.center_um, spacing_um),
            (self._size, box.size_um, own_steps_um.tolist()),
            (self._angles, self._angles_of(box), (1.0, 1.0, 1.0)),
        ):
            for field, number, step in zip(group.fields, numbers, steps, strict=True):
                field.show_number(number, step, over_typing=over_typing)
        self._quaternion.show_rotation(box.rotation_wxyz, over_typing=over_typing)
        self._free.setChecked(is_free)
        self._enable(usable, is_free=is_free, is_placed=part.box is not None)

    def _draw_nothing(self) -> None:
        document = self._session.document
        none_active = "No active link: choose one in the table or by its number key"
        title = "No volume is open" if document is None else none_active
        if title == self._drawn_nothing:
            # As always where keypoints are annotated: every change of the view comes here.
            return
        self._drawn_nothing = title
        self._title.setText(title)
        for group in (self._center, self._size, self._angles):
            for field in group.fields:
                field.show_nothing()
        self._quaternion.show_rotation(None, over_typing=True)
        self._free.setChecked(False)
        self._enable(False, is_free=False, is_placed=False)

    def _enable(self, usable: bool, *, is_free: bool, is_placed: bool) -> None:
        for axis, field in enumerate(self._center.fields):
            field.setEnabled(usable)
            field.setToolTip(
                f"Centre along {'xyz'[axis]} in µm; the arrows step by one voxel. "
                f"Everything moves with the value; {_KEEPING}"
            )
        for axis, field in enumerate(self._size.fields):
            may_change = axis == 0 or is_free
            field.setEnabled(usable and may_change)
            centre_stays = f"the centre stays. The arrows step by one voxel; {_KEEPING}"
            field.setToolTip(f"{_SIZE_TOOLTIPS[axis]}; {centre_stays}" if may_change else FIXED_SECTION)
        for axis, field in enumerate(self._angles.fields):
            field.setEnabled(usable)
            field.setToolTip(f"{_TURN_TOOLTIPS[axis]}. The arrows step by one degree; {_KEEPING}")
        self._quaternion.setEnabled(usable)
        self._free.setEnabled(usable)
        self._turn_over.setEnabled(usable and is_placed)


def _is_same_rotation(first: rotations.Quaternion, second: rotations.Quaternion) -> bool:
    # At half turns w is zero, and the sign of the whole quaternion a matter of rounding.
    difference, total = np.subtract(first, second), np.add(first, second)
    return min(np.abs(difference).max(), np.abs(total).max()) <= _SAME_ROTATION
