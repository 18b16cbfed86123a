"""The others' work in the scene: over the kept picture of the volume, and out of the mouse's way."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QFont, QImage
from pytestqt.qtbot import QtBot

from annotator.looks.annotator_marks import annotator_color, text_color
from annotator.scene.colors import rgb
from annotator.scene.others_layer import initials_picture, mark_picture
from annotator.session import Session
from annotator.session.options import SessionOptions
from tests.annotator.compared_study import IDS, WORST, write_compared
from tests.annotator.conftest import open_and_wait
from tests.annotator.scene.conftest import Scene


@pytest.fixture(params=["keypoints", "boxes"])
def rita(
    qtbot: QtBot, options: SessionOptions, tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[Session]:
    """The session of a reviewer, with the volume open on which three people differ most."""
    folder = write_compared(tmp_path / "study", methods=(request.param,))
    session = Session(replace(options, annotator_name="rita", method=request.param))
    open_and_wait(qtbot, session, folder)
    session.open_item(IDS.index(WORST))
    qtbot.waitUntil(lambda: session.current_index == IDS.index(WORST) and not session.jobs.running)
    yield session
    session.shut_down()


@pytest.fixture
def seen(qtbot: QtBot, rita: Session) -> Iterator[Scene]:
    scene = Scene(qtbot, rita)
    rita.others.want()
    qtbot.waitUntil(lambda: len(rita.others.drawn) == 3)
    scene.settle()
    yield scene
    scene.view.shut_down()


def count(pixels: np.ndarray, number: int) -> int:
    """Count the pixels of an annotator's colours, smoothed edges among them."""
    found, many = pixels[..., :3].astype(float), 0
    lengths = np.linalg.norm(found, axis=-1)
    for color in (annotator_color(number), text_color(number)):
        wanted = np.array(rgb(color), float)
        alike = found @ wanted / np.maximum(lengths, 1) / np.linalg.norm(wanted)
        many += int(((alike > 0.99) & (lengths > 120)).sum())
    return many


def test_everybody_is_there_in_their_colors(seen: Scene) -> None:
    pixels = seen.pixels()

    for number in range(3):
        assert count(pixels, number) > 5, number


def test_a_toggle_shows_at_once_and_does_not_draw_the_volume_again(seen: Scene) -> None:
    everybody, draws = seen.pixels(), seen.view.volume_draws
    seen.session.others.set_visible("chloe", False)
    without = seen.pixels()
    seen.session.others.set_visible("chloe", True)
    again = seen.pixels()

    assert count(without, 2) < count(everybody, 2)
    assert np.array_equal(again, everybody)
    assert seen.view.volume_draws == draws


def test_the_layer_hides_them_all_and_brings_them_back(qtbot: QtBot, seen: Scene) -> None:
    everybody = seen.pixels()
    seen.session.toggle_layer("others")
    without = seen.pixels()
    seen.session.toggle_layer("others")
    qtbot.waitUntil(lambda: len(seen.session.others.drawn) == 3)

    assert all(count(without, number) < count(everybody, number) for number in range(3))
    assert np.array_equal(seen.pixels(), everybody)


def test_a_click_on_one_activates_nothing(seen: Scene) -> None:
    before = seen.session.document, seen.session.view.active_part
    place_um = seen.session.others.drawn[0].positions_um["k3"]
    seen.click(seen.place_of(place_um))

    assert (seen.session.document, seen.session.view.active_part) == before


def test_marks_of_all_annotators_look_different(qapp: object) -> None:
    pictures = [mark_picture(number, 1.0) for number in range(20)]

    assert all(first != second for place, first in enumerate(pictures) for second in pictures[:place])


def test_initials_stand_side_by_side_in_their_colors(qapp: object) -> None:
    one: QImage = initials_picture([("A", 0)], QFont(), 1.0)
    two: QImage = initials_picture([("A", 0), ("B", 1)], QFont(), 1.0)

    assert two.width() > one.width()
    straight = two.convertToFormat(QImage.Format.Format_RGBA8888)
    pixels = np.frombuffer(straight.constBits(), np.uint8).reshape(two.height(), two.width(), 4)
    middle = one.width()
    assert count(pixels[:, :middle], 0) > 0 == count(pixels[:, :middle], 1)
    assert count(pixels[:, middle:], 1) > 0 == count(pixels[:, middle:], 0)
