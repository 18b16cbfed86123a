"""The annotation could not be saved: what to do so that nothing is lost."""

from pathlib import Path
from typing import Literal

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QCommandLinkButton, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from annotator.labels import ElidedText, Heading, WrappedText

UnsavedChoice = Literal["retry", "save_elsewhere", "leave", "cancel"]


class UnsavedDialog(QDialog):
    """Asks what to do when an annotation that is to be closed cannot be saved.

    Parameters
    ----------
    problem : str
        Why it could not be saved.
    path : Path or None
        The annotation's file.
    leaving : str
        What happens after all if the person insists, such as ``Quit without saving``.

    Attributes
    ----------
    choice : str
        ``retry``, ``save_elsewhere``, ``leave``; ``cancel`` until something was chosen.
    """

    def __init__(self, problem: str, path: Path | None, leaving: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.choice: UnsavedChoice = "cancel"
        self.setObjectName("unsaved_dialog")
        self.setWindowTitle("The annotation is not saved")
        layout = QVBoxLayout(self)
        layout.addWidget(Heading("The annotation could not be saved. Nothing is lost."))
        layout.addWidget(WrappedText(problem, name="unsaved_problem"))
        if path is not None:
            layout.addWidget(ElidedText(str(path)))
        choices: tuple[tuple[UnsavedChoice, str, str], ...] = (
            ("retry", "Try again", "After making room, or after giving yourself the right to write there."),
            ("save_elsewhere", "Save elsewhere…", "In another folder or on another disk."),
            ("leave", leaving, "Every edit is kept in the recovery file and offered at the next start."),
        )
        for choice, title, explanation in choices:
            button = QCommandLinkButton(title, explanation)
            button.setObjectName(f"unsaved_{choice}")
            button.setAccessibleName(title)
            button.setAccessibleDescription(explanation)
            button.setProperty("choice", choice)
            button.clicked.connect(self._on_choice_clicked)
            layout.addWidget(button)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        cancel = buttons.button(QDialogButtonBox.StandardButton.Cancel)
        cancel.setObjectName("unsaved_cancel")
        cancel.setText("Stay here")
        buttons.rejected.connect(self.reject)
        layout.addStretch(1)
        layout.addWidget(buttons)
        self.setMinimumWidth(self.fontMetrics().averageCharWidth() * 70)

    @Slot()
    def _on_choice_clicked(self) -> None:
        self.choice = self.sender().property("choice")
        self.accept()
