"""A new study of the volumes in a folder: what it is called, who annotates, and by which rules."""

from pathlib import Path

from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import Study
from annotations.documents.study_building import why_not_in, with_repeats, with_rules
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotator.dialogs.study.study_fields import StudyFields
from annotator.dialogs.study.study_form import StudyForm, problem_of
from annotator.dialogs.study.study_volumes import StudyVolumes
from annotator.looks.labels import ElidedText, WrappedText
from annotator.looks.naming import named
from annotator.session.studies import StudyProposal

_MARGIN = 16


class StudyDialog(StudyForm):
    """Asks what a new study is to say, and says at once what cannot be.

    Parameters
    ----------
    proposal : StudyProposal
    annotator : str
        Who is listed first; taken out like anybody else.
    tool_name : str
        Chosen first, if it is there.

    Attributes
    ----------
    folder : Path
        Where it is to be kept.
    """

    def __init__(
        self, proposal: StudyProposal, annotator: str, tool_name: str, parent: QWidget | None = None
    ) -> None:
        super().__init__("New study", parent)
        self._proposal = proposal
        self.folder = proposal.folder
        self._place_problem = why_not_in(self.folder)
        self.setObjectName("study_dialog")
        self._title = named(QLineEdit(proposal.folder.name), "study_title", title="Title")
        self._title.textChanged.connect(self._on_field_changed)
        self._tool = named(QComboBox(), "study_tool", title="Tool")
        for name, tool in proposal.tools.items():
            self._tool.addItem(tool.title, name)
        self._tool.setCurrentIndex(max(self._tool.findData(tool_name), 0))
        self._tool.setToolTip("The instrument; one that does not ship is copied into the study")
        self._tool.currentIndexChanged.connect(self._on_field_changed)
        self._place = ElidedText(str(self.folder), name="study_folder")
        self._elsewhere = named(
            QPushButton("&Folder…"),
            "study_choose_folder",
            tooltip="Keep the study in another folder than its volumes",
        )
        self._elsewhere.setAutoDefault(False)
        self._elsewhere.clicked.connect(self._on_elsewhere_clicked)
        self._volumes = StudyVolumes()
        self._volumes.add(proposal.found, self.folder)
        self._volumes.changed.connect(self._on_field_changed)
        begun = Study(title="", tool=next(iter(proposal.tools)), annotators=(), order="shuffled")
        self._fields = StudyFields(begun)
        self._fields.annotators.show_people((annotator,) if annotator else (), {})
        self._fields.changed.connect(self._on_field_changed)
        self._lay_out()
        self._draw()
        self._begun = self._state()
        self._title.setFocus()
        self._title.selectAll()

    @property
    def tool(self) -> ToolSpecification:
        """The tool that is chosen."""
        return self._proposal.tools[self._tool.currentData()]

    def _lay_out(self) -> None:
        place = QHBoxLayout()
        place.addWidget(self._place, 1)
        place.addWidget(self._elsewhere)
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.addRow("&Title", self._title)
        form.addRow("Tool (&instrument)", self._tool)
        form.addRow("Kept in", place)
        left = QVBoxLayout()
        left.addLayout(form)
        if self._proposal.belongs_to:
            said = f"These volumes belong to {self._proposal.belongs_to} already: this is to be another one."
            left.addWidget(WrappedText(said, name="study_belongs_to"))
        left.addWidget(self._volumes, 1)
        columns = QHBoxLayout()
        columns.setSpacing(_MARGIN)
        columns.addLayout(left, 1)
        columns.addWidget(self._fields, 1)
        self._ok.setText("&Create and open")
        self._lay_out_form(columns)

    def _state(self) -> object:
        chosen = (self._title.text(), self._tool.currentData(), self.folder, self._volumes.paths)
        return (chosen, self._volumes.found, self._fields.state)

    def _draw(self) -> None:
        paths = self._volumes.paths
        self._heading.setText(f"A study of {len(paths)} volume{'' if len(paths) == 1 else 's'}")
        self._fields.set_repeatable(len(paths))
        problems = [*self._fields.problems]
        if not self._title.text().strip():
            problems.append("The study needs a title.")
        if not paths:
            problems.append("The study needs a volume: check one.")
        if self._place_problem:
            problems.append(f"{self._place_problem}.")
        self.study = None
        try:
            based = self._proposal.study_in(self.folder, paths)
            self._volumes.show_study(based)
            if not problems:
                self.study = self._said(based)
                self._volumes.show_study(self.study)
        except UserError as error:
            problems.append(problem_of(error))
        self._show_problems(problems, is_ready=self.study is not None)

    def _said(self, based: Study) -> Study:
        """Return what the fields say; UserError where that cannot be."""
        title = self._title.text().strip()
        said = with_rules(based, title=title, tool=self.tool.name, **self._fields.rules)
        return with_repeats(said, self._fields.repeats)

    @Slot()
    def _on_elsewhere_clicked(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Keep the study in", str(self.folder))
        if chosen:
            self.folder = Path(chosen)
            self._place_problem = why_not_in(self.folder)
            self._place.setText(chosen)
            self._on_field_changed()
