"""What a panel's dock paints anew when it gets another size."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QImage, QPaintEvent, QRegion
from PySide6.QtWidgets import QMainWindow, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.redrawing import keep_painted
from annotator.window.panel_dock import PanelDock


class Table(QWidget):
    """Notes what of it is painted."""

    def __init__(self) -> None:
        super().__init__()
        self.painted = QRegion()
        self.setFixedHeight(100)

    def paintEvent(self, event: QPaintEvent) -> None:
        self.painted += event.region()


class Docks(QMainWindow):
    """A dock with a table at the left, and below all another one."""

    def __init__(self, table: Table) -> None:
        super().__init__()
        panel = QWidget()
        keep_painted(panel)
        layout = QVBoxLayout(panel)
        layout.addWidget(table)
        layout.addStretch(1)
        self.dock, self.below = PanelDock("Keypoints, and what belongs to them"), PanelDock("Predictions")
        self.dock.setWidget(panel)
        self.below.setWidget(QWidget())
        self.below.widget().setFixedHeight(120)
        self.setCentralWidget(QWidget())
        self.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, self.dock)
        self.addDockWidget(Qt.DockWidgetArea.BottomDockWidgetArea, self.below)


def shown(qtbot: QtBot, table: Table) -> Docks:
    window = Docks(table)
    qtbot.addWidget(window)
    window.resize(800, 600)
    with qtbot.waitExposed(window):
        window.show()
    qtbot.waitUntil(lambda: not table.painted.isEmpty())
    return window


def test_when_another_panel_opens_or_closes_below_it_its_table_stays_as_it_is(qtbot: QtBot) -> None:
    table = Table()
    window = shown(qtbot, table)
    heights = {window.dock.height()}
    table.painted = QRegion()

    for is_below in (False, True):
        window.below.setVisible(is_below)
        qtbot.wait(20)
        heights.add(window.dock.height())

    assert len(heights) == 2
    assert table.painted.isEmpty()


def test_of_another_width_its_title_is_written_anew(qtbot: QtBot) -> None:
    window = shown(qtbot, Table())
    for width in (110, 320):
        window.resizeDocks([window.dock], [width], Qt.Orientation.Horizontal)
        qtbot.wait(20)
    kept = on_screen(window)

    window.dock.update()
    qtbot.wait(20)

    assert window.dock.width() > 250
    assert kept == on_screen(window)


def on_screen(window: Docks) -> QImage:
    """Return what is really painted: to grab a widget would paint it."""
    image = window.screen().grabWindow(window.winId()).toImage()
    assert not image.isNull()
    return image
