"""The spacing that a volume's file leaves out, asked for once."""

from pathlib import Path

import numpy as np
from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QVBoxLayout,
    QWidget,
)

from annotations.errors import UserError
from annotations.geometry.frames import Vector
from annotations.volumes import (
    OMES_REALTIME_SPACING_UM,
    OMES_SPACING_UM,
    Volume,
    folder_answers_path,
    sidecar_path,
    validate_spacing_um,
)
from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named
from annotator.looks.typed_numbers import NotUnderstood, parse_number
from annotator.session.volumes.spacing_answer import SpacingAnswer

_PRESETS: tuple[tuple[str, Vector], ...] = (
    ("OMES scanner, full volume", OMES_SPACING_UM),
    ("OMES scanner, real-time volume", OMES_REALTIME_SPACING_UM),
)


class SpacingDialog(QDialog):
    """Asks how far apart a volume's voxels are, offers the scanner's figures, and says what would follow.

    Parameters
    ----------
    volume : Volume
    offered_um : (float, float, float)
        What the fields begin with.
    is_one_of_several : bool
        Whether others of its folder are to be annotated too: then one answer is offered for all of them.
    neutral_name : str
        What the volume is called in blind work, in which nothing is said of its file, and nothing kept for
        it alone: whoever is not asked again would know the volume again. Empty otherwise.
    is_for_now : bool
        Whether the answer holds for all volumes of this shape as long as the program runs, and is kept
        nowhere: then nobody is asked what it is remembered for.
    """

    def __init__(
        self,
        volume: Volume,
        offered_um: Vector,
        parent: QWidget | None = None,
        *,
        is_one_of_several: bool = False,
        neutral_name: str = "",
        is_for_now: bool = False,
    ) -> None:
        super().__init__(parent)
        self._shape = volume.shape
        self.setObjectName("spacing_dialog")
        self.setWindowTitle("Voxel spacing")
        self.setSizeGripEnabled(True)

        self._preset = named(QComboBox(), "spacing_preset", title="Scanner")
        for title, spacing_um in _PRESETS:
            self._preset.addItem(f"{title} ({_times(spacing_um)} µm)", spacing_um)
        self._preset.addItem("Another spacing", None)
        self._preset.activated.connect(self._on_preset_activated)

        fields = QHBoxLayout()
        self._fields: list[QLineEdit] = []
        for axis, value in zip("xyz", offered_um, strict=True):
            field = named(QLineEdit(f"{value:.12g}"), f"spacing_{axis}")
            field.setAccessibleName(f"Spacing along {axis} in µm")
            field.setToolTip(f"Distance between the centres of neighbouring voxels along {axis}, in µm")
            field.textChanged.connect(self._on_field_text_changed)
            label = QLabel(f"&{axis}")
            label.setBuddy(field)
            fields.addWidget(label)
            fields.addWidget(field, 1)
            self._fields.append(field)
        fields.addWidget(QLabel("µm"))

        self._extent = named(QLabel(), "spacing_extent", title="Extent of the volume")
        self._problem = WrappedText(name="spacing_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._problem.setAccessibleName("What is wrong with the spacing")
        self._depth = named(QComboBox(), "spacing_depth_axis", title="Depth axis")
        self._depth.setToolTip("The axis along which the light travels: slices show it downwards")
        for number, size in enumerate(volume.shape):
            self._depth.addItem(f"{'xyz'[number]} (array axis {number}, {size} voxels)", number)
        self._depth.setCurrentIndex(volume.depth_axis)
        self._scope = named(QComboBox(), "spacing_scope", title="Remember for")
        for text, scope in (
            *((("this file", "file"),) if not neutral_name else ()),
            (f"all volumes of {_times(volume.shape)} voxels in this folder", "folder"),
            ("this time only", "once"),
        ):
            self._scope.addItem(text, scope)
        offered = "folder" if is_one_of_several or neutral_name else "file"
        self._scope.setCurrentIndex(self._scope.findData("once" if is_for_now else offered))
        self._scope.setToolTip(
            "Where the folder is read-only, your own settings keep the answer"
            if neutral_name
            else f"For this file, writes {sidecar_path(volume.path).name} beside the volume; for all that do "
            f"not say it themselves, {folder_answers_path(volume.path.parent).name} into the folder. "
            "Where the folder is read-only, your own settings keep the answer for the file"
        )

        facts = QFormLayout()
        facts.addRow("Volume" if neutral_name else "File", ElidedText(neutral_name or _shown_name(volume)))
        if not neutral_name:
            facts.addRow("Folder", ElidedText(str(volume.path.parent)))
        facts.addRow("Array", ElidedText(f"{_times(volume.shape)} voxels, {volume.dtype.name}"))
        facts.addRow("&Scanner", self._preset)
        facts.addRow("Spacing", fields)
        facts.addRow("Extent", self._extent)
        facts.addRow("&Depth along", self._depth)
        if is_for_now:
            facts.addRow("Holds for", ElidedText("all volumes of this shape, until the program is closed"))
        else:
            facts.addRow("&Remember for", self._scope)

        self._buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = self._buttons.button(QDialogButtonBox.StandardButton.Ok)
        self._ok.setText("Open with this spacing")
        self._ok.setObjectName("spacing_ok")
        cancel = self._buttons.button(QDialogButtonBox.StandardButton.Cancel)
        cancel.setText("Do not open")
        cancel.setObjectName("spacing_cancel")
        self._buttons.accepted.connect(self.accept)
        self._buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("How far apart are the voxels of this volume?"))
        layout.addWidget(
            WrappedText("Its file does not say, and every distance and angle in an annotation depends on it.")
        )
        layout.addLayout(facts)
        layout.addWidget(self._problem)
        layout.addStretch(1)
        layout.addWidget(self._buttons)
        self._draw()
        self._fields[0].setFocus()
        self._fields[0].selectAll()

    @property
    def spacing_um(self) -> Vector | None:
        """The spacing in µm that the fields give, or None as long as they give none."""
        try:
            return self._read()
        except (NotUnderstood, UserError):
            return None

    @property
    def answer(self) -> SpacingAnswer | None:
        """The whole answer, or None as long as the fields give no spacing."""
        spacing_um = self.spacing_um
        if spacing_um is None:
            return None
        return SpacingAnswer(spacing_um, self._depth.currentData(), self._scope.currentData())

    def _read(self) -> Vector:
        numbers = []
        for axis, field in zip("xyz", self._fields, strict=True):
            try:
                numbers.append(parse_number(field.text()))
            except NotUnderstood as error:
                raise NotUnderstood(f"Along {axis}: {error}") from None
        return validate_spacing_um(numbers)

    @Slot(int)
    def _on_preset_activated(self, index: int) -> None:
        spacing_um = self._preset.itemData(index)
        if spacing_um is None:
            self._fields[0].setFocus()
            self._fields[0].selectAll()
            return
        for field, value in zip(self._fields, spacing_um, strict=True):
            field.setText(f"{value:.12g}")

    @Slot()
    def _on_field_text_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        problem, extent, preset = "", "—", len(_PRESETS)
        try:
            spacing_um = self._read()
        except NotUnderstood as error:
            problem = f"{error}."
        except UserError as error:
            problem = str(error)
        else:
            extent_mm = np.asarray(self._shape) * spacing_um / 1000
            extent = f"{' × '.join(f'{length:.3g}' for length in extent_mm)} mm"
            known = [values for _, values in _PRESETS]
            preset = known.index(spacing_um) if spacing_um in known else len(_PRESETS)
        self._extent.setText(extent)
        self._preset.setCurrentIndex(preset)
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._ok.setEnabled(not problem)


def _shown_name(volume: Volume) -> str:
    name = Path(volume.path).name
    return name if volume.dataset is None else f"{name}, array “{volume.dataset}”"


def _times(values: tuple[float, ...]) -> str:
    return " × ".join(f"{value:.12g}" for value in values)
