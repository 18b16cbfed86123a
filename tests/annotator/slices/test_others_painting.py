"""The others' keypoints and boxes on a slice: in their colours, fading with distance, and never met."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from pytestqt.qtbot import QtBot

from annotations.geometry.kinematics import link_boxes
from annotator.looks.annotator_marks import annotator_color, text_color
from annotator.session import Session
from annotator.session.agreement.differences import Difference
from annotator.session.agreement.others import OtherAnnotation
from annotator.session.options import SessionOptions
from annotator.slices.fetching import SliceFetcher
from annotator.slices.others_painting import (
    other_marks,
    other_outlines,
    paint_differences,
    paint_other_marks,
    paint_other_outlines,
)
from annotator.slices.projection import Plane
from annotator.slices.slice_view import SliceView
from annotator.slices.viewport import Area, Viewport
from tests.annotator.compared_study import POSE, TOOL, write_compared
from tests.annotator.conftest import open_and_wait
from tests.annotator.redrawn import redrawn

PLANE = Plane.across(0, (400, 200, 200), (10.0, 10.0, 10.0), 2)
VIEWPORT = Viewport.fitted(PLANE, Area(0, 0, 300, 300))
PLACE_UM = (1000.0, 800.0, 1000.0)


def other(number: int = 0, **fields: object) -> OtherAnnotation:
    made = OtherAnnotation("ben", None, {"k0": PLACE_UM}, {}, number, "B")  # type: ignore[arg-type]
    return replace(made, **fields)  # type: ignore[arg-type]


def painted(paint: Callable[[QPainter], None]) -> QImage:
    image = QImage(300, 300, QImage.Format.Format_RGB32)
    image.fill(QColor("black"))
    painter = QPainter(image)
    paint(painter)
    painter.end()
    return image


def pixels(image: QImage) -> np.ndarray:
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)[..., 2::-1]


def count(image: QImage, color: QColor) -> int:
    """Count the pixels of a colour, smoothed edges of its lines among them."""
    wanted = np.array([color.red(), color.green(), color.blue()], float)
    found = pixels(image).astype(float)
    lengths = np.linalg.norm(found, axis=-1)
    alike = found @ wanted / np.maximum(lengths, 1) / np.linalg.norm(wanted)
    return int(((alike > 0.99) & (lengths > 60)).sum())


def test_marks_are_where_the_keypoints_are_and_fade_with_distance() -> None:
    (on_plane,) = other_marks([other()], VIEWPORT, 100)
    (near,) = other_marks([other()], VIEWPORT, 120)
    (far,) = other_marks([other()], VIEWPORT, 300)

    assert (on_plane.x, on_plane.y) == VIEWPORT.pixel(PLACE_UM)
    assert on_plane.nearness == 1
    assert 0 < near.nearness < 1
    assert far.nearness == 0
    assert on_plane.opacity > near.opacity > far.opacity > 0


@pytest.mark.parametrize("number", [0, 1, 2, 6, 19])
def test_a_mark_has_its_annotators_color(qapp: object, number: int) -> None:
    marks = other_marks([other(number)], VIEWPORT, 100)
    image = painted(lambda painter: paint_other_marks(painter, marks, VIEWPORT.area))

    x, y = VIEWPORT.pixel(PLACE_UM)
    assert image.pixelColor(round(x), round(y)) == annotator_color(number)


def test_far_from_the_plane_only_an_outline_is_left(qapp: object) -> None:
    marks = other_marks([other()], VIEWPORT, 300)
    image = painted(lambda painter: paint_other_marks(painter, marks, VIEWPORT.area))

    x, y = VIEWPORT.pixel(PLACE_UM)
    assert image.pixelColor(round(x), round(y)).lightness() < 20
    assert pixels(image).max() > 30


def test_those_who_agree_share_one_label(qapp: object) -> None:
    apart = {"k0": (1000.0, 1900.0, 100.0)}
    together = other_marks([other(0), other(1, initials="C")], VIEWPORT, 100)
    separate = other_marks([other(0), other(1, initials="C", positions_um=apart)], VIEWPORT, 100)

    def ink(marks: object) -> int:
        image = painted(lambda painter: paint_other_marks(painter, marks, VIEWPORT.area))  # type: ignore[arg-type]
        return count(image, text_color(0)) + count(image, text_color(1))

    assert ink(together) > 0
    assert ink(separate) > 0


def test_a_label_at_the_edge_stays_in_sight(qapp: object) -> None:
    at_edge = {"k0": VIEWPORT.position_um(1.0, 150.0, 1000.0)}
    marks = other_marks([other(positions_um=at_edge, initials="R1")], VIEWPORT, 100)
    image = painted(lambda painter: paint_other_marks(painter, marks, VIEWPORT.area))

    columns = np.nonzero(pixels(image).max(axis=(0, 2)) > 60)[0]
    assert columns.max() > 12


def test_a_difference_is_a_line_between_its_ends_firm_where_it_is_near(qapp: object) -> None:
    lines = [Difference(1, "k0", (1000.0, 200.0, 1000.0), (1000.0, 1800.0, 1000.0))]
    near, far = (
        painted(lambda painter, index=index: paint_differences(painter, VIEWPORT, index, lines))  # type: ignore[misc]
        for index in (100, 300)
    )
    x, y = (round(each) for each in VIEWPORT.pixel((1000.0, 1000.0, 1000.0)))

    around = QRect(x - 3, y - 3, 7, 7)
    assert count(near.copy(around), text_color(1)) > 5
    assert 0 < pixels(far.copy(around)).max() < pixels(near.copy(around)).max()
    outside = [round(each) for each in VIEWPORT.pixel((1000.0, 100.0, 1000.0))]
    assert near.pixelColor(*outside) == QColor("black")


def test_a_box_is_an_outline_where_the_plane_cuts_it(qapp: object) -> None:
    box = link_boxes(POSE, TOOL)["link0"]
    plane = Plane.across(0, (40, 60, 50), (440.0, 440.0, 300.0), 2)
    viewport = Viewport.fitted(plane, Area(0, 0, 300, 300))
    index = plane.index(box.center_um)
    boxed = other(2, boxes={"link0": box}, positions_um={})
    (outline,) = other_outlines([boxed], viewport, index)
    image = painted(lambda painter: paint_other_outlines(painter, [outline]))

    assert outline.number == 2
    x, y = (round(each) for each in viewport.pixel(box.center_um))
    assert image.pixelColor(x, y) == QColor("black")
    assert count(image, text_color(2)) > 50
    assert other_outlines([boxed], viewport, 0) == ()


# In the view


@pytest.fixture
def rita(qtbot: QtBot, options: SessionOptions, tmp_path: Path) -> Iterator[Session]:
    """The session of a reviewer of a study that three people have done, with everybody shown."""
    folder = write_compared(tmp_path / "study")
    session = Session(replace(options, annotator_name="rita"))
    open_and_wait(qtbot, session, folder)
    session.look(crosshair_um=POSE.position_um)
    session.others.want()
    qtbot.waitUntil(lambda: len(session.others.drawn) == 3)
    yield session
    session.shut_down()


@pytest.fixture
def view(qtbot: QtBot, rita: Session) -> Iterator[SliceView]:
    fetcher = SliceFetcher(rita)
    view = SliceView(rita, 2, fetcher)
    view.resize(400, 400)
    qtbot.addWidget(view)
    with qtbot.waitExposed(view):
        view.show()
    qtbot.waitUntil(lambda: view.is_sharp)
    yield view
    fetcher.close()


def test_toggling_one_changes_the_picture_and_not_the_image_below(
    qtbot: QtBot, rita: Session, view: SliceView
) -> None:
    everybody, drawn = redrawn(view).grab().toImage(), view.times_drawn
    rita.others.set_visible("chloe", False)
    without = view.grab().toImage()
    rita.others.set_visible("chloe", True)
    again = view.grab().toImage()

    assert everybody != without
    assert again == everybody
    assert view.times_drawn == drawn


def test_the_layer_and_the_key_that_hides_overlays_hide_them(rita: Session, view: SliceView) -> None:
    everybody = redrawn(view).grab().toImage()
    rita.look(overlays_hidden=True)
    bare = view.grab().toImage()
    rita.look(overlays_hidden=False)
    rita.toggle_layer("others")
    without = view.grab().toImage()

    assert count(bare, annotator_color(2)) == count(without, annotator_color(2)) == 0
    assert count(everybody, annotator_color(2)) > 0


def test_the_mouse_meets_none_of_them(qtbot: QtBot, rita: Session, view: SliceView) -> None:
    assert view.viewport is not None
    x, y = view.viewport.pixel(rita.others.drawn[0].positions_um["k0"])
    assert view.mark_under(x, y, 20.0) is None

    before = rita.document
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    assert rita.document is before
