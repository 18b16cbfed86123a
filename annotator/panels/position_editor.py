"""The position of the active keypoint in three spin boxes: everything moves with the value."""

import math

from PySide6.QtCore import QSignalBlocker, Qt, QTimer, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QGridLayout, QSizePolicy, QWidget

from annotations.geometry.frames import Vector, um_to_voxel, vector, voxel_to_um
from annotator.looks.labels import ColoredLabel, ElidedText, axis_color
from annotator.looks.typed_numbers import Unit
from annotator.panels.quiet_inputs import QuietSpinBox
from annotator.session import Session

_SETTLE_MS = 700
_DECIMALS = 2
_FARTHEST = 1e9


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
        self._boxes: list[QuietSpinBox] = []
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._title, 0, 0, 1, 6)
        for axis, letter in enumerate("xyz"):
            box = QuietSpinBox()
            box.setObjectName(f"position_{letter}")
            box.setAccessibleName(f"{letter} of the active keypoint")
            box.setDecimals(_DECIMALS)
            box.setRange(-_FARTHEST, _FARTHEST)
            # Its own hint would leave room for the largest number allowed.
            box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            box.setMinimumWidth(
                box.fontMetrics().horizontalAdvance("00000.0") + box.fontMetrics().height() * 2
            )
            box.valueChanged.connect(self._on_box_value_changed)
            box.stepped.connect(self._on_box_stepped)
            box.editingFinished.connect(self._on_box_editing_finished)
            label = ColoredLabel(f"&{letter}")
            label.set_color(axis_color(axis))
            label.setBuddy(box)
            layout.addWidget(label, 1, axis * 2)
            layout.addWidget(box, 1, axis * 2 + 1)
            layout.setColumnStretch(axis * 2 + 1, 1)
            self._boxes.append(box)
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(_SETTLE_MS)
        self._rest.timeout.connect(self._on_rest_timeout)
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
        self._rest.stop()
        # With nothing to drop, Esc goes on to the window: a person wants out of the box.
        event.setAccepted(self._is_editing())
        if self._is_editing():
            self._session.drop_preview()
        self._draw(over_typing=True)

    @Slot()
    def _on_box_value_changed(self) -> None:
        name = self._session.view.active_part
        position_um = self._shown_um()
        box = self.sender()
        spacing_um = self._session.spacing_um
        if name is None or position_um is None or spacing_um is None or not isinstance(box, QuietSpinBox):
            return
        axis = self._boxes.index(box)
        shown = position_um if self._unit == "um" else um_to_voxel(position_um, spacing_um)
        if _looks_like(box.value(), float(shown[axis])):
            # Enter repeats the value that is shown, rounded: that is no wish to round the position.
            return
        moved = list(position_um)
        moved[axis] = box.value() if self._unit == "um" else float(voxel_to_um(box.value(), spacing_um[axis]))
        # Only steps come to rest by themselves; a person may pause in the middle of a number.
        self._rest.stop()
        self._session.begin_preview(name, vector(moved), "typed")
        self._session.look(crosshair_um=vector(moved))

    @Slot()
    def _on_box_stepped(self) -> None:
        self._rest.start()

    @Slot()
    def _on_box_editing_finished(self) -> None:
        focused = QApplication.focusWidget()
        if focused is self.sender() or focused not in self._boxes:
            self._keep()

    @Slot()
    def _on_rest_timeout(self) -> None:
        self._keep()

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

    def _keep(self) -> None:
        self._rest.stop()
        # Not `keep_preview`: that is for clicks, and goes on to the next keypoint, as typing should not.
        self._session.settle_typing()

    def _shown_um(self) -> Vector | None:
        """Where the active keypoint is; where the slices meet, as an offer, if it is not placed."""
        name = self._session.view.active_part
        if name is None or self._session.document is None:
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
            for box in self._boxes:
                # The last numbers were another volume's.
                with QSignalBlocker(box):
                    box.clear()
        else:
            keypoint = document.keypoint(name)
            usable = not keypoint.locked
            if self._is_editing():
                state = "Enter keeps it, Esc drops it"
            elif keypoint.locked:
                state = "locked"
            elif keypoint.position_um is None:
                state = "unplaced, begins at the crosshair"
            else:
                state = keypoint.state.replace("_", " ")
            self._title.setText(f"{name} · {state}")
            shown = position_um if self._unit == "um" else um_to_voxel(position_um, spacing_um)
            for axis, box in enumerate(self._boxes):
                self._show(
                    box, float(shown[axis]), 1.0 if self._unit == "voxel" else spacing_um[axis], over_typing
                )
        for axis, box in enumerate(self._boxes):
            box.setEnabled(usable)
            box.setToolTip(
                f"Position along {'xyz'[axis]} in {'µm' if self._unit == 'um' else 'voxels'}; "
                "the arrows step by one voxel. Everything moves with the value; Enter keeps it, Esc drops it"
            )

    @staticmethod
    def _show(box: QuietSpinBox, value: float, step: float, over_typing: bool) -> None:
        # Setting either rewrites the text, and would move the cursor of the person who is typing it.
        if box.singleStep() != step:
            box.setSingleStep(step)
        # A box that was empty and out of use has kept its value without showing it.
        if over_typing or not box.isEnabled() or not _looks_like(box.value(), value):
            with QSignalBlocker(box):
                box.setValue(value)


def _looks_like(first: float, second: float) -> bool:
    """Say whether two values are the same in a box's decimals."""
    return math.isclose(first, second, rel_tol=0, abs_tol=0.6 * 10**-_DECIMALS)
