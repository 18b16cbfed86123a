"""A new study of the volumes in a folder: what it is called, who annotates, and by which rules."""

from pathlib import Path

from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import STUDY_FILE, Study
from annotations.documents.study_building import with_repeats, with_rules
from annotations.errors import UserError
from annotations.geometry.tool import ToolSpecification
from annotator.dialogs.study_fields import StudyFields, VolumesList, problem_of, roomy_size
from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named
from annotator.session.studies import StudyProposal

_MARGIN = 16


class StudyDialog(QDialog):
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
    study : Study or None
        What the fields say; None while that cannot be a study.
    folder : Path
        Where it is to be kept.
    """

    def __init__(
        self, proposal: StudyProposal, annotator: str, tool_name: str, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._proposal = proposal
        self.folder = proposal.folder
        self._based: tuple[Path, Study] | None = None
        self.study: Study | None = None
        self.setObjectName("study_dialog")
        self.setWindowTitle("New study")
        self.setSizeGripEnabled(True)
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
        self._volumes = VolumesList()
        begun = Study(title="", tool=next(iter(proposal.tools)), annotators=(), order="shuffled")
        self._fields = StudyFields(begun, is_new=True)
        self._fields.annotators.show_people((annotator,) if annotator else (), {}, fixed=False)
        self._fields.set_repeatable(len(proposal.paths))
        self._fields.changed.connect(self._on_field_changed)
        self._problem = WrappedText(name="study_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._lay_out()
        self._draw()
        self._title.setFocus()
        self._title.selectAll()

    @property
    def tool(self) -> ToolSpecification:
        """The tool that is chosen."""
        return self._proposal.tools[self._tool.currentData()]

    def _lay_out(self) -> None:
        count = len(self._proposal.paths)
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
        left.addWidget(self._volumes, 1)
        columns = QHBoxLayout()
        columns.setSpacing(_MARGIN)
        columns.addLayout(left, 1)
        columns.addWidget(self._fields, 1)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "study_ok")
        self._ok.setText("&Create and open")
        self._ok.setDefault(True)
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "study_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        volumes = f"{count} volume{'s' if count > 1 else ''}"
        layout.addWidget(Heading(f"A study of {volumes}", name="study_heading"))
        layout.addLayout(columns, 1)
        layout.addWidget(self._problem)
        layout.addWidget(buttons)
        self.resize(roomy_size(self))

    def _said(self) -> Study:
        """Return what the fields say; UserError where that cannot be."""
        if self._based is None or self._based[0] != self.folder:
            self._based = (self.folder, self._proposal.study_in(self.folder))
            self._volumes.show_volumes(self._based[1])
        title = self._title.text().strip()
        if not title:
            raise UserError("The study needs a title")
        if (self.folder / STUDY_FILE).exists():
            raise UserError("There is a study in this folder already: choose another one")
        said = with_rules(self._based[1], title=title, tool=self.tool.name, **self._fields.rules)
        return with_repeats(said, self._fields.repeats)

    def _draw(self) -> None:
        problem = ""
        try:
            self.study = self._said()
        except UserError as error:
            self.study, problem = None, problem_of(error)
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        self._ok.setEnabled(not problem)

    @Slot()
    def _on_field_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_elsewhere_clicked(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Keep the study in", str(self.folder))
        if chosen:
            self.folder = Path(chosen)
            self._place.setText(chosen)
            self._draw()
