"""The themes: readable colours, applied to a running application, and marks that can be told apart."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QColor, QImage, QPalette
from PySide6.QtWidgets import QApplication, QCheckBox, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from annotator.looks import theme


@pytest.fixture(autouse=True)
def light_afterwards(qapp: QApplication) -> Iterator[None]:
    yield
    theme.apply_theme("light")


def luminance(color: QColor) -> float:
    """Relative luminance of the Web Content Accessibility Guidelines 2.2."""
    parts = [
        value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
        for value in (color.redF(), color.greenF(), color.blueF())
    ]
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]


def contrast(first: QColor, second: QColor) -> float:
    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_every_text_is_readable_on_every_background(dark: bool) -> None:
    palette = theme.palette(dark=dark)
    colors = theme.colors(palette)
    texts = [*colors.axes, colors.placing, colors.warning, colors.error, colors.success, colors.muted]
    texts += [colors.outside, palette.color(QPalette.ColorRole.Text), palette.color(QPalette.ColorRole.Link)]
    for background in (QPalette.ColorRole.Window, QPalette.ColorRole.Base, QPalette.ColorRole.AlternateBase):
        for text in texts:
            assert contrast(text, palette.color(background)) >= 4.5, (text.name(), background)


@pytest.mark.parametrize("dark", [False, True])
def test_selected_text_and_buttons_are_readable(dark: bool) -> None:
    palette = theme.palette(dark=dark)
    for text, background in (
        (QPalette.ColorRole.HighlightedText, QPalette.ColorRole.Highlight),
        (QPalette.ColorRole.ButtonText, QPalette.ColorRole.Button),
        (QPalette.ColorRole.ToolTipText, QPalette.ColorRole.ToolTipBase),
    ):
        assert contrast(palette.color(text), palette.color(background)) >= 4.5


def test_a_theme_is_applied_to_the_application_and_its_widgets(qtbot: QtBot, qapp: QApplication) -> None:
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.show()
    for name, dark in (("dark", True), ("light", False)):
        theme.apply_theme(name)
        assert theme.is_dark(qapp.palette()) == dark
        qtbot.waitUntil(lambda wanted=dark: theme.is_dark(widget.palette()) == wanted)


def test_the_system_theme_follows_the_system_and_others_do_not(
    qapp: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    scheme: list[Any] = [Qt.ColorScheme.Dark]
    monkeypatch.setattr(type(qapp.styleHints()), "colorScheme", lambda _hints: scheme[0])
    theme.apply_theme("system")
    assert theme.is_dark(qapp.palette())
    scheme[0] = Qt.ColorScheme.Light
    qapp.styleHints().colorSchemeChanged.emit(scheme[0])
    assert not theme.is_dark(qapp.palette())
    theme.apply_theme("dark")
    qapp.styleHints().colorSchemeChanged.emit(scheme[0])
    assert theme.is_dark(qapp.palette())


def picture(widget: QWidget, size: int = 32) -> QImage:
    image = QImage(size, size, QImage.Format.Format_RGB32)
    image.fill(widget.palette().color(QPalette.ColorRole.Window))
    widget.render(image, QPoint())
    return image


def strongest_contrast(image: QImage, background: QColor, area: QRect) -> float:
    return max(
        contrast(image.pixelColor(x, y), background)
        for x in range(area.left(), area.right())
        for y in range(area.top(), area.bottom())
    )


@pytest.mark.parametrize("name", ["light", "dark"])
def test_an_empty_check_box_is_seen(qtbot: QtBot, name: str) -> None:
    theme.apply_theme(name)
    box = QCheckBox()
    qtbot.addWidget(box)
    box.resize(32, 32)
    image = picture(box)
    background = box.palette().color(QPalette.ColorRole.Window)
    assert strongest_contrast(image, background, QRect(0, 0, 20, 32)) >= 3


@pytest.mark.parametrize("name", ["light", "dark"])
def test_a_button_that_is_on_does_not_look_like_one_that_is_off(qtbot: QtBot, name: str) -> None:
    theme.apply_theme(name)
    button = QToolButton()
    qtbot.addWidget(button)
    button.setCheckable(True)
    button.resize(32, 32)
    off = picture(button).pixelColor(16, 6)
    button.setChecked(True)
    on = picture(button).pixelColor(16, 6)
    assert abs(on.blue() - on.red()) > abs(off.blue() - off.red()) + 30


def test_a_theme_needs_an_application(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(QApplication, "instance", staticmethod(lambda: None))
    with pytest.raises(RuntimeError, match="QApplication"):
        theme.apply_theme("dark")
    monkeypatch.undo()
