"""The settings of a study that people work in: more volumes, more annotators, other rules."""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
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

from annotations.documents.seen_volumes import FoundVolume
from annotations.documents.study import Study
from annotations.documents.study_building import with_repeats, with_rules, with_volumes
from annotations.documents.study_changes import study_changes
from annotations.documents.study_rebase import rebased
from annotations.errors import UserError
from annotations.volumes.opening import SUFFIXES
from annotator.dialogs.study.study_fields import StudyFields
from annotator.dialogs.study.study_form import StudyForm, problem_of
from annotator.dialogs.study.study_volumes import StudyVolumes
from annotator.looks.labels import ElidedText, WrappedText
from annotator.looks.naming import named

_VOLUMES = f"Volumes ({' '.join(f'*{suffix}' for suffix in SUFFIXES)});;All files (*)"
_MARGIN = 16
_CHANGES_SHOWN = 4
_CHANGED_MEANWHILE = (
    "Somebody else has changed the study meanwhile, and nothing was written. Your changes stand here in what "
    "is there now: look at them, and change the study then."
)


class StudySettingsDialog(StudyForm):
    """Changes what ``study.toml`` says, and shows what comes of it before anything is written.

    Parameters
    ----------
    before : Study
        As it is on disk.
    folder : Path
    begun : Study, optional
        What the fields begin with, in place of that.
    found, checked : sequence of FoundVolume, sequence of Path
        The new volumes that the list begins with, and those of them that are to come in.
    said : str
        What to say first.

    Signals
    -------
    volumes_requested : list of Path
        Look for volumes there; `add_volumes` takes them.
    """

    volumes_requested = Signal(list)

    def __init__(
        self,
        before: Study,
        folder: Path,
        parent: QWidget | None = None,
        *,
        begun: Study | None = None,
        found: Sequence[FoundVolume] = (),
        checked: Sequence[Path] = (),
        said: str = "",
    ) -> None:
        super().__init__("Study settings", parent)
        self.before = before
        self._folder = folder
        begun = begun or before
        self.setObjectName("study_settings_dialog")
        self._title = named(QLineEdit(begun.title), "study_title", title="Title")
        self._title.textChanged.connect(self._on_field_changed)
        self._volumes = StudyVolumes(before)
        self._volumes.add(found, folder, checked)
        self._volumes.changed.connect(self._on_field_changed)
        self._note = WrappedText(name="study_added")
        self._note.setVisible(False)
        self._add_folder = named(
            QPushButton("Add Fol&der…"),
            "study_add_folder",
            tooltip="Add the volumes of a folder and of the folders in it",
        )
        self._add_files = named(QPushButton("Add Fil&es…"), "study_add_files", tooltip="Add single volumes")
        for button in (self._add_folder, self._add_files):
            button.setAutoDefault(False)
            self._volumes.add_button(button)
        self._add_folder.clicked.connect(self._on_add_folder_clicked)
        self._add_files.clicked.connect(self._on_add_files_clicked)
        self._fields = StudyFields(begun, before)
        self._fields.changed.connect(self._on_field_changed)
        self._changes = named(QPlainTextEdit(), "study_changes", title="What changes")
        self._changes.setReadOnly(True)
        self._changes.setTabChangesFocus(True)
        self._changes.setFixedHeight(round((_CHANGES_SHOWN + 0.8) * self.fontMetrics().lineSpacing()))
        self._fields.set_repeatable(len(self._volumes.paths))
        there = {volume.id for volume in before.volumes}
        self._fields.set_repeats(sum(each.repeats for each in begun.volumes if each.id not in there))
        self._lay_out()
        self._failure = said
        self._draw()
        self._begun = self._state() if begun == before else None
        self._fields.annotators.entry.setFocus()

    def add_volumes(self, found: Sequence[FoundVolume]) -> None:
        """Take more volumes into the study that is to be."""
        added, passed_over = self._volumes.add(found, self._folder)
        there = (
            f"; {passed_over} {'is' if passed_over == 1 else 'are'} in the list already"
            if passed_over
            else ""
        )
        self._on_field_changed()
        self.show_note(f"{added or 'Nothing'} added{there}")

    def show_note(self, text: str) -> None:
        """Say what came of looking for volumes."""
        self._note.setText(text)
        self._note.setVisible(True)

    def on_top_of(self, present: Study) -> Self:
        """Return a dialog in which the same changes are made in what somebody else has made of the study.

        StudyError where both contradict each other.
        """
        wanted = rebased(self.before, self.study or self.before, present, self._folder)
        return type(self)(
            present,
            self._folder,
            self.parentWidget(),
            begun=wanted,
            found=self._volumes.found,
            checked=self._volumes.paths,
            said=_CHANGED_MEANWHILE,
        )

    def _lay_out(self) -> None:
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.addRow("&Title", self._title)
        form.addRow("Tool", QLabel(self.before.tool))
        form.addRow("Kept in", ElidedText(str(self._folder)))
        left = QVBoxLayout()
        left.addLayout(form)
        left.addWidget(self._volumes, 1)
        left.addWidget(self._note)
        columns = QHBoxLayout()
        columns.setSpacing(_MARGIN)
        columns.addLayout(left, 1)
        columns.addWidget(self._fields, 1)
        self._ok.setText("&Change the study")
        self._heading.setText("Ids, numbers in the queues and finished work stay as they are")
        self._lay_out_form(columns, self._changes)

    def _state(self) -> object:
        return (self._title.text(), self._volumes.found, self._volumes.paths, self._fields.state)

    def _draw(self) -> None:
        self._fields.set_repeatable(len(self._volumes.paths))
        problems = [*self._fields.problems]
        if not self._title.text().strip():
            problems.append("The study needs a title.")
        self.study = None
        try:
            enlarged = with_volumes(self.before, self._folder, self._volumes.paths).study
            self._volumes.show_study(enlarged)
            if not problems:
                self.study = self._said(enlarged)
                self._volumes.show_study(self.study)
        except UserError as error:
            problems.append(problem_of(error))
        changes = study_changes(self.before, self.study) if self.study is not None else ()
        self._changes.setPlainText("\n".join(changes) or "Nothing is changed yet")
        self._show_problems(problems, is_ready=bool(changes))

    def _said(self, enlarged: Study) -> Study:
        """Return what the fields say; UserError where that cannot be."""
        said = with_rules(enlarged, title=self._title.text().strip(), **self._fields.rules)
        if said.volumes == self.before.volumes:
            return said
        return with_repeats(said, self._fields.repeats)

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
