"""An error says what was wrong, where, and what to do."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QApplication, QLabel, QPlainTextEdit, QPushButton, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from annotations.errors import UserError
from annotator.dialogs.error_dialog import ErrorDialog

LEFT = Qt.MouseButton.LeftButton


def raised(error: Exception) -> Exception:
    """Return an error with a traceback."""
    try:
        raise error
    except type(error) as caught:
        return caught


def show(qtbot: QtBot, error: Exception, log_path: Path | None = None) -> ErrorDialog:
    dialog = ErrorDialog(error, log_path=log_path)
    qtbot.addWidget(dialog)
    dialog.show()
    return dialog


def text(dialog: ErrorDialog, name: str) -> str:
    found = dialog.findChild(QLabel, name)
    assert isinstance(found, QLabel)
    return found.text().replace("\N{ZERO WIDTH SPACE}", "")


def press(qtbot: QtBot, dialog: ErrorDialog, kind: type[QWidget], name: str) -> None:
    found = dialog.findChild(kind, name)
    assert isinstance(found, kind)
    qtbot.mouseClick(found, LEFT)


def test_a_users_error_says_problem_place_and_remedy(qtbot: QtBot) -> None:
    dialog = show(qtbot, UserError("the file is empty", where=Path("/a/v.npy"), remedy="Export it again"))
    assert text(dialog, "error_problem") == "The file is empty."
    assert text(dialog, "error_where") == "/a/v.npy"
    assert text(dialog, "error_remedy") == "Export it again."


def test_what_is_not_known_is_left_out(qtbot: QtBot) -> None:
    dialog = show(qtbot, UserError("keypoint k0 is locked"))
    assert dialog.findChild(QLabel, "error_where") is None
    assert dialog.findChild(QLabel, "error_remedy") is None
    assert dialog.findChild(QPushButton, "error_log") is None


def test_an_unexpected_error_says_that_nothing_is_lost(qtbot: QtBot) -> None:
    dialog = show(qtbot, raised(ZeroDivisionError("division by zero")))
    assert "division by zero" in text(dialog, "error_problem")
    assert "safe" in text(dialog, "error_remedy")
    assert dialog.windowTitle() == "Unexpected error"


def test_technical_details_unfold(qtbot: QtBot) -> None:
    dialog = show(qtbot, raised(ZeroDivisionError("division by zero")))
    details = dialog.findChild(QPlainTextEdit, "error_details")
    assert isinstance(details, QPlainTextEdit)
    assert not details.isVisible()
    press(qtbot, dialog, QToolButton, "error_unfold")
    assert details.isVisible()
    assert "Traceback" in details.toPlainText()
    assert details.isReadOnly()


def test_everything_can_be_copied(qtbot: QtBot) -> None:
    error = UserError("the file is empty", where="/a/v.npy", remedy="Export it again")
    dialog = show(qtbot, raised(error))
    press(qtbot, dialog, QPushButton, "error_copy")
    copied = QApplication.clipboard().text()
    assert copied.startswith("The file is empty.\n/a/v.npy\nExport it again.\n\nTraceback")


def test_the_log_is_opened(qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[QUrl] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    dialog = show(qtbot, UserError("x"), tmp_path / "log.txt")
    press(qtbot, dialog, QPushButton, "error_log")
    assert opened == [QUrl.fromLocalFile(str(tmp_path / "log.txt"))]


def test_escape_and_close_end_it(qtbot: QtBot) -> None:
    dialog = show(qtbot, UserError("x"))
    press(qtbot, dialog, QPushButton, "error_close")
    assert not dialog.isVisible()


def test_the_title_has_room_in_the_frame_of_the_window(qtbot: QtBot) -> None:
    dialog = show(qtbot, UserError("it failed"))
    title = dialog.fontMetrics().horizontalAdvance(dialog.windowTitle())
    # Beside it are the frame's icon and buttons, and frames write in bold.
    assert dialog.width() >= 2 * title
