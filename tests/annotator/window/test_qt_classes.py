"""Qt's classes are made by the thread that uses them, before another one asks for them all."""

import subprocess
import sys

from pytestqt.qtbot import QtBot

from annotator.window.qt_classes import QtClasses

ASKING = """
import sys
from PySide6.QtCore import QCoreApplication
from annotator.window.qt_classes import QtClasses
import PySide6.QtCore, PySide6.QtGui, PySide6.QtWidgets

application = QCoreApplication([])
classes = QtClasses(application)
classes.make(application.quit)
application.exec()
modules = (PySide6.QtCore, PySide6.QtGui, PySide6.QtWidgets)
made = [{name: id(value) for name, value in vars(module).items()} for module in modules]
from PySide6.QtCore import *
from PySide6.QtGui import *
from PySide6.QtWidgets import *
sys.exit(made != [{name: id(value) for name, value in vars(module).items()} for module in modules])
"""


def test_nothing_is_left_to_be_made_for_an_import_of_all_names(qtbot: QtBot) -> None:
    asked = subprocess.run([sys.executable, "-c", ASKING], capture_output=True, text=True, check=False)
    assert asked.returncode == 0, asked.stderr


def test_who_waits_is_called_once_in_a_later_turn(qtbot: QtBot, qapp: object) -> None:
    called: list[str] = []
    classes = QtClasses(qapp)  # type: ignore[arg-type]

    classes.make(lambda: called.append("made"))

    assert called == []
    qtbot.waitUntil(lambda: called == ["made"])
    qtbot.wait(20)
    assert called == ["made"]
    classes.make(lambda: called.append("again"))
    qtbot.waitUntil(lambda: called == ["made", "again"])


def test_who_leaves_meanwhile_is_not_called(qtbot: QtBot, qapp: object) -> None:
    called: list[str] = []
    classes = QtClasses(qapp)  # type: ignore[arg-type]

    classes.make(lambda: called.append("made"))
    classes.stop()

    qtbot.wait(20)
    assert called == []
