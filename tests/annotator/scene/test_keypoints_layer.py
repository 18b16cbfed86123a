"""Markers differ by what they say, and names keep clear of spheres."""

from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QFont, QImage

from annotator.scene.keypoints_layer import label_place, marker_picture
from annotator.scene.picking import SPHERE_PX
from annotator.session.editing.keypoint_marks import KeypointMark

PLACED = KeypointMark(
    name="k0",
    position_um=(0.0, 0.0, 0.0),
    color="#56b4e9",
    state="placed",
    unsure=False,
    locked=False,
    active=False,
    preview=False,
)
VARIANTS = {
    "placed": PLACED,
    "occluded": replace(PLACED, state="occluded"),
    "out_of_view": replace(PLACED, state="out_of_view"),
    "unsure": replace(PLACED, unsure=True),
    "active": replace(PLACED, active=True),
    "preview": replace(PLACED, preview=True),
}


def opaque_pixels(image: QImage) -> int:
    return sum(
        image.pixelColor(x, y).alpha() > 128 for x in range(image.width()) for y in range(image.height())
    )


def test_every_kind_of_keypoint_looks_different(qapp: object) -> None:
    pictures = {name: marker_picture(mark, QFont(), 1.0) for name, mark in VARIANTS.items()}
    for first, second in combinations(pictures, 2):
        assert pictures[first] != pictures[second], (first, second)


def test_a_placed_keypoint_is_full_and_an_occluded_one_is_hollow(qapp: object) -> None:
    full, hollow = (marker_picture(VARIANTS[name], QFont(), 1.0) for name in ("placed", "occluded"))
    middle = full.rect().center()
    assert full.pixelColor(middle).alpha() == 255
    assert hollow.pixelColor(middle).alpha() < 128
    assert opaque_pixels(full) > opaque_pixels(hollow)


def test_a_finer_screen_gets_more_pixels(qapp: object) -> None:
    coarse, fine = (marker_picture(PLACED, QFont(), ratio) for ratio in (1.0, 2.0))
    assert fine.width() == 2 * coarse.width()
    assert fine.deviceIndependentSize() == coarse.deviceIndependentSize()


def sphere(x: float, y: float) -> QRectF:
    return QRectF(x - SPHERE_PX / 2, y - SPHERE_PX / 2, SPHERE_PX, SPHERE_PX)


@given(st.floats(0, 1000), st.floats(0, 1000), st.floats(5, 60), st.floats(5, 30))
def test_a_name_never_lies_on_its_own_sphere(x: float, y: float, width: float, height: float) -> None:
    own = sphere(x, y)
    assert not label_place(own, (width, height), [own]).intersects(own)


def test_a_name_evades_its_neighbours() -> None:
    own, right = sphere(100, 100), sphere(125, 100)
    taken = [own, right]
    first = label_place(own, (20, 14), taken)
    assert not any(first.intersects(other) for other in taken)
    second = label_place(own, (20, 14), [*taken, first])
    assert not second.intersects(first)


@pytest.mark.parametrize("state", ["placed", "occluded", "out_of_view"])
def test_the_marker_has_its_links_color(qapp: object, state: str) -> None:
    image = marker_picture(replace(PLACED, state=state, color="#ff0000"), QFont(), 1.0)
    colors = [image.pixelColor(x, y) for x in range(image.width()) for y in range(image.height())]
    assert any(color.alpha() > 200 and color.red() > 200 and color.green() < 80 for color in colors)
