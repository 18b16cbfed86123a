import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtGui import QColor, QImage, QPainter

from annotations.geometry.tool_library import shipped_tools
from annotator.slices.marks import NEAR_UM, Mark
from annotator.slices.overlays import paint_links, paint_marks, split_at_plane
from annotator.slices.projection import Plane
from annotator.slices.viewport import Area, Viewport

PLANE = Plane.across(0, (400, 200, 200), (10.0, 10.0, 10.0), 2)
VIEWPORT = Viewport.fitted(PLANE, Area(0, 0, 300, 300))
positions = st.tuples(st.floats(-3000, 7000), st.floats(0, 2000), st.floats(0, 2000))


@given(base_um=positions, tip_um=positions, index=st.integers(0, 399))
def test_the_parts_of_a_link_join_up_and_the_near_part_is_near(
    base_um: tuple[float, float, float], tip_um: tuple[float, float, float], index: int
) -> None:
    near, far = split_at_plane(VIEWPORT, index, base_um, tip_um)

    def length(first: tuple[float, float], last: tuple[float, float]) -> float:
        return float(np.hypot(last[0] - first[0], last[1] - first[1]))

    whole = length(VIEWPORT.pixel(base_um), VIEWPORT.pixel(tip_um))
    assert sum(length(*part) for part in near + far) == pytest.approx(whole, abs=1e-6)
    start, end = (PLANE.distance_um(position, index) for position in (base_um, tip_um))
    if abs(start) <= NEAR_UM and abs(end) <= NEAR_UM:
        assert far == [] or sum(length(*part) for part in far) == pytest.approx(0, abs=1e-6)
    if min(start, end) > NEAR_UM or max(start, end) < -NEAR_UM:
        assert near == []


def canvas() -> QImage:
    image = QImage(300, 300, QImage.Format.Format_RGB32)
    image.fill(QColor("black"))
    return image


def ink(image: QImage) -> int:
    return sum(QColor(image.pixel(x, y)).lightness() > 20 for x in range(300) for y in range(300))


def test_links_are_drawn_in_their_colour_between_placed_keypoints_only() -> None:
    tool = shipped_tools()["magnetic-forceps"]
    image = canvas()
    painter = QPainter(image)
    paint_links(
        painter,
        VIEWPORT,
        0,
        tool,
        {"k0": (0.0, 200.0, 1000.0), "k1": (0.0, 1800.0, 1000.0), "k2": (0.0, 1000.0, 100.0)},
    )
    painter.end()

    x, y = VIEWPORT.pixel((0.0, 1000.0, 1000.0))
    assert image.pixelColor(round(x), round(y)).name() == tool.link("link0").color
    above = VIEWPORT.pixel((0.0, 1000.0, 500.0))
    assert image.pixelColor(round(above[0]), round(above[1])) == QColor("black")


def drawn(**changes: object) -> QImage:
    values: dict[str, object] = {
        "name": "k0",
        "position_um": (0.0, 0.0, 0.0),
        "x": 150.0,
        "y": 150.0,
        "distance_um": 0.0,
        "nearness": 1.0,
        "color": "#56b4e9",
        "state": "placed",
        "unsure": False,
        "locked": False,
        "active": False,
        "preview": False,
    }
    image = canvas()
    painter = QPainter(image)
    paint_marks(painter, [Mark(**(values | changes))], names=False)  # type: ignore[arg-type]
    painter.end()
    return image


def test_on_the_plane_a_placed_keypoint_is_filled_and_an_occluded_one_hollow() -> None:
    assert drawn().pixelColor(153, 150).name() == "#56b4e9"
    assert drawn(state="occluded").pixelColor(153, 150) == QColor("black")
    assert drawn(state="occluded").pixelColor(156, 150).lightness() > 60


def test_out_of_view_is_a_square() -> None:
    corner = (154, 154)
    assert drawn(state="out_of_view").pixelColor(156, 156).lightness() > 60
    assert drawn().pixelColor(156, 156).lightness() < 20
    assert drawn(state="out_of_view").pixelColor(*corner) == QColor("black")


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({}, {"nearness": 0.5}),
        ({"nearness": 0.5}, {"nearness": 0.0}),
        ({}, {"active": True}),
        ({}, {"locked": True}),
        ({}, {"preview": True}),
        ({"active": True}, {"active": True, "preview": True}),
    ],
)
def test_every_condition_looks_different(first: dict[str, object], second: dict[str, object]) -> None:
    assert drawn(**first) != drawn(**second)


def test_a_keypoint_fades_with_its_distance() -> None:
    assert ink(drawn()) > ink(drawn(nearness=0.3)) > ink(drawn(nearness=0.0)) > 0
