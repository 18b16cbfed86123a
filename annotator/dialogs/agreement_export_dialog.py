"""Which forms of the report on the annotators' agreement are written, and where."""

import os
from datetime import datetime
from pathlib import Path

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
from annotator.session.agreeing import CSV_NAME, HTML_NAME, JSON_NAME, PDF_NAME, Formats

_FORMS = (
    ("html", "&HTML, to read", HTML_NAME, "One file with tables, plots and definitions, for any browser"),
    ("pdf", "&PDF, to print", PDF_NAME, "The same on pages"),
    ("csv", "&CSV, to calculate with", CSV_NAME, "A folder of tidy tables, with units in their headings"),
    ("json", "&JSON, for programs", JSON_NAME, "Every number, unrounded"),
)
_NOTHING_CHOSEN = "Choose at least one form."
_NO_FOLDER = "Name the folder in which the report is to be."
_NOT_ABSOLUTE = "Name the whole path of the folder."
_STALE = "Annotations have changed since these figures were computed."
_NOT_WRITABLE = "You may not write there: choose another folder."
_IN_THE_WAY = "There is a file of that name: choose another folder."


class AgreementExportDialog(QDialog):
    """Asks for the report's forms and its folder; writes nothing itself.

    Parameters
    ----------
    folder : Path
        Where the report is offered to be.
    computed_at : datetime or None
        When the figures were computed, where annotations have changed since.

    Signals
    -------
    compute_requested
        The figures are to be computed again, and nothing is to be written now.
    """

    compute_requested = Signal()

    def __init__(
        self, folder: Path, parent: QWidget | None = None, *, computed_at: datetime | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("agreement_export_dialog")
        self.setWindowTitle("Export the agreement")
        self.setSizeGripEnabled(True)
        self._folder = named(QLineEdit(str(folder)), "agreement_export_folder", title="Folder")
        self._folder.setMinimumWidth(self.fontMetrics().averageCharWidth() * 50)
        self._folder.textChanged.connect(self._draw)
        choose = named(QPushButton("&Choose…"), "agreement_export_choose")
        choose.clicked.connect(self._on_choose_clicked)
        self._problem = WrappedText(name="agreement_export_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._replaced = WrappedText(name="agreement_export_replaced")
        self._replaced.set_color(lambda colors: colors.warning)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "agreement_export_ok")
        self._ok.setText("Export" if computed_at is None else f"Export as of {computed_at:%H:%M}")
        self._stale = WrappedText(_STALE, name="agreement_export_stale")
        self._stale.set_color(lambda colors: colors.warning)
        self._stale.setVisible(computed_at is not None)
        if computed_at is not None:
            again = buttons.addButton("Compute &again", QDialogButtonBox.ButtonRole.ActionRole)
            named(again, "agreement_export_again").clicked.connect(self._on_again_clicked)
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "agreement_export_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Write the report"))
        layout.addWidget(self._stale)
        self._boxes: dict[str, QCheckBox] = {}
        for form, title, name, explanation in _FORMS:
            box = named(QCheckBox(title), f"agreement_export_{form}", tooltip=explanation)
            box.setChecked(True)
            box.toggled.connect(self._draw)
            self._boxes[form] = box
            row = QHBoxLayout()
            row.addWidget(box)
            row.addStretch(1)
            row.addWidget(ElidedText(name))
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
    def formats(self) -> Formats:
        """What is to be written."""
        return Formats(**{form: box.isChecked() for form, box in self._boxes.items()})

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
        there = [
            name for form, _, name, _ in _FORMS if self._boxes[form].isChecked() and self._is_there(name)
        ]
        self._replaced.setText(f"Replaces what is there: {', '.join(there)}.")
        self._replaced.setVisible(bool(there) and not problem)
        self._ok.setEnabled(not problem)

    def _is_there(self, name: str) -> bool:
        return (self.folder / name).exists()

    def _problem_now(self) -> str:
        if not self.formats.any:
            return _NOTHING_CHOSEN
        if not self._folder.text().strip():
            return _NO_FOLDER
        if not self.folder.is_absolute():
            return _NOT_ABSOLUTE
        there = next(each for each in (self.folder, *self.folder.parents) if each.exists())
        if not there.is_dir():
            return _IN_THE_WAY
        return "" if os.access(there, os.W_OK | os.X_OK) else _NOT_WRITABLE
