"""Boxes, ghost and proposal on the picture: told apart, in their links' colours, gone when not wanted."""

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QApplication

from annotations.fitting.refine import Refinement
from annotations.geometry.boxes import Box
from annotator.scene.camera import preset
from annotator.scene.segments import Segments
from annotator.scene.solids_layer import SolidsLayer
from annotator.session.editing.solids import Solid

BOX = Box((8000.0, 12_000.0, 5000.0), (9000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
SOLID = Solid("link0", "box", BOX, is_round=False, color="#56b4e9")
CAMERA = preset("home", (0, 0, 0), (17_400, 26_100, 10_800), 2, 1.4)
# Links and spheres would cover what is looked for.
BARE = frozenset({"volume", "ghost"})


def near_color(pixels: np.ndarray, at: QPoint, color: QColor, reach: int = 2) -> bool:
    area = pixels[at.y() - reach : at.y() + reach + 1, at.x() - reach : at.x() + reach + 1]
    wanted = np.array((color.red(), color.green(), color.blue()))
    return bool((np.abs(area - wanted).max(axis=-1) <= 40).any())


def edge_middles_um(box: Box) -> list:
    sides = [(0.0, y, z) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    return [box.position_um(share) for share in sides]


def test_a_box_is_drawn_in_its_links_color_with_all_its_edges(boxed) -> None:
    boxed.session.look(layers=frozenset({"volume"}), active_part=None)
    pixels = boxed.pixels()
    for link in boxed.session.tool.links:
        box = boxed.session.document.placed_boxes[link.name]
        for middle_um in edge_middles_um(box):
            assert near_color(pixels, boxed.place_of(middle_um), QColor(link.color)), link.name


def test_the_surface_of_a_box_tints_what_is_behind_it(boxed) -> None:
    session = boxed.session
    session.look(layers=frozenset(), active_part=None)
    with_boxes = boxed.pixels()
    at = boxed.place_of(session.document.placed_boxes["link0"].position_um((0.2, 0.2, 0.5)))
    session.look(overlays_hidden=True)
    bare = boxed.pixels()
    tint = (with_boxes - bare)[at.y() - 2 : at.y() + 3, at.x() - 2 : at.x() + 3].reshape(-1, 3)
    tint = np.median(tint, axis=0)
    # Sky blue, faintly: the volume is seen through it.
    assert tint[2] > tint[0]
    assert 10 < tint[2] < 120


def test_the_active_box_has_brighter_edges(boxed) -> None:
    session = boxed.session
    session.look(layers=frozenset({"volume"}), mode="navigate")
    middle_um = edge_middles_um(session.document.placed_boxes["link0"])[0]
    lighter = QColor(session.tool.link("link0").color).lighter(135)
    assert near_color(boxed.pixels(), boxed.place_of(middle_um), lighter)
    session.activate("link1")
    assert not near_color(boxed.pixels(), boxed.place_of(middle_um), lighter)


def test_the_ghost_comes_with_a_fit_and_follows_a_dragged_keypoint(posed) -> None:
    session = posed.session
    session.look(layers=BARE)
    before = posed.pixels()
    draws = posed.view.volume_draws
    outline_um = tuple(np.add(session.document.positions_um["k4"], (0.0, 0.0, 1000.0)))
    at = posed.place_of(outline_um)
    session.toggle_layer("ghost")
    without = posed.pixels()
    assert not np.array_equal(before, without)
    session.toggle_layer("ghost")
    assert np.array_equal(posed.pixels(), before)
    k5_um = session.document.positions_um["k5"]
    session.begin_preview("k5", tuple(np.add(k5_um, (3000.0, -1000.0, 0.0))), "dragged")
    changed = np.abs(posed.pixels() - before).max(axis=2) > 8
    # All of link 2 has turned, not only the place of its tip.
    assert changed[at.y() - 20 : at.y() + 20, at.x() - 20 : at.x() + 20].sum() > 20
    assert posed.view.volume_draws == draws


def test_a_ghost_needs_something_to_be_fitted_to(roomy) -> None:
    roomy.session.look(layers=BARE)
    with_layer = roomy.pixels()
    roomy.session.toggle_layer("ghost")
    assert np.array_equal(roomy.pixels(), with_layer)


def test_a_proposal_is_outlined_beside_the_ghost(posed) -> None:
    session = posed.session
    session.look(layers=BARE, active_part=None)
    before = posed.pixels()
    pose = session.settled_pose
    elsewhere = replace(pose, position_um=tuple(np.add(pose.position_um, (2500.0, 0.0, 0.0))))
    session.look(refinement=Refinement(elsewhere, {}, {}, 0.0, 0.0, ""))
    proposed = posed.pixels()
    white = (proposed.min(axis=2) > 235) & (before.min(axis=2) < 200)
    assert white.sum() > 100
    session.reject_refinement()
    assert np.array_equal(posed.pixels(), before)


EDITS = {
    "drag": lambda session: session.drag_handle("center", (8500.0, 8200.0, 7000.0)),
    "tip": lambda session: session.drag_handle("tip", (9500.0, 13_000.0, 7000.0)),
    "ghost": lambda session: session.toggle_layer("ghost"),
    "active": lambda session: session.activate("link2"),
    "unsure": lambda session: session.set_certainty("link1", "unsure"),
    "clear": lambda session: session.clear("link2"),
    "undo": lambda session: session.undo_stack.undo(),
    "pose mode": lambda session: session.set_mode("pose"),
    "free": lambda session: session.free_cross_section("link0", True),
}


@pytest.mark.parametrize("name", EDITS)
def test_bodies_and_handles_change_over_the_kept_volume(boxed, name: str) -> None:
    before = boxed.pixels()
    draws = boxed.view.volume_draws
    EDITS[name](boxed.session)
    QApplication.processEvents()
    after = boxed.pixels()
    assert boxed.view.volume_draws == draws
    assert not np.array_equal(after, before)


# Without a window


def segments_of(monkeypatch: pytest.MonkeyPatch, solid: Solid) -> list:
    shown: list = []
    monkeypatch.setattr(Segments, "show", lambda _self, segments, _ratio: shown.extend(segments))
    SolidsLayer().show([solid], CAMERA, 1.0)
    return shown


def test_marks_stand_on_the_side_of_own_y_and_point_to_the_tip(monkeypatch) -> None:
    ends = np.array(
        [end for segment in segments_of(monkeypatch, SOLID) for end in (segment.first_um, segment.second_um)]
    )
    local = (ends - BOX.center_um) @ BOX.axes / BOX.size_um
    off_box = local[np.abs(local).max(axis=1) > 0.5 + 1e-9]
    assert len(off_box) > 0
    assert (off_box[:, 1] > 0.5).all()
    on_face = local[(np.abs(local[:, 1] - 0.5) < 1e-9) & (np.abs(local[:, [0, 2]]) < 0.49).all(axis=1)]
    tip = on_face[np.argmax(on_face[:, 0])]
    assert tip[0] > 0.4
    assert tip[2] == pytest.approx(0)


def test_an_unsure_box_is_dashed_from_corner_to_corner(monkeypatch) -> None:
    sure, unsure = (segments_of(monkeypatch, each) for each in (SOLID, replace(SOLID, unsure=True)))
    assert len(unsure) > len(sure) + 12

    def corners(segments: list) -> set:
        ends = {end for segment in segments for end in (segment.first_um, segment.second_um)}
        return {
            end for end in ends if np.allclose(np.abs(np.subtract(end, BOX.center_um)) / BOX.size_um, 0.5)
        }

    assert len(corners(sure)) == len(corners(unsure)) == 8


def test_what_is_drawn_already_is_left_alone() -> None:
    layer = SolidsLayer()
    layer.show([SOLID], CAMERA, 1.0)
    before = [actor.GetMapper().GetInput().GetMTime() for actor in layer.actors]
    layer.show([replace(SOLID)], replace(CAMERA), 1.0)
    assert [actor.GetMapper().GetInput().GetMTime() for actor in layer.actors] == before
    layer.show([replace(SOLID, active=True)], CAMERA, 1.0)
    assert [actor.GetMapper().GetInput().GetMTime() for actor in layer.actors] != before


def test_surfaces_are_drawn_from_the_farthest_to_the_nearest() -> None:
    behind = replace(
        SOLID, box=replace(BOX, center_um=tuple(np.add(BOX.center_um, 6000.0 * np.array(CAMERA.forward))))
    )
    layer = SolidsLayer()
    layer.show([SOLID, replace(behind, color="#e69f00")], CAMERA, 1.0)
    colors = layer.actors[-1].GetMapper().GetInput().GetPointData().GetScalars()
    last = colors.GetTuple(colors.GetNumberOfTuples() - 1)
    first = colors.GetTuple(0)
    assert first[0] > first[2]
    assert last[2] > last[0]
