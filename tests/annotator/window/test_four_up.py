import pytest
from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QLabel, QToolButton, QWidget

from annotator.looks import theme
from annotator.slices.fetching import SliceFetcher
from annotator.slices.slice_view import SliceView
from annotator.window.four_up import FourUp


@pytest.fixture
def panes(qtbot, session):
    fetcher = SliceFetcher(session, None)
    made = FourUp(session, QWidget(), [SliceView(session, axis, fetcher) for axis in range(3)])
    qtbot.addWidget(made)
    made.resize(600, 500)
    made.show()
    yield made
    fetcher.close()


def test_header_of_the_scene_says_what_a_click_places(panes, session):
    label = panes.findChild(QLabel, "placing_scene")
    assert not label.isVisible()
    session.place((318.0, 405.0, 235.0))
    session.activate("k1")
    session.set_mode("place")
    assert label.isVisible()
    assert label.text() == "place k1"
    session.activate("k0")
    assert label.text() == "place k0"
    session.set_locked("k0", True)
    assert label.text() == "k0 is locked"
    session.set_mode("navigate")
    assert not label.isVisible()


def test_headers_are_not_painted_again_for_an_edit_that_leaves_them_as_they_are(qtbot, panes, session):
    qtbot.waitExposed(panes)
    session.place((318.0, 405.0, 235.0))
    qtbot.wait(1)
    label = panes.findChild(QLabel, "title_slice0")
    painted = []

    class Watch(QObject):
        def eventFilter(self, watched, event):
            if event.type() == QEvent.Type.Paint:
                painted.append(watched)
            return False

    watch = Watch()
    label.installEventFilter(watch)
    session.place((318.0, 405.0, 240.0))
    qtbot.wait(1)
    assert painted == []
    session.look(maximized="slice0")
    qtbot.waitUntil(lambda: bool(painted))


def test_icons_follow_the_theme(panes):
    button = panes.findChild(QToolButton, "maximize_slice0")
    for dark in (True, False):
        palette = theme.palette(dark=dark)
        panes.setPalette(palette)
        image = button.icon().pixmap(32, 32).toImage()
        drawn = [
            QColor.fromRgba(image.pixel(x, y))
            for x in range(image.width())
            for y in range(image.height())
            if QColor.fromRgba(image.pixel(x, y)).alpha() == 255
        ]
        assert drawn
        wanted = palette.buttonText().color()
        assert all(abs(color.lightness() - wanted.lightness()) < 30 for color in drawn)
