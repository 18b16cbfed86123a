"""What went wrong, where, and what to do about it."""

import traceback
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Slot
from PySide6.QtGui import QDesktopServices, QFontDatabase, QGuiApplication
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QLabel,
    QPlainTextEdit,
    QPushButton,
    QStyle,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from annotations.errors import UserError
from annotator.labels import Heading, WrappedText
from annotator.naming import named


class ErrorDialog(QDialog):
    """Shows an error in the order in which a person needs it; the technical part is folded away.

    Parameters
    ----------
    error : Exception
        A `UserError` says its own problem, place and remedy; any other is shown as unexpected.
    log_path : Path, optional
        The log file, offered for opening.
    """

    def __init__(
        self, error: Exception, parent: QWidget | None = None, *, log_path: Path | None = None
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
            problem = f"Something unexpected happened: {_sentence(str(error) or type(error).__name__)}"
            where = ""
            remedy = (
                "Your annotation is safe: every finished edit is kept. You can go on, or save and restart."
            )
        details = "".join(traceback.format_exception(error)).rstrip()
        self._report = "\n".join(filter(None, (problem, where, remedy))) + f"\n\n{details}\n"

        picture = QLabel()
        icon = self.style().standardIcon(QStyle.StandardPixmap.SP_MessageBoxWarning)
        picture.setPixmap(icon.pixmap(self.style().pixelMetric(QStyle.PixelMetric.PM_MessageBoxIconSize)))
        picture.setAccessibleName("Warning")

        self._details = QPlainTextEdit(details)
        self._details.setObjectName("error_details")
        self._details.setAccessibleName("Technical details")
        self._details.setReadOnly(True)
        self._details.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self._details.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self._details.setVisible(False)
        self._unfold = named(QToolButton(), "error_unfold")
        self._unfold.setText("Technical details")
        self._unfold.setCheckable(True)
        self._unfold.setAutoRaise(True)
        self._unfold.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._unfold.setArrowType(Qt.ArrowType.RightArrow)
        self._unfold.toggled.connect(self._on_unfold_toggled)

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
        message.addWidget(self._unfold)
        message.addWidget(self._details, 1)
        message.addStretch(0)
        layout = QGridLayout(self)
        layout.addWidget(picture, 0, 0, Qt.AlignmentFlag.AlignTop)
        layout.addLayout(message, 0, 1)
        layout.addWidget(buttons, 1, 0, 1, 2)
        layout.setColumnStretch(1, 1)
        layout.setRowStretch(0, 1)
        self.setMinimumWidth(self.fontMetrics().averageCharWidth() * 60)

    @Slot(bool)
    def _on_unfold_toggled(self, unfolded: bool) -> None:
        self._unfold.setArrowType(Qt.ArrowType.DownArrow if unfolded else Qt.ArrowType.RightArrow)
        self._details.setVisible(unfolded)
        if unfolded:
            self.resize(max(self.width(), 720), max(self.height(), 460))

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
