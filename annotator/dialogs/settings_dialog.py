"""A person's choices: name, looks, renderer, saving."""

from pathlib import Path

from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QFormLayout,
    QLineEdit,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import StudyError, annotation_path
from annotator.looks import theme
from annotator.looks.labels import ElidedText, WrappedText
from annotator.looks.naming import named
from annotator.settings import Settings

_THEMES = (("As the system", "system"), ("Light", "light"), ("Dark", "dark"))
_RENDERERS = (
    ("Choose by the machine", "auto"),
    ("On the processor (no GPU needed)", "software"),
    ("On the graphics card", "gpu"),
)


class SettingsDialog(QDialog):
    """Edits `Settings`: the theme shows at once and is taken back on cancel, everything is kept on OK."""

    def __init__(self, settings: Settings, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self.setObjectName("settings_dialog")
        self.setWindowTitle("Settings")
        self.setSizeGripEnabled(True)

        self._name = named(QLineEdit(settings.annotator_name), "settings_annotator_name")
        self._name.setToolTip("Your name in the annotations that you begin; existing ones keep theirs")
        self._name.textChanged.connect(self._on_name_text_changed)
        self._problem = WrappedText(name="settings_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._theme = _choice("settings_theme", _THEMES, settings.theme)
        self._theme.setToolTip("Colours of the window; images stay on black")
        self._theme.currentIndexChanged.connect(self._on_theme_current_index_changed)
        self._renderer = _choice("settings_renderer", _RENDERERS, settings.renderer)
        self._renderer.setToolTip("What draws the volume in 3D; used from the next start")
        self._autosave = named(QDoubleSpinBox(), "settings_autosave_seconds")
        self._autosave.setRange(0, 3600)
        self._autosave.setSpecialValueText("Only when I save")
        self._autosave.setDecimals(1)
        self._autosave.setSuffix(" s after an edit")
        self._autosave.setToolTip(
            "How long after the last edit the annotation's file is written; "
            "until then each edit is already in the recovery file. At 0 it is written only when you save"
        )
        self._autosave.setValue(settings.autosave_seconds)
        self._cache = named(QSpinBox(), "settings_cache_limit_mib")
        self._cache.setRange(0, 1024 * 1024)
        self._cache.setSingleStep(256)
        self._cache.setSuffix(" MiB")
        self._cache.setSpecialValueText("Keep nothing")
        self._cache.setToolTip(
            "Room on the disk for levels of detail that were built once; used from the next start"
        )
        self._cache.setValue(settings.cache_limit_mib)

        form = QFormLayout()
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        for title, field in (
            ("&Annotator", self._name),
            ("&Theme", self._theme),
            ("3D &renderer", self._renderer),
            ("&Save", self._autosave),
            ("&Cache", self._cache),
        ):
            form.addRow(title, field)
            field.setAccessibleName(title.replace("&", ""))
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = buttons.button(QDialogButtonBox.StandardButton.Ok)
        self._ok.setObjectName("settings_ok")
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setObjectName("settings_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addLayout(form)
        layout.addWidget(self._problem)
        layout.addWidget(WrappedText("Renderer and cache change at the next start."))
        layout.addWidget(ElidedText(f"Kept in {settings.path}", name="settings_path"))
        layout.addStretch(1)
        layout.addWidget(buttons)
        self._draw()

    def accept(self) -> None:
        self._settings.annotator_name = self._name.text()
        self._settings.theme = self._theme.currentData()
        self._settings.renderer = self._renderer.currentData()
        self._settings.autosave_seconds = self._autosave.value()
        self._settings.cache_limit_mib = self._cache.value()
        super().accept()

    def reject(self) -> None:
        theme.apply_theme(self._settings.theme)
        super().reject()

    @Slot()
    def _on_theme_current_index_changed(self) -> None:
        theme.apply_theme(self._theme.currentData())

    @Slot()
    def _on_name_text_changed(self) -> None:
        self._draw()

    def _draw(self) -> None:
        problem = _name_problem(self._name.text().strip())
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._ok.setEnabled(not problem)


def _name_problem(name: str) -> str:
    """Say why nobody can annotate under a name; empty if somebody can."""
    if not name:
        return "An annotation needs the name of its annotator: type yours."
    try:
        annotation_path(Path(), name, "volume", "keypoints")
    except StudyError as error:
        return str(error)
    return ""


def _choice(name: str, entries: tuple[tuple[str, str], ...], chosen: str) -> QComboBox:
    box = named(QComboBox(), name)
    for text, value in entries:
        box.addItem(text, value)
    box.setCurrentIndex(max(box.findData(chosen), 0))
    return box
