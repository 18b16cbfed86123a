"""What changes in the row does not lay the window out."""

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QFont
from PySide6.QtWidgets import QApplication, QLabel, QToolButton, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks.laid_out_apart import LaidOutApart


class LayoutRequests(QObject):
    """Counts how often a widget is asked to lay out what is in it."""

    def __init__(self, widget: QWidget) -> None:
        super().__init__(widget)
        self.count = 0
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:
        self.count += event.type() == QEvent.Type.LayoutRequest
        return False


def test_another_text_lays_out_the_row_alone(qtbot: QtBot) -> None:
    window, row, label, button = QWidget(), LaidOutApart(), QLabel("1"), QToolButton(text="Stop")
    qtbot.addWidget(window)
    QVBoxLayout(window).addWidget(row)
    row.row.addWidget(label)
    row.row.addWidget(button)
    button.hide()
    window.resize(300, 100)
    window.show()
    QApplication.processEvents()
    requests = LayoutRequests(window)
    tall = row.height()
    assert tall == button.sizeHint().height() > label.sizeHint().height()

    label.setText("1, 2, 3, 4, 5")
    button.show()
    QApplication.processEvents()
    assert requests.count == 0
    assert row.height() == tall
    assert label.width() >= label.sizeHint().width()
    assert row.rect().contains(button.geometry())
    assert row.minimumSizeHint().width() == 0

    row.setFont(QFont(row.font().family(), 3 * row.font().pointSize()))
    QApplication.processEvents()
    assert requests.count > 0
    assert row.height() > tall
