"""Handles tell what they do by their form, and the one that would be held by its colours."""

from dataclasses import replace
from itertools import combinations
from typing import get_args

import numpy as np
import pytest
from PySide6.QtGui import QColor

from annotator.scene.handles_layer import handle_picture
from annotator.session.editing.handles import HandleKind

KINDS: tuple[HandleKind, ...] = get_args(HandleKind)
BLUE = "#56b4e9"


def covered(kind: HandleKind) -> set[tuple[int, int]]:
    image = handle_picture(kind, BLUE, 1.0, pointed=False)
    return {
        (x, y)
        for x in range(image.width())
        for y in range(image.height())
        if image.pixelColor(x, y).alpha() > 128
    }


def test_every_kind_has_a_form_of_its_own(qapp: object) -> None:
    for first, second in combinations(KINDS, 2):
        either, both = covered(first) | covered(second), covered(first) & covered(second)
        assert len(both) < 0.8 * len(either), (first, second)


@pytest.mark.parametrize("kind", KINDS)
def test_a_form_fits_into_its_picture(qapp: object, kind: HandleKind) -> None:
    image = handle_picture(kind, BLUE, 1.0, pointed=False)
    last = image.width() - 1
    for at in range(image.width()):
        for x, y in ((at, 0), (at, last), (0, at), (last, at)):
            assert image.pixelColor(x, y).alpha() == 0


@pytest.mark.parametrize("kind", ["end", "bend"])
def test_a_sphere_is_seen_in_the_middle_of_what_stands_at_an_end(qapp: object, kind: HandleKind) -> None:
    image = handle_picture(kind, BLUE, 1.0, pointed=False)
    middle = image.rect().center()
    assert image.pixelColor(middle).alpha() == 0


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_pointed_at_stands_out(qapp: object, kind: HandleKind) -> None:
    images = [handle_picture(kind, BLUE, 1.0, pointed=pointed) for pointed in (False, True)]
    white = [
        sum(
            image.pixelColor(x, y) == QColor("white")
            for x in range(image.width())
            for y in range(image.height())
        )
        for image in images
    ]
    assert images[0] != images[1]
    assert white[1] != white[0]


def test_handles_show_where_they_can_be_held_in_place_mode_only(boxed) -> None:
    session = boxed.session
    session.look(layers=frozenset({"volume"}))
    shown = boxed.pixels()
    at = boxed.place_of(boxed.handle("center").position_um)
    session.set_mode("navigate")
    area = (slice(at.y() - 10, at.y() + 11), slice(at.x() - 10, at.x() + 11))
    changed = np.abs(boxed.pixels() - shown).max(axis=2) > 40
    assert changed[area].sum() > 60


def test_a_handle_keeps_its_size_at_every_zoom(boxed) -> None:
    session = boxed.session
    session.look(layers=frozenset())
    sizes = []
    for zoom in (1.0, 0.4):
        camera = boxed.view.camera
        boxed.view._set_camera(replace(camera, height_um=camera.height_um * zoom))
        with_handles = boxed.pixels()
        at = boxed.place_of(boxed.handle("center").position_um)
        session.set_mode("navigate")
        changed = np.abs(boxed.pixels() - with_handles).max(axis=2) > 0
        session.set_mode("place")
        area = changed[at.y() - 15 : at.y() + 16, at.x() - 15 : at.x() + 16]
        sizes.append(int(area.sum()))
    assert sizes[0] > 150
    assert sizes[1] == pytest.approx(sizes[0], rel=0.25)


def test_the_handle_under_the_cursor_is_drawn_otherwise(boxed) -> None:
    before = boxed.pixels()
    at = boxed.place_of(boxed.handle("center").position_um)
    boxed.hover(at)
    changed = np.abs(boxed.pixels() - before).max(axis=2) > 0
    rows, columns = np.nonzero(changed)
    assert len(rows) > 30
    assert np.abs(rows - at.y()).max() < 16
    assert np.abs(columns - at.x()).max() < 16
