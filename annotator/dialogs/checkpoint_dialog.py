"""What a checkpoint is, and what can be done with it."""

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
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

_HOW = "On the command line it does the same, and tells how far it is off:"
_FITS = "The tool and the volume that are open"
_FITS_NOTHING_OPEN = "The tool of the next annotation; no volume is open"
_COLUMNS, _ROWS = 70, 5


@dataclass(frozen=True)
class CheckpointFit:
    """How a checkpoint goes with what is open.

    Attributes
    ----------
    unfitness : str
        Why it does not fit, as a sentence without its full stop; empty where it does.
    differences : str
        In what its tool is another than the one that is open though it fits, likewise.
    is_usable : bool
        Whether it fits the tool, and so may be used at all.
    is_in_use : bool
    is_volume_open : bool
    """

    unfitness: str = ""
    differences: str = ""
    is_usable: bool = True
    is_in_use: bool = False
    is_volume_open: bool = False


class CheckpointDialog(QDialog):
    """Says what a checkpoint is, whether it fits what is open, and which commands use it; it can be taken.

    It is accepted by whoever wants to use it.

    Parameters
    ----------
    fit : CheckpointFit
    study_folder : Path, optional
        Of the open study, which one of the commands is about.
    has_commands : bool
        Whether the commands are told: they know no rules of blind work, and tell anybody everything.
    is_new : bool
        Whether it has just been made.
    """

    def __init__(
        self,
        checkpoint: Checkpoint,
        parent: QWidget | None = None,
        *,
        fit: CheckpointFit = CheckpointFit(),
        study_folder: Path | None = None,
        has_commands: bool = True,
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
        fits = WrappedText(_fit_words(fit), name="checkpoint_fit")
        if fit.unfitness or fit.differences:
            fits.set_color(lambda colors: colors.warning)
        facts.addRow("Fits", fits)
        commands = "\n".join(_commands(checkpoint.path, study_folder))
        self._commands = named(QPlainTextEdit(commands), "checkpoint_commands", title="Commands that use it")
        self._commands.setReadOnly(True)
        metrics = self.fontMetrics()
        self.setMinimumWidth(metrics.averageCharWidth() * _COLUMNS)
        self._commands.setFixedHeight(metrics.lineSpacing() * _ROWS)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        use = buttons.addButton(
            "In use" if fit.is_in_use else "&Use it", QDialogButtonBox.ButtonRole.AcceptRole
        )
        named(use, "checkpoint_use", tooltip="Let it predict, and show what it says over the volumes")
        use.setEnabled(fit.is_usable and not fit.is_in_use)
        if has_commands:
            copy = buttons.addButton("&Copy the commands", QDialogButtonBox.ButtonRole.ActionRole)
            named(copy, "checkpoint_copy").clicked.connect(self._on_copy_clicked)
        named(buttons.button(QDialogButtonBox.StandardButton.Close), "checkpoint_close")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        name = f"“{checkpoint.description.name}”"
        kind = f"The checkpoint {name} is made" if is_new else f"{name} is a checkpoint, a trained network"
        layout.addWidget(Heading(kind, name="checkpoint_heading"))
        layout.addLayout(facts)
        if has_commands:
            layout.addWidget(WrappedText(_HOW))
            layout.addWidget(self._commands)
        layout.addStretch(1)
        layout.addWidget(buttons)
        if use.isEnabled():
            # Once it is in the dialog: before, it would be nobody's default.
            use.setDefault(True)
            use.setFocus()

    def _on_copy_clicked(self) -> None:
        QApplication.clipboard().setText(self._commands.toPlainText())


def _fit_words(fit: CheckpointFit) -> str:
    if not fit.unfitness:
        fits = _FITS if fit.is_volume_open else _FITS_NOTHING_OPEN
        return f"{fits}. {_sentence(fit.differences)}" if fit.differences else fits
    reason = _sentence(fit.unfitness)
    return reason if not fit.is_usable else f"{reason} Others of the list may be."


def _sentence(words: str) -> str:
    return f"{words[0].upper()}{words[1:]}."


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
