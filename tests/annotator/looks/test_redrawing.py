"""What is only read is drawn after what is looked at: once, and always."""

from PySide6.QtCore import QObject
from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.redrawing import Redrawing


class Looked(QWidget):
    """Notes when it is painted."""

    def __init__(self, log: list[str]) -> None:
        super().__init__()
        self._log = log

    def paintEvent(self, _event: QPaintEvent) -> None:
        self._log.append("painted")


def test_any_number_of_wishes_is_one_drawing_in_the_turn_after_the_painting(qtbot: QtBot) -> None:
    log: list[str] = []
    looked, parent = Looked(log), QObject()
    qtbot.addWidget(looked)
    with qtbot.waitExposed(looked):
        looked.show()
    qtbot.waitUntil(lambda: bool(log))
    redrawing = Redrawing(lambda: log.append("drawn"), parent)
    log.clear()
    for _ in range(20):
        redrawing.ask()
        looked.update()
    assert log == []
    QApplication.processEvents()
    assert log == ["painted"]
    # The timer that ends the turn; what other timers of that moment ask for comes before it, too.
    QApplication.processEvents()
    assert log == ["painted"]
    qtbot.waitUntil(lambda: len(log) > 1)
    QApplication.processEvents()
    assert log == ["painted", "drawn"]


def test_a_drag_without_end_does_not_starve_it(qtbot: QtBot) -> None:
    log: list[str] = []
    looked, parent = Looked(log), QObject()
    qtbot.addWidget(looked)
    with qtbot.waitExposed(looked):
        looked.show()
    redrawing = Redrawing(lambda: log.append("drawn"), parent)
    for _ in range(30):
        # At every turn of the event loop the next moves are there already.
        for _ in range(3):
            redrawing.ask()
            looked.update()
        QApplication.processEvents()
    assert log.count("painted") >= 30
    assert 8 <= log.count("drawn") <= 30


def test_what_was_drawn_meanwhile_is_not_drawn_again(qtbot: QtBot) -> None:
    drawn: list[str] = []
    parent = QObject()
    redrawing = Redrawing(lambda: drawn.append("drawn"), parent)
    redrawing.draw_now()
    assert drawn == []
    redrawing.ask()
    redrawing.draw_now()
    redrawing.ask()
    redrawing.drop()
    for _ in range(5):
        QApplication.processEvents()
    assert drawn == ["drawn"]
    redrawing.ask()
    qtbot.waitUntil(lambda: len(drawn) == 2)
