"""What the dialogs about a study's rules have in common: they say what cannot be, and lose nothing."""

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt, Signal, Slot
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QLayout,
    QMessageBox,
    QVBoxLayout,
    QWidget,
)

from annotations.documents.study import Study
from annotations.errors import UserError
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named

_PROBLEMS_SHOWN = 3
_LINES_RESERVED = 3


class StudyForm(QDialog):
    """A dialog that stays until what it says is written, and asks before it is left with choices unsaved.

    Signals
    -------
    submitted
        ``study`` is to be written; `finish` or `show_failure` is what comes of it.

    Attributes
    ----------
    study : Study or None
        What the fields say; None while that cannot be a study.
    """

    submitted = Signal()

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.study: Study | None = None
        self._is_writing = False
        self._failure = ""
        self._begun: object = None
        self._question: QMessageBox | None = None
        self.setWindowTitle(title)
        self.setSizeGripEnabled(True)
        self._heading = Heading(name="study_heading")
        self._problem = WrappedText(name="study_problem")
        self._problem.set_color(lambda colors: colors.error)
        self._problem.setAlignment(Qt.AlignmentFlag.AlignTop)
        # Fields that jump while a name is typed would be hard to hit.
        self._problem.setMinimumHeight(_LINES_RESERVED * self.fontMetrics().lineSpacing())
        self._buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel
        )
        self._ok = named(self._buttons.button(QDialogButtonBox.StandardButton.Ok), "study_ok")
        self._ok.setDefault(True)
        named(self._buttons.button(QDialogButtonBox.StandardButton.Cancel), "study_cancel")
        self._buttons.accepted.connect(self._on_buttons_accepted)
        self._buttons.rejected.connect(self.reject)

    def finish(self) -> None:
        """Close the dialog: what it says is written."""
        self.accept()

    def show_failure(self, error: Exception) -> None:
        """Say why nothing was written; all that was typed stays."""
        self._is_writing = False
        self._failure = problem_of(error)
        self._draw()

    def reject(self) -> None:
        if self._state() == self._begun:
            super().reject()
        elif self._question is None:
            self._ask_before_leaving()

    def _state(self) -> object:
        """Return what a person can have changed, to be compared."""
        raise NotImplementedError

    def _draw(self) -> None:
        """Read the fields, and show what comes of them."""
        raise NotImplementedError

    def _lay_out_form(self, columns: QLayout, *below: QWidget) -> None:
        layout = QVBoxLayout(self)
        layout.addWidget(self._heading)
        layout.addLayout(columns)
        layout.setStretch(1, 1)
        for widget in (*below, self._problem, self._buttons):
            layout.addWidget(widget)
        self.resize(_roomy_size(self))

    def _show_problems(self, problems: Sequence[str], *, is_ready: bool) -> None:
        more = len(problems) - _PROBLEMS_SHOWN
        shown = [*problems[:_PROBLEMS_SHOWN], *([f"And {more} more."] if more > 0 else [])]
        self._problem.setText("\n".join(shown) or self._failure)
        self._ok.setEnabled(is_ready and not problems and not self._is_writing)

    def _ask_before_leaving(self) -> None:
        question = QMessageBox(self)
        question.setObjectName("study_leave_question")
        question.setIcon(QMessageBox.Icon.Question)
        question.setWindowTitle(self.windowTitle())
        question.setText("Leave without writing what you have chosen here?")
        question.setInformativeText("It is not kept anywhere.")
        question.setStandardButtons(QMessageBox.StandardButton.Discard | QMessageBox.StandardButton.Cancel)
        question.button(QMessageBox.StandardButton.Cancel).setText("&Stay here")
        question.setDefaultButton(QMessageBox.StandardButton.Cancel)
        named(question.button(QMessageBox.StandardButton.Discard), "study_leave").setText("&Leave")

        question.finished.connect(self._on_question_finished)
        self._question = question
        question.open()

    @Slot(int)
    def _on_question_finished(self, answer: int) -> None:
        if self._question is not None:
            self._question.deleteLater()
            self._question = None
        if answer == QMessageBox.StandardButton.Discard:
            self.done(QDialog.DialogCode.Rejected)

    @Slot()
    def _on_field_changed(self) -> None:
        self._failure = ""
        self._draw()

    @Slot()
    def _on_buttons_accepted(self) -> None:
        if self._ok.isEnabled() and self.study is not None:
            self._is_writing, self._failure = True, ""
            self._draw()
            self.submitted.emit()


def problem_of(error: Exception) -> str:
    """Say what is wrong as a sentence."""
    if not isinstance(error, UserError):
        return f"Something unexpected happened: {str(error) or type(error).__name__}."
    if error.where is not None:
        return str(error)
    return str(error)[:1].upper() + str(error)[1:]


def _roomy_size(dialog: QWidget) -> QSize:
    """Return the size in which both columns of a dialog read well, as far as the screen has it."""
    unit = dialog.fontMetrics().height()
    room = dialog.screen().availableSize()
    return QSize(min(60 * unit, room.width() * 9 // 10), min(40 * unit, room.height() * 9 // 10))
