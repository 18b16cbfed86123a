"""Labels keep their whole text in sight, or in the tooltip."""

import pytest
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import QApplication, QDialog, QVBoxLayout
from pytestqt.qtbot import QtBot

from annotator.looks import theme
from annotator.looks.labels import ElidedText, Heading, WrappedText

SENTENCE = "The file is cut short: its header promises 2,444,328,960 bytes and there are 1,048,576. " * 3


@pytest.mark.parametrize("kind", [WrappedText, Heading])
@pytest.mark.parametrize("width", [150, 400, 900])
def test_a_wrapped_text_has_the_height_that_its_width_needs(
    qtbot: QtBot, kind: type[WrappedText], width: int
) -> None:
    dialog = QDialog()
    qtbot.addWidget(dialog)
    layout = QVBoxLayout(dialog)
    label = kind(SENTENCE)
    layout.addWidget(label)
    dialog.resize(width, 10)
    dialog.show()
    qtbot.waitUntil(
        lambda: (
            label.height() >= label.heightForWidth(label.width()) and dialog.rect().contains(label.geometry())
        )
    )


def test_a_wider_window_needs_no_room_for_the_lines_of_a_narrower_one(qtbot: QtBot) -> None:
    dialog = QDialog()
    qtbot.addWidget(dialog)
    layout = QVBoxLayout(dialog)
    label = WrappedText(SENTENCE)
    layout.addWidget(label)
    layout.addStretch(1)
    dialog.resize(150, 600)
    dialog.show()
    qtbot.waitUntil(lambda: dialog.height() > 150)
    narrow = label.height()
    dialog.resize(900, 600)
    qtbot.waitUntil(lambda: label.height() < narrow / 3)


def test_a_longer_text_makes_its_window_grow(qtbot: QtBot) -> None:
    dialog = QDialog()
    qtbot.addWidget(dialog)
    layout = QVBoxLayout(dialog)
    label = WrappedText("Short.")
    layout.addWidget(label)
    dialog.resize(200, 10)
    dialog.show()
    before = dialog.height()
    label.setText(SENTENCE)
    qtbot.waitUntil(lambda: dialog.height() > before)


def test_a_text_keeps_to_its_color_when_the_theme_changes(qtbot: QtBot, qapp: QApplication) -> None:
    muted, plain = WrappedText("x"), WrappedText("x")
    muted.set_color(lambda colors: colors.muted)
    plain.set_color(lambda colors: colors.error)
    plain.set_color(None)
    for label in (muted, plain):
        qtbot.addWidget(label)
        label.show()
    for name in ("dark", "light"):
        theme.apply_theme(name)
        wanted = theme.colors(qapp.palette()).muted
        qtbot.waitUntil(lambda wanted=wanted: muted.palette().color(muted.foregroundRole()) == wanted)
        text = qapp.palette().color(QPalette.ColorRole.WindowText)
        qtbot.waitUntil(lambda text=text: plain.palette().color(plain.foregroundRole()) == text)


def test_an_elided_text_fits_anywhere_and_has_the_whole_in_its_tooltip(qtbot: QtBot) -> None:
    path = "/a/very/long/folder/that/nobody/can/read/at/once/" * 4
    label = ElidedText(path)
    qtbot.addWidget(label)
    assert label.minimumSizeHint().width() < 100
    assert label.sizeHint().width() < label.fontMetrics().horizontalAdvance(path)
    assert label.toolTip() == path
    label.resize(120, 20)
    ink = label.grab().toImage()
    background = ink.pixelColor(0, 0)
    assert any(ink.pixelColor(x, y) != background for x in range(ink.width()) for y in range(ink.height()))
