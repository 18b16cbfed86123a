"""What goes into a training file, and where it is written."""

from pathlib import Path

from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.record import Method
from annotations.documents.study import Study
from annotations.interchange.split import SPLITS, SplitRule
from annotations.interchange.training_file import ExportOptions
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named

_ENDINGS = (".h5", ".hdf5", ".csv")
_FILTER = "Training files (*.h5 *.hdf5 *.csv)"
_SETTLED = "The consensus, else the only annotator"
_PERCENT = (80, 20, 0)
_MOST_SEEDS = 2**31 - 1
_NO_FILE = "Name the file that is to be written."
_NOT_ABSOLUTE = "Name the whole path of the file."
_NO_FORMAT = "End the name in .h5 for HDF5, or in .csv."
_NO_FOLDER = "There is no such folder."
_IS_FOLDER = "There is a folder of that name."
_NOT_A_WHOLE = "The shares add up to {} %, not to 100 %."


class TrainingExportDialog(QDialog):
    """Asks for the file, who speaks for the volumes, and how they are split; writes nothing itself.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the file is offered to be.
    method : str
        The method that is offered.
    """

    def __init__(self, study: Study, folder: Path, method: Method, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("training_export_dialog")
        self.setWindowTitle("Export for training")
        self.setSizeGripEnabled(True)
        self._path = named(QLineEdit(str(folder / "targets.h5")), "training_export_path", title="File")
        self._path.setMinimumWidth(self.fontMetrics().averageCharWidth() * 50)
        self._path.textChanged.connect(self._on_path_text_changed)
        choose = named(QPushButton("&Choose…"), "training_export_choose")
        choose.clicked.connect(self._on_choose_clicked)
        self._method = named(QComboBox(), "training_export_method", title="Method")
        for each in study.methods:
            self._method.addItem(f"By {each}", each)
        self._method.setCurrentIndex(max(self._method.findData(method), 0))
        self._whose = named(QComboBox(), "training_export_whose", title="Whose annotations")
        self._whose.addItem(_SETTLED, None)
        for annotator in study.annotators:
            self._whose.addItem(annotator, annotator)
        self._every = named(
            QCheckBox("&Every annotation, repeats among them"),
            "training_export_every",
            tooltip="A row for each annotation, instead of one for each volume",
        )
        self._every.toggled.connect(self._draw)
        self._unfinished = named(QCheckBox("Also what is &not done"), "training_export_unfinished")
        self._shares = [self._make_share(split, _PERCENT[number]) for number, split in enumerate(SPLITS)]
        self._seed = named(QSpinBox(), "training_export_seed", title="Seed of the split")
        self._seed.setRange(0, _MOST_SEEDS)
        self._seed.setToolTip("The same seed splits the same volumes alike")
        self._problem = WrappedText(name="training_export_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._replaced = named(QCheckBox(), "training_export_replaced")
        self._replaced.toggled.connect(self._draw)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "training_export_ok")
        self._ok.setText("Export")
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "training_export_cancel")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        self._lay_out(choose, buttons)
        self._draw()

    @property
    def path(self) -> Path:
        """The file to be written."""
        return Path(self._path.text().strip())

    @property
    def options(self) -> ExportOptions:
        """What is to be in it; a training file that is there already is replaced."""
        train, validation, test = (share.value() / 100 for share in self._shares)
        return ExportOptions(
            method=self._method.currentData(),
            annotator=self._whose.currentData(),
            every_annotation=self._every.isChecked(),
            include_unfinished=self._unfinished.isChecked(),
            rule=SplitRule((train, validation, test), self._seed.value()),
            overwrite=self._replaced.isChecked(),
        )

    def _lay_out(self, choose: QPushButton, buttons: QDialogButtonBox) -> None:
        where = QHBoxLayout()
        where.addWidget(self._path, 1)
        where.addWidget(choose)
        shares = QHBoxLayout()
        for split, share in zip(SPLITS, self._shares, strict=True):
            label = QLabel(split)
            label.setBuddy(share)
            shares.addWidget(label)
            shares.addWidget(share)
        shares.addStretch(1)
        file = QLabel("&File")
        file.setBuddy(self._path)
        form = QFormLayout()
        form.addRow(file, where)
        form.addRow("&Method", self._method)
        form.addRow("&Whose", self._whose)
        form.addRow("", self._every)
        form.addRow("", self._unfinished)
        form.addRow("Split of the volumes", shares)
        form.addRow("&Seed", self._seed)
        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Write the targets of the study's volumes"))
        layout.addLayout(form)
        layout.addWidget(self._problem)
        layout.addWidget(self._replaced)
        layout.addStretch(1)
        layout.addWidget(buttons)

    def _make_share(self, split: str, percent: int) -> QSpinBox:
        share = named(QSpinBox(), f"training_export_{split}", title=f"Share of {split}")
        share.setRange(0, 100)
        share.setSuffix(" %")
        share.setValue(percent)
        share.valueChanged.connect(self._draw)
        return share

    @Slot()
    def _on_choose_clicked(self) -> None:
        chosen, _ = QFileDialog.getSaveFileName(
            self,
            "Training file",
            str(self.path),
            _FILTER,
            # The dialog itself says what is replaced.
            options=QFileDialog.Option.DontConfirmOverwrite,
        )
        if chosen:
            self._path.setText(chosen)

    @Slot()
    def _on_path_text_changed(self) -> None:
        # Of each file it is to be said anew.
        self._replaced.setChecked(False)
        self._draw()

    @Slot()
    def _draw(self) -> None:
        problem = self._problem_now()
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))
        is_there = not problem and self.path.exists()
        name = self.path.name.replace("&", "&&")
        self._replaced.setText(f"&Replace {name}, if that is a training file")
        self._replaced.setVisible(is_there)
        self._ok.setEnabled(not problem and (self._replaced.isChecked() or not is_there))

    def _problem_now(self) -> str:
        percent = sum(share.value() for share in self._shares)
        if not self._path.text().strip():
            return _NO_FILE
        if not self.path.is_absolute():
            return _NOT_ABSOLUTE
        if self.path.suffix.lower() not in _ENDINGS:
            return _NO_FORMAT
        if self.path.is_dir():
            return _IS_FOLDER
        if not self.path.parent.is_dir():
            return _NO_FOLDER
        return _NOT_A_WHOLE.format(percent) if percent != 100 else ""
