"""The settings of a study that people work in: more volumes, more annotators, other rules."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import Study
from annotations.documents.study_building import with_repeats, with_rules, with_volumes
from annotations.documents.study_changes import study_changes
from annotations.errors import UserError
from annotations.volumes.opening import SUFFIXES
from annotator.dialogs.study_fields import StudyFields, VolumesList, problem_of, roomy_size
from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named

_VOLUMES = f"Volumes ({' '.join(f'*{suffix}' for suffix in SUFFIXES)});;All files (*)"
_MARGIN = 16
_CHANGES_SHOWN = 4


class StudySettingsDialog(QDialog):
    """Changes what ``study.toml`` says, and shows what comes of it before anything is written.

    Signals
    -------
    volumes_requested : list of Path
        Look for volumes there; `add_volumes` takes them.

    Attributes
    ----------
    study : Study or None
        As it is to be; None while that cannot be a study.
    """

    volumes_requested = Signal(list)

    def __init__(self, study: Study, folder: Path, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._before = study
        self._folder = folder
        self._enlarged = study
        self.study: Study | None = study
        self.setObjectName("study_settings_dialog")
        self.setWindowTitle("Study settings")
        self.setSizeGripEnabled(True)
        self._title = named(QLineEdit(study.title), "study_title", title="Title")
        self._title.textChanged.connect(self._on_field_changed)
        self._volumes = VolumesList()
        self._note = WrappedText(name="study_added")
        self._note.setVisible(False)
        self._add_folder = named(
            QPushButton("Add Fol&der…"),
            "study_add_folder",
            tooltip="Add the volumes of a folder and of the folders in it",
        )
        self._add_files = named(QPushButton("Add &Files…"), "study_add_files", tooltip="Add single volumes")
        for button in (self._add_folder, self._add_files):
            button.setAutoDefault(False)
        self._add_folder.clicked.connect(self._on_add_folder_clicked)
        self._add_files.clicked.connect(self._on_add_files_clicked)
        self._fields = StudyFields(study, is_new=False)
        self._fields.changed.connect(self._on_field_changed)
        self._changes = named(QPlainTextEdit(), "study_changes", title="What changes")
        self._changes.setReadOnly(True)
        self._changes.setTabChangesFocus(True)
        self._changes.setFixedHeight(round((_CHANGES_SHOWN + 0.8) * self.fontMetrics().lineSpacing()))
        self._problem = WrappedText(name="study_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._lay_out()
        self._volumes.show_volumes(study, study)
        self._draw()
        self._fields.annotators.entry.setFocus()

    def add_volumes(self, paths: Sequence[Path]) -> None:
        """Take more volumes into the study that is to be."""
        try:
            enlarged = with_volumes(self._enlarged, self._folder, paths)
        except UserError as error:
            self.show_note(str(error))
        else:
            self._enlarged = enlarged.study
            there = f"; {enlarged.already_there} are in the study already" if enlarged.already_there else ""
            self.show_note(f"{len(enlarged.added)} added{there}")
            self._volumes.show_volumes(self._enlarged, self._before)
        self._fields.set_repeatable(len(self._enlarged.volumes) - len(self._before.volumes))
        self._draw()

    def show_note(self, text: str) -> None:
        """Say what came of looking for volumes."""
        self._note.setText(text)
        self._note.setVisible(True)

    def _lay_out(self) -> None:
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.addRow("&Title", self._title)
        form.addRow("Tool", QLabel(self._before.tool))
        form.addRow("Kept in", ElidedText(str(self._folder)))
        adding = QHBoxLayout()
        adding.addWidget(self._add_folder)
        adding.addWidget(self._add_files)
        adding.addStretch(1)
        left = QVBoxLayout()
        left.addLayout(form)
        left.addWidget(self._volumes, 1)
        left.addLayout(adding)
        left.addWidget(self._note)
        columns = QHBoxLayout()
        columns.setSpacing(_MARGIN)
        columns.addLayout(left, 1)
        columns.addWidget(self._fields, 1)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Save | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Save), "study_ok")
        self._ok.setText("&Change the study")
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "study_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        heading = "Ids, numbers in the queues and finished work stay as they are"
        layout.addWidget(Heading(heading, name="study_heading"))
        layout.addLayout(columns, 1)
        layout.addWidget(self._changes)
        layout.addWidget(self._problem)
        layout.addWidget(buttons)
        self.resize(roomy_size(self))

    def _said(self) -> Study:
        """Return what the fields say; UserError where that cannot be."""
        title = self._title.text().strip()
        if not title:
            raise UserError("The study needs a title")
        said = with_rules(self._enlarged, title=title, **self._fields.rules)
        if said.volumes == self._before.volumes:
            return said
        return with_repeats(said, self._fields.repeats)

    def _draw(self) -> None:
        problem = ""
        try:
            self.study = self._said()
        except UserError as error:
            self.study, problem = None, problem_of(error)
        changes = study_changes(self._before, self.study) if self.study is not None else ()
        self._changes.setPlainText("\n".join(changes) or "Nothing is changed yet")
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._ok.setEnabled(bool(changes))

    @Slot()
    def _on_field_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_add_folder_clicked(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Add the volumes of", str(self._folder))
        if chosen:
            self.volumes_requested.emit([Path(chosen)])

    @Slot()
    def _on_add_files_clicked(self) -> None:
        chosen, _ = QFileDialog.getOpenFileNames(self, "Add volumes", str(self._folder), _VOLUMES)
        if chosen:
            self.volumes_requested.emit([Path(each) for each in chosen])
