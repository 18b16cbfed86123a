"""What went wrong, where, and what to do about it."""

import traceback
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Slot
from PySide6.QtGui import QDesktopServices, QFontDatabase, QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QStyle,
    QVBoxLayout,
    QWidget,
)

from annotations.errors import UserError
from annotator.looks.folding import Folding
from annotator.looks.labels import Heading, WrappedText
from annotator.looks.naming import named

_TITLE_LETTERS = 72


class ErrorDialog(QDialog):
    """Shows an error in the order in which a person needs it; the technical part is folded away.

    Parameters
    ----------
    error : Exception
        A `UserError` says its own problem, place and remedy; any other is shown as unexpected.
    log_path : Path, optional
        The log file, offered for opening.
    neutral : callable, optional
        Returns a text as the annotator may read it; all of it goes through there, the traceback as well.
    """

    def __init__(
        self,
        error: Exception,
        parent: QWidget | None = None,
        *,
        log_path: Path | None = None,
        neutral: Callable[[str], str] = str,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("error_dialog")
        self.setSizeGripEnabled(True)
        self._log_path = log_path
        if isinstance(error, UserError):
            self.setWindowTitle("Something needs your attention")
            problem, remedy = _sentence(error.problem), _sentence(error.remedy)
            where = "" if error.where is None else str(error.where)
        else:
            self.setWindowTitle("Unexpected error")
            problem = _sentence(f"Something unexpected happened: {str(error) or type(error).__name__}")
            where = ""
            remedy = (
                "Your annotation is safe: every finished edit is kept. You can go on, or save and restart."
            )
        problem, where, remedy = neutral(problem), neutral(where), neutral(remedy)
        details = neutral("".join(traceback.format_exception(error)).rstrip())
        self._report = "\n".join(filter(None, (problem, where, remedy))) + f"\n\n{details}\n"

        picture = QLabel()
        icon = self.style().standardIcon(QStyle.StandardPixmap.SP_MessageBoxWarning)
        picture.setPixmap(icon.pixmap(self.style().pixelMetric(QStyle.PixelMetric.PM_MessageBoxIconSize)))
        picture.setAccessibleName("Warning")

        text = named(QPlainTextEdit(details), "error_details", title="Technical details")
        text.setReadOnly(True)
        text.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        text.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        folding = Folding("Technical details", text, name="error_unfold", unfolded=False)
        folding.toggled.connect(self._on_folding_toggled)

        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        close = buttons.button(QDialogButtonBox.StandardButton.Close)
        close.setObjectName("error_close")
        close.setDefault(True)
        copy = named(QPushButton("&Copy"), "error_copy")
        copy.setToolTip("Copy the whole message, with its technical details")
        copy.setAutoDefault(False)
        copy.clicked.connect(self._on_copy_clicked)
        buttons.addButton(copy, QDialogButtonBox.ButtonRole.ActionRole)
        if log_path is not None:
            log = named(QPushButton("Open &log"), "error_log")
            log.setToolTip(str(log_path))
            log.setAutoDefault(False)
            log.clicked.connect(self._on_log_clicked)
            buttons.addButton(log, QDialogButtonBox.ButtonRole.ActionRole)
        buttons.rejected.connect(self.reject)

        message = QVBoxLayout()
        message.addWidget(Heading(problem, name="error_problem"))
        if where:
            message.addWidget(WrappedText(_breakable(where), name="error_where"))
        if remedy:
            message.addWidget(WrappedText(remedy, name="error_remedy"))
        message.addWidget(folding, 1)
        message.addStretch(0)
        body = QHBoxLayout()
        body.addWidget(picture, 0, Qt.AlignmentFlag.AlignTop)
        body.addSpacing(self.fontMetrics().height() // 2)
        body.addLayout(message, 1)
        layout = QVBoxLayout(self)
        layout.addLayout(body, 1)
        layout.addWidget(buttons)
        # A window's frame cuts its title where the window is narrow.
        self.setMinimumWidth(_TITLE_LETTERS * self.fontMetrics().averageCharWidth())

    @Slot(bool)
    def _on_folding_toggled(self, unfolded: bool) -> None:
        if unfolded:
            letter = self.fontMetrics().averageCharWidth()
            self.resize(max(self.width(), letter * 90), max(self.height(), letter * 60))

    @Slot()
    def _on_copy_clicked(self) -> None:
        QGuiApplication.clipboard().setText(self._report)

    @Slot()
    def _on_log_clicked(self) -> None:
        if self._log_path is not None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._log_path)))


def _sentence(text: str) -> str:
    if not text:
        return ""
    begun = text[0].upper() + text[1:]
    return begun if begun.endswith((".", "!", "?", "…")) else f"{begun}."


def _breakable(path: str) -> str:
    """Let a long path wrap after its separators, with spaces of no width."""
    return path.replace("/", "/\N{ZERO WIDTH SPACE}").replace("\\", "\\\N{ZERO WIDTH SPACE}")
