"""Progress is shown without painting anything in the middle of a change."""

from PySide6.QtGui import QPaintEvent
from PySide6.QtWidgets import QApplication, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.progress import ProgressBar


class Neighbour(QWidget):
    """Counts how often it is painted."""

    def __init__(self) -> None:
        super().__init__()
        self.times = 0

    def paintEvent(self, _event: QPaintEvent) -> None:
        self.times += 1


def test_progress_waits_for_the_painting_of_everything_else(qtbot: QtBot) -> None:
    window, neighbour, bar = QWidget(), Neighbour(), ProgressBar()
    qtbot.addWidget(window)
    layout = QVBoxLayout(window)
    layout.addWidget(neighbour)
    layout.addWidget(bar)
    window.resize(300, 200)
    with qtbot.waitExposed(window):
        window.show()
    qtbot.waitUntil(lambda: neighbour.times > 0)
    QApplication.processEvents()
    empty, painted = bar.grab().toImage(), neighbour.times
    neighbour.update()
    bar.show_progress(7, 10)
    assert neighbour.times == painted
    assert (bar.value(), bar.maximum()) == (7, 10)
    qtbot.waitUntil(lambda: neighbour.times > painted)
    assert bar.grab().toImage() != empty
    bar.show_progress(0, 0)
    assert (bar.minimum(), bar.maximum()) == (0, 0)
