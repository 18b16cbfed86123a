"""What the slices show of boxes, of the fitted tool and of handles, in pixels of real views."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtTest import QTest

from annotations.geometry.boxes import Box
from annotator.session import Session
from annotator.session.editing.solids import Solid
from annotator.slices.outline_painting import paint_outlines
from annotator.slices.slice_view import SliceView
from annotator.slices.solid_outlines import HingeSense, SolidOutline, solid_outlines
from tests.annotator.redrawn import redrawn

Views = tuple[SliceView, SliceView, SliceView]
# Through the middles of pixels, so that a thin line is in one row of them.
SQUARE = ((100.5, 100.5), (200.5, 100.5), (200.5, 200.5), (100.5, 200.5))


def canvas(ground: str = "black") -> QImage:
    image = QImage(300, 300, QImage.Format.Format_RGB32)
    image.fill(QColor(ground))
    return image


def painted(*outlines: SolidOutline, ground: str = "black", posing: bool = False) -> QImage:
    image = canvas(ground)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    paint_outlines(painter, outlines, names=False, posing=posing)
    painter.end()
    return image


def outline(kind: str = "box", *, active: bool = False, hinge: HingeSense | None = None) -> SolidOutline:
    box = Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    solid = Solid("link0", kind, box, is_round=False, color="#56b4e9", active=active)  # type: ignore[arg-type]
    return SolidOutline(solid, SQUARE, hinge)


def lightness(image: QImage, xs: range, y: int) -> list[int]:
    return [image.pixelColor(x, y).lightness() for x in xs]


def test_a_box_has_a_firm_edge_in_the_colour_of_its_link_and_a_light_fill() -> None:
    image = painted(outline())

    assert min(lightness(image, range(110, 190), 100)) > 80
    assert 0 < image.pixelColor(150, 150).lightness() < 40
    assert image.pixelColor(150, 150).blue() > image.pixelColor(150, 150).red()
    assert image.pixelColor(250, 150) == QColor("black")


def test_the_active_box_is_bolder() -> None:
    def ink(image: QImage) -> int:
        return sum(image.pixelColor(x, y).lightness() for x in range(90, 210) for y in range(90, 210))

    assert ink(painted(outline(active=True))) > 1.3 * ink(painted(outline()))


@pytest.mark.parametrize("ground", ["black", "white"])
@pytest.mark.parametrize("kind", ["ghost", "proposal"])
def test_what_was_computed_is_dashed_and_seen_on_any_ground(kind: str, ground: str) -> None:
    image = painted(outline(kind), ground=ground)

    along = np.array(lightness(image, range(105, 195), 100))
    assert along.max() - along.min() > 50, "dashes"
    assert image.pixelColor(150, 150) == QColor(ground), "not filled"
    seen = np.abs(along - QColor(ground).lightness()) > 30
    assert seen.mean() > 0.4


def test_a_proposal_is_in_another_colour_than_the_tool() -> None:
    def colours(kind: str) -> set[str]:
        image = painted(outline(kind))
        return {image.pixelColor(x, 100).name() for x in range(105, 195)}

    assert colours("ghost") != colours("proposal")
    assert any(QColor(name).red() > QColor(name).blue() for name in colours("proposal"))
    assert not any(QColor(name).red() > QColor(name).blue() for name in colours("ghost"))


def test_the_sense_of_the_hinge_is_seen() -> None:
    def hinge(right: float, down: float, away: float) -> HingeSense:
        outer = (150.0 + 50 * right, 150.0 + 50 * down)
        return HingeSense((150.0, 150.0), outer, right, down, away)

    up = painted(outline(hinge=hinge(0.0, -1.0, 0.0)))
    down = painted(outline(hinge=hinge(0.0, 1.0, 0.0)))
    towards = painted(outline(hinge=hinge(0.0, 0.0, -1.0)))
    away = painted(outline(hinge=hinge(0.0, 0.0, 1.0)))

    assert up.pixelColor(150, 92).lightness() > 80
    assert down.pixelColor(150, 208).lightness() > 80
    assert up.pixelColor(150, 208) == QColor("black")
    assert towards != away
    assert towards.pixelColor(150, 150).lightness() > 80, "the point of an arrow"
    assert painted(outline()) not in (up, down, towards, away)


# Of real views


def grabbed(view: SliceView) -> NDArray[np.int64]:
    """Return the pixels of a view, shape (rows, columns, 3)."""
    image = redrawn(view).grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4)
    return rows[:, :, 2::-1].astype(np.int64)


def difference(first: NDArray[np.int64], second: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.abs(first - second).sum(axis=2)


def test_a_box_is_drawn_where_the_slice_cuts_it_and_not_elsewhere(
    boxed: Session, roomy_views: Views, hand: Any
) -> None:
    boxed.set_mode("navigate")
    boxed.look(layers=frozenset())
    view = roomy_views[2]
    box = boxed.document.placed_boxes["link2"]  # type: ignore[union-attr]
    boxed.look(crosshair_um=box.center_um)
    at = hand.pixel(view, box.position_um((0.3, 0.15, 0.0)))

    def is_seen() -> bool:
        filled = grabbed(view)[at.y() - 4 : at.y() + 5, at.x() - 4 : at.x() + 5]
        boxed.look(overlays_hidden=True)
        bare = grabbed(view)[at.y() - 4 : at.y() + 5, at.x() - 4 : at.x() + 5]
        boxed.look(overlays_hidden=False)
        return bool(difference(filled, bare).any())

    assert is_seen()
    boxed.look(crosshair_um=(box.center_um[0], box.center_um[1], 9500.0))
    assert not is_seen()


def test_the_outline_of_the_fitted_tool_follows_a_keypoint_that_is_dragged(
    placed_tool: Session, roomy_views: Views, hand: Any
) -> None:
    placed_tool.set_mode("place")
    view = roomy_views[2]
    k5_um = placed_tool.shown_positions_um()["k5"]
    placed_tool.look(crosshair_um=k5_um, layers=frozenset({"ghost"}))
    start = hand.pixel(view, k5_um)

    def points() -> dict[str, tuple[tuple[float, float], ...]]:
        assert view.viewport is not None
        cut = solid_outlines(view.solids, view.viewport, view.index)
        return {each.solid.link: each.points for each in cut if each.solid.kind == "ghost"}

    before, picture = points(), grabbed(view)
    hand.drag(view, start, start + QPoint(12, 2), start + QPoint(25, 5), release=False)

    assert placed_tool.view.preview is not None
    assert np.mean(points()["link2"], axis=0)[0] > np.mean(before["link2"], axis=0)[0] + 4
    assert difference(grabbed(view), picture).any()
    placed_tool.drop_preview()
    assert points() == before


def test_without_its_layer_the_fitted_tool_is_shown_only_in_pose_mode(
    placed_tool: Session, roomy_views: Views
) -> None:
    placed_tool.look(layers=placed_tool.view.layers - {"ghost"})
    assert roomy_views[0].solids == ()

    placed_tool.set_mode("pose")

    assert {solid.kind for solid in roomy_views[0].solids} == {"ghost"}
    placed_tool.look(overlays_hidden=True)
    assert roomy_views[0].solids == ()


def test_handles_are_drawn_in_pose_mode_and_light_up_under_the_mouse(
    placed_tool: Session, roomy_views: Views, hand: Any
) -> None:
    placed_tool.set_mode("pose")
    view = roomy_views[2]
    at = hand.handle(placed_tool, view, "move:link0")
    hand.move(view, QPoint(20, 280))
    near = np.s_[at.y() - 9 : at.y() + 10, at.x() - 9 : at.x() + 10]
    resting = grabbed(view)[near]

    hand.move(view, at)
    lit = grabbed(view)[near]
    hand.drag(view, at, at + QPoint(6, 0), release=False)
    held = grabbed(view)[np.s_[at.y() - 9 : at.y() + 10, at.x() - 3 : at.x() + 16]]

    assert difference(lit, resting).any()
    orange = np.array(QColor("#ffab5e").getRgb()[:3])
    assert (np.abs(held - orange).sum(axis=2) < 30).sum() > 20
    assert not (np.abs(resting - orange).sum(axis=2) < 30).any()
    placed_tool.drop_preview()
    QTest.mouseRelease(view, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)


def test_the_border_says_that_the_mouse_changes_something(placed_tool: Session, roomy_views: Views) -> None:
    def border() -> str:
        return roomy_views[0].grab().toImage().pixelColor(1, 150).name()

    navigating = border()
    placed_tool.set_mode("place")
    placing = border()
    placed_tool.set_mode("pose")

    assert placing == "#ffab5e"
    assert border() == placing
    assert navigating != placing
