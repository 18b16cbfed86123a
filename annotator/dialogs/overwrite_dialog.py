"""Another program changed the annotation's file: whose version stays?"""

from pathlib import Path
from typing import Literal

from PySide6.QtCore import Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from annotator.labels import ElidedText, Heading, WrappedText

OverwriteChoice = Literal["overwrite", "reload", "save_elsewhere", "cancel"]

_CHOICES: tuple[tuple[OverwriteChoice, str, str], ...] = (
    (
        "save_elsewhere",
        "Save mine under another name…",
        "Both versions are kept, each in its own file.",
    ),
    (
        "overwrite",
        "Keep mine",
        "Your version takes the file's name; the other program's version becomes its backup.",
    ),
    (
        "reload",
        "Take theirs",
        "The file is read again, and your unsaved edits are given up.",
    ),
)


class OverwriteDialog(QDialog):
    """Asks before a file that was changed by another program is overwritten.

    Attributes
    ----------
    choice : str
        ``overwrite``, ``reload``, ``save_elsewhere``; ``cancel`` until something was chosen.
    """

    def __init__(self, problem: str, path: Path | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.choice: OverwriteChoice = "cancel"
        self.setObjectName("overwrite_dialog")
        self.setWindowTitle("The file was changed by another program")

        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Which version should stay?"))
        layout.addWidget(WrappedText(problem, name="overwrite_problem"))
        if path is not None:
            layout.addWidget(ElidedText(str(path)))
        for choice, title, explanation in _CHOICES:
            button = QPushButton(title)
            button.setObjectName(f"overwrite_{choice}")
            button.setAutoDefault(False)
            button.setAccessibleDescription(explanation)
            button.setProperty("choice", choice)
            button.clicked.connect(self._on_choice_clicked)
            layout.addSpacing(self.fontMetrics().height() // 2)
            layout.addWidget(button)
            layout.addWidget(WrappedText(explanation))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        cancel = buttons.button(QDialogButtonBox.StandardButton.Cancel)
        cancel.setObjectName("overwrite_cancel")
        cancel.setToolTip("Save nothing now; your edits stay open, and in the recovery file")
        buttons.rejected.connect(self.reject)
        layout.addStretch(1)
        layout.addWidget(buttons)

    @Slot()
    def _on_choice_clicked(self) -> None:
        self.choice = self.sender().property("choice")
        self.accept()
