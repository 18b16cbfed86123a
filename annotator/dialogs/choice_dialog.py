"""A problem with several ways out, each with what follows from it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Slot
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QPushButton, QVBoxLayout, QWidget

from annotator.looks.labels import ElidedText, Heading, WrappedText
from annotator.looks.naming import named


@dataclass(frozen=True)
class Choice:
    """A way out.

    Attributes
    ----------
    value : str
        What the dialog's ``choice`` becomes, and part of the button's ``objectName``.
    title : str
        On the button.
    explanation : str
        What follows from it, as a sentence.
    """

    value: str
    title: str
    explanation: str


class ChoiceDialog(QDialog):
    """Says what is the matter with a file and offers ways out; none of them is chosen by Enter alone.

    Attributes
    ----------
    choice : str
        The value of what was chosen; ``cancel`` until then, and for Esc.
    """

    def __init__(
        self,
        name: str,
        heading: str,
        problem: str,
        path: Path | None,
        choices: Sequence[Choice],
        cancel: Choice,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.choice = "cancel"
        self.setObjectName(f"{name}_dialog")
        layout = QVBoxLayout(self)
        layout.addWidget(Heading(heading))
        layout.addWidget(WrappedText(problem, name=f"{name}_problem"))
        # A problem mostly begins with the path that it is about.
        if path is not None and str(path) not in problem:
            layout.addWidget(ElidedText(str(path)))
        for choice in choices:
            button = named(QPushButton(choice.title), f"{name}_{choice.value}", tooltip=choice.explanation)
            button.setAccessibleDescription(choice.explanation)
            button.setAutoDefault(False)
            button.setProperty("choice", choice.value)
            button.clicked.connect(self._on_choice_clicked)
            layout.addSpacing(self.fontMetrics().height() // 2)
            layout.addWidget(button)
            layout.addWidget(WrappedText(choice.explanation))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        back = buttons.button(QDialogButtonBox.StandardButton.Cancel)
        named(back, f"{name}_cancel", tooltip=cancel.explanation)
        back.setText(cancel.title)
        buttons.rejected.connect(self.reject)
        layout.addStretch(1)
        layout.addWidget(buttons)

    @Slot()
    def _on_choice_clicked(self) -> None:
        self.choice = self.sender().property("choice")
        self.accept()
