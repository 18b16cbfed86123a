"""Why somebody should look at a volume, in the annotator's words."""

from PySide6.QtCore import Slot
from PySide6.QtGui import QKeySequence, QShortcut, QTextOption
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QPlainTextEdit, QPushButton, QVBoxLayout, QWidget

from annotations.documents.annotation import LONGEST_FLAG
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named


class FlagDialog(QDialog):
    """Asks for the reason of a flag; once there is one, to change it or to take it back."""

    def __init__(self, flag: str | None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("flag_dialog")
        self.setWindowTitle("Flag the volume")
        self._is_removed = False
        self._text = named(QPlainTextEdit(flag or ""), "flag_reason", title="Why somebody should look at it")
        self._text.setTabChangesFocus(True)
        self._text.setWordWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
        self._text.setPlaceholderText("Such as: the tip is hidden, or two instruments are in view")
        self._text.selectAll()
        self._text.textChanged.connect(self._on_text_changed)
        self._problem = WrappedText(name="flag_problem")
        self._problem.set_color(lambda colors: colors.error)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(buttons.button(QDialogButtonBox.StandardButton.Ok), "flag_ok")
        self._ok.setText("Change the flag" if flag else "Flag the volume")
        named(buttons.button(QDialogButtonBox.StandardButton.Cancel), "flag_cancel")
        if flag:
            remove = named(QPushButton("&Remove the flag"), "flag_remove")
            remove.setAutoDefault(False)
            remove.clicked.connect(self._on_remove_clicked)
            buttons.addButton(remove, QDialogButtonBox.ButtonRole.DestructiveRole)
        # Return alone begins a line.
        for keys in ("Ctrl+Return", "Ctrl+Enter"):
            QShortcut(QKeySequence(keys), self).activated.connect(self._ok.click)
        self._ok.setToolTip("Ctrl+Return")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(Heading("Why should somebody look at this volume?"))
        layout.addWidget(
            WrappedText("The reason is kept in your annotation, and whoever reviews the study finds it.")
        )
        layout.addWidget(self._text, 1)
        layout.addWidget(self._problem)
        layout.addWidget(buttons)
        letter = self.fontMetrics()
        self.resize(letter.averageCharWidth() * 64, letter.height() * 16)
        self._text.setFocus()
        self._draw()

    @property
    def reason(self) -> str | None:
        """What the flag is to say; None where it is to be taken back."""
        return None if self._is_removed else self._text.toPlainText().strip() or None

    @Slot()
    def _on_text_changed(self) -> None:
        self._draw()

    @Slot()
    def _on_remove_clicked(self) -> None:
        self._is_removed = True
        self.accept()

    def _draw(self) -> None:
        reason = self.reason or ""
        too_long = len(reason) - LONGEST_FLAG
        self._ok.setEnabled(bool(reason) and too_long <= 0)
        self._problem.setText(f"Too long by {too_long} letters of {LONGEST_FLAG}." if too_long > 0 else "")
