"""What a checkpoint is, and what can be done with it."""

import shlex
from collections.abc import Iterator
from pathlib import Path

from PySide6.QtWidgets import (
    QApplication,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QPlainTextEdit,
    QVBoxLayout,
    QWidget,
)

from annotations.prediction.checkpoint import Checkpoint
from annotations.prediction.training_words import errors_in_words, training_in_words
from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named

_HOW = (
    "On the command line it finds the keypoints in volumes and the pose of the tool, and tells how far it is "
    "off. This window does not use it."
)
_COLUMNS, _ROWS = 70, 7


class CheckpointDialog(QDialog):
    """Says what a checkpoint is: its name, tool, training and errors; and the commands that use it.

    Parameters
    ----------
    study_folder : Path, optional
        Of the open study, which one of the commands is about.
    is_new : bool
        Whether it has just been made.
    """

    def __init__(
        self,
        checkpoint: Checkpoint,
        parent: QWidget | None = None,
        *,
        study_folder: Path | None = None,
        is_new: bool = False,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("checkpoint_dialog")
        self.setWindowTitle("Checkpoint")
        self.setSizeGripEnabled(True)
        facts = QFormLayout()
        facts.addRow("File", ElidedText(str(checkpoint.path), name="checkpoint_path"))
        for name, title, text in _facts(checkpoint):
            facts.addRow(title, WrappedText(text, name=f"checkpoint_{name}"))
        commands = "\n".join(_commands(checkpoint.path, study_folder))
        self._commands = named(QPlainTextEdit(commands), "checkpoint_commands", title="Commands that use it")
        self._commands.setReadOnly(True)
        metrics = self.fontMetrics()
        self._commands.setMinimumWidth(metrics.averageCharWidth() * _COLUMNS)
        self._commands.setFixedHeight(metrics.lineSpacing() * _ROWS)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        copy = buttons.addButton("&Copy the commands", QDialogButtonBox.ButtonRole.ActionRole)
        named(copy, "checkpoint_copy").clicked.connect(self._on_copy_clicked)
        named(buttons.button(QDialogButtonBox.StandardButton.Close), "checkpoint_close")
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        kind = "The checkpoint is made" if is_new else "This is a checkpoint, a trained network"
        layout.addWidget(Heading(kind, name="checkpoint_heading"))
        layout.addLayout(facts)
        layout.addWidget(WrappedText(_HOW))
        layout.addWidget(self._commands)
        layout.addStretch(1)
        layout.addWidget(buttons)

    def _on_copy_clicked(self) -> None:
        QApplication.clipboard().setText(self._commands.toPlainText())


def _facts(checkpoint: Checkpoint) -> Iterator[tuple[str, str, str]]:
    """Yield the name, the title and the text of each row."""
    description = checkpoint.description
    tool = description.tool
    yield "name", "Name", description.name
    yield "tool", "Tool", f"{tool.name} ({tool.title})" if tool.title else tool.name
    yield "keypoints", "Keypoints", ", ".join(description.keypoints)
    yield "network", "Network", f"{description.network}, {description.parameters:,} parameters"
    yield "training", "Trained on", training_in_words(description.training)
    yield "errors", "Errors", errors_in_words(description.training).replace("; ", "\n")


def _commands(path: Path, study_folder: Path | None) -> Iterator[str]:
    checkpoint = shlex.quote(str(path))
    study = "STUDY" if study_folder is None else shlex.quote(str(study_folder))
    yield f"annotations predict {checkpoint} VOLUME -o FOLDER"
    yield f"annotations predict {checkpoint} --study {study}"
    yield f"annotations evaluate {checkpoint} {study}"
