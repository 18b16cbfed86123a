"""The about dialog names what a report of a fault needs."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QLabel, QPushButton
from pytestqt.qtbot import QtBot

from annotations import __version__
from annotator.dialogs.about_dialog import AboutDialog


def test_versions_are_shown_and_copied(qtbot: QtBot) -> None:
    dialog = AboutDialog()
    qtbot.addWidget(dialog)
    dialog.show()
    versions = dialog.findChild(QLabel, "about_versions")
    assert isinstance(versions, QLabel)
    for part in (__version__, "Qt 6", "vtk 9", "mayavi 4", "numpy 2"):
        assert part in versions.text()
    copy = dialog.findChild(QPushButton, "about_copy")
    assert isinstance(copy, QPushButton)
    qtbot.mouseClick(copy, Qt.MouseButton.LeftButton)
    assert QApplication.clipboard().text() == versions.text()
    close = dialog.findChild(QPushButton, "about_close")
    assert isinstance(close, QPushButton)
    qtbot.mouseClick(close, Qt.MouseButton.LeftButton)
    assert not dialog.isVisible()
