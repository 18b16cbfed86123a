"""Which forms of a report are written, and where: asked the same way whatever is reported."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Generic, TypeVar

from PySide6.QtCore import Signal, Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named

_NOTHING_CHOSEN = "Choose at least one form."
_NO_FOLDER = "Name the folder in which the report is to be."
_NOT_ABSOLUTE = "Name the whole path of the folder."
_NOT_WRITABLE = "You may not write there: choose another folder."
_IN_THE_WAY = "There is a file of that name: choose another folder."


F = TypeVar("F", bound=str)


@dataclass(frozen=True)
class Form(Generic[F]):
    """A form in which a report can be written.

    Attributes
    ----------
    key : str
        What the form is known by.
    title : str
        Of its check box.
    file_name : str
        What it is called in the report's folder.
    explanation : str
    """

    key: F
    title: str
    file_name: str
    explanation: str


@dataclass(frozen=True)
class ReportWords:
    """What is said about one kind of report.

    Attributes
    ----------
    name : str
        What the names of the dialog's controls begin with.
    title : str
        Of the dialog.
    outdated : str
        Said where what is reported has changed since its figures were computed.
    """

    name: str
    title: str
    outdated: str


class ReportExportDialog(QDialog, Generic[F]):
    """Asks for a report's forms and its folder; writes nothing itself.

    Attributes
    ----------
    words : ReportWords
        A dialog of its own for each kind of report says these.
    offered : sequence of Form
        And in which forms there is that report.

    Parameters
    ----------
    folder : Path
        Where the report is offered to be.
    computed_at : datetime or None
        When the figures were computed, where something has changed since.

    Signals
    -------
    compute_requested
        The figures are to be computed again, and nothing is to be written now.
    """

    words: ReportWords
    offered: Sequence[Form[F]]
    compute_requested = Signal()

    def __init__(
        self, folder: Path, parent: QWidget | None = None, *, computed_at: datetime | None = None
    ) -> None:
        super().__init__(parent)
        words = self.words
        self.setObjectName(f"{words.name}_dialog")
        self.setWindowTitle(words.title)
        self.setSizeGripEnabled(True)
        self._folder = named(QLineEdit(str(folder)), f"{words.name}_folder", title="Folder")
        self._folder.setMinimumWidth(self.fontMetrics().averageCharWidth() * 50)
        self._folder.textChanged.connect(self._draw)
        choose = named(QPushButton("&Choose…"), f"{words.name}_choose")
        choose.clicked.connect(self._on_choose_clicked)
        self._problem = WrappedText(name=f"{words.name}_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._replaced = WrappedText(name=f"{words.name}_replaced")
        self._replaced.set_color(lambda colors: colors.warning)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), f"{words.name}_ok")
        self._ok.setText("Export" if computed_at is None else f"Export as of {computed_at:%H:%M}")
        self._stale = WrappedText(words.outdated, name=f"{words.name}_stale")
        self._stale.set_color(lambda colors: colors.warning)
        self._stale.setVisible(computed_at is not None)
        if computed_at is not None:
            again = buttons.addButton("Compute &again", QDialogButtonBox.ButtonRole.ActionRole)
            named(again, f"{words.name}_again").clicked.connect(self._on_again_clicked)
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), f"{words.name}_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Write the report"))
        layout.addWidget(self._stale)
        self._boxes: dict[F, QCheckBox] = {}
        for form in self.offered:
            box = named(QCheckBox(form.title), f"{words.name}_{form.key}", tooltip=form.explanation)
            box.setChecked(True)
            box.toggled.connect(self._draw)
            self._boxes[form.key] = box
            row = QHBoxLayout()
            row.addWidget(box)
            row.addStretch(1)
            row.addWidget(ElidedText(form.file_name))
            layout.addLayout(row)
        into = QHBoxLayout()
        into.addWidget(self._folder, 1)
        into.addWidget(choose)
        layout.addSpacing(self.fontMetrics().height() // 2)
        layout.addLayout(into)
        layout.addWidget(self._problem)
        layout.addWidget(self._replaced)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self._draw()

    @property
    def folder(self) -> Path:
        """Where the report is to be."""
        return Path(self._folder.text().strip())

    @property
    def forms(self) -> frozenset[F]:
        """In which forms it is to be written."""
        return frozenset(form for form, box in self._boxes.items() if box.isChecked())

    @Slot()
    def _on_again_clicked(self) -> None:
        self.reject()
        self.compute_requested.emit()

    @Slot()
    def _on_choose_clicked(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Folder of the report", str(self.folder.parent))
        if chosen:
            self._folder.setText(chosen)

    @Slot()
    def _draw(self) -> None:
        problem = self._problem_now()
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        names = [form.file_name for form in self.offered if form.key in self.forms]
        there = [name for name in names if (self.folder / name).exists()]
        self._replaced.setText(f"Replaces what is there: {', '.join(there)}.")
        self._replaced.setVisible(bool(there) and not problem)
        self._ok.setEnabled(not problem)

    def _problem_now(self) -> str:
        if not self.forms:
            return _NOTHING_CHOSEN
        if not self._folder.text().strip():
            return _NO_FOLDER
        if not self.folder.is_absolute():
            return _NOT_ABSOLUTE
        there = next(each for each in (self.folder, *self.folder.parents) if each.exists())
        if not there.is_dir():
            return _IN_THE_WAY
        return "" if os.access(there, os.W_OK | os.X_OK) else _NOT_WRITABLE
