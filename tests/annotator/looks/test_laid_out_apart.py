"""What changes in the row does not lay the window out."""

import pytest
from PySide6.QtCore import QEvent, QObject
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


def lay_out() -> None:
    """Let the row, then the window, and then the row in its new width be laid out."""
    for _ in range(3):
        QApplication.processEvents()


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window, row = QWidget(), LaidOutApart()
    qtbot.addWidget(window)
    QVBoxLayout(window).addWidget(row)
    row.row.addWidget(QLabel("1"))
    row.row.addWidget(QToolButton(text="Stop"))
    window.resize(300, 100)
    window.show()
    lay_out()
    return window


def children(window: QWidget) -> tuple[LaidOutApart, QLabel, QToolButton]:
    row, label, button = (window.findChild(kind) for kind in (LaidOutApart, QLabel, QToolButton))
    assert isinstance(row, LaidOutApart)
    assert isinstance(label, QLabel)
    assert isinstance(button, QToolButton)
    return row, label, button


def test_another_text_lays_out_the_row_alone(window: QWidget) -> None:
    row, label, button = children(window)
    tall = row.height()
    assert tall == button.sizeHint().height() > label.sizeHint().height()
    label.setText("1, 2, 3, 4, 5")
    lay_out()
    requests = LayoutRequests(window)

    for text in ("1", "1, 2", "1, 2, 3, 4, 5", ""):
        label.setText(text)
        button.setVisible(text != "1")
        lay_out()
        assert row.height() == tall
        assert label.width() >= label.sizeHint().width()
        assert row.rect().contains(button.geometry())
    assert requests.count == 0


def test_the_window_is_wide_enough_for_all_of_it(window: QWidget) -> None:
    row, label, button = children(window)
    for text in ("1", "It was never as long as this", "1"):
        label.setText(text)
        lay_out()
        window.resize(window.minimumSizeHint())
        lay_out()
        assert label.width() >= label.sizeHint().width()
        assert row.rect().contains(button.geometry())


@pytest.mark.parametrize("kind", [QEvent.Type.FontChange, QEvent.Type.StyleChange])
def test_another_font_or_style_is_laid_out_anew(window: QWidget, kind: QEvent.Type) -> None:
    row, label, _ = children(window)
    label.setText("It was never as long as this")
    lay_out()
    label.setText("1")
    lay_out()
    wide = row.minimumSizeHint().width()
    requests = LayoutRequests(window)

    QApplication.sendEvent(row, QEvent(kind))
    lay_out()
    assert requests.count > 0
    assert row.minimumSizeHint().width() < wide
