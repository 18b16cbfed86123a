"""What a person reads and presses in the panel of predictions."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QLabel, QLineEdit, QPushButton, QTabWidget, QTreeView, QWidget
from pytestqt.qtbot import QtBot

from annotator.panels.predictions.predictions_panel import PredictionsPanel
from annotator.session import Session
from tests.annotator.redrawn import redrawn

LEFT = Qt.MouseButton.LeftButton


def shown(qtbot: QtBot, session: Session) -> PredictionsPanel:
    panel = PredictionsPanel(session)
    qtbot.addWidget(panel)
    panel.resize(420, 620)
    with qtbot.waitExposed(panel):
        panel.show()
    return panel


def words(panel: QWidget, name: str) -> str:
    label = redrawn(panel).findChild(QLabel, name)
    assert isinstance(label, QLabel), name
    return label.text()


def button(panel: QWidget, name: str) -> QPushButton:
    found = redrawn(panel).findChild(QPushButton, name)
    assert isinstance(found, QPushButton), name
    return found


def choice(panel: QWidget, name: str) -> QComboBox:
    found = redrawn(panel).findChild(QComboBox, name)
    assert isinstance(found, QComboBox), name
    return found


def choose(panel: QWidget, name: str, text: str) -> None:
    found = choice(panel, name)
    place = found.findText(text)
    assert place >= 0, [found.itemText(at) for at in range(found.count())]
    found.setCurrentIndex(place)
    found.activated.emit(place)


def note(panel: QWidget) -> QLineEdit:
    found = redrawn(panel).findChild(QLineEdit, "verdict_note")
    assert isinstance(found, QLineEdit)
    return found


def table(panel: QWidget, name: str = "errors_list") -> QTreeView:
    found = redrawn(panel).findChild(QTreeView, name)
    assert isinstance(found, QTreeView)
    return found


def tabs(panel: QWidget) -> QTabWidget:
    found = redrawn(panel).findChild(QTabWidget, "predictions_tabs")
    assert isinstance(found, QTabWidget)
    return found


def column(panel: QWidget, title: str) -> int:
    model = table(panel).model()
    titles = [model.headerData(at, Qt.Orientation.Horizontal) for at in range(model.columnCount())]
    return [each.replace("\n", " ") for each in titles].index(title)


def cells(panel: QWidget, title: str, name: str = "errors_list") -> list[str]:
    model, at = table(panel, name).model(), column(panel, title)
    return [model.index(row, at).data() for row in range(model.rowCount())]


def volumes(panel: QWidget) -> list[str]:
    return cells(panel, "Volume")


def click(qtbot: QtBot, panel: QWidget, row: int) -> None:
    view = table(panel)
    place = view.visualRect(view.model().index(row, 0)).center()
    qtbot.mouseClick(view.viewport(), LEFT, pos=place)


def opened(qtbot: QtBot, session: Session, volume: str) -> None:
    qtbot.waitUntil(lambda: session.reviewing.open_volume == volume and not session.jobs.running)
