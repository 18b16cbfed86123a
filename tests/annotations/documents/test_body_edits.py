"""Edits of boxes, and of the tool as one body."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from annotations.documents.annotation import Annotation, BoxAnnotation, State, with_all_parts
from annotations.documents.edits import (
    EditRefused,
    clear,
    fill_in,
    lock,
    place_box,
    place_keypoint,
    pose_tool,
    refine,
    set_certainty,
    set_state,
)
from annotations.documents.record import Method, changed
from annotations.documents.representations import document_targets
from annotations.geometry.boxes import Box
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification

HERE_UM = (100.0, 200.0, 300.0)
THERE_UM = (-50.0, 0.0, 1e7)
BOX = Box((100.0, 200.0, 300.0), (5000.0, 4000.0, 4000.0), (0.6, 0.0, 0.8, 0.0))


def test_boxes_are_placed_in_documents_of_boxes_alone(document: Annotation, by_boxes: Annotation) -> None:
    with pytest.raises(EditRefused, match="k2 is a keypoint in this document, not a box"):
        place_box(document, "k2", BOX, "clicked")
    with pytest.raises(EditRefused, match="link1 is a box in this document, not a keypoint"):
        place_keypoint(by_boxes, "link1", HERE_UM, "clicked")
    with pytest.raises(EditRefused, match="no box 'link9'; the document has link0, link1, link2"):
        place_box(by_boxes, "link9", BOX, "clicked")


def test_placing_a_box_keeps_what_was_said_about_it(by_boxes: Annotation) -> None:
    said = set_certainty(set_state(by_boxes, "link1", "occluded"), "link1", "unsure")
    assert place_box(said, "link1", BOX, "dragged").part("link1") == BoxAnnotation(
        link="link1",
        state="occluded",
        certainty="unsure",
        center_um=BOX.center_um,
        size_um=BOX.size_um,
        rotation_wxyz=BOX.rotation_wxyz,
        source="dragged",
    )
    fresh = clear(said, "link1")
    assert fresh.part("link1") == BoxAnnotation(link="link1")
    assert place_box(fresh, "link1", BOX, "clicked").part("link1").state == "placed"


@pytest.mark.parametrize(
    "edit",
    [
        partial(place_box, link="link1", box=BOX, source="clicked"),
        partial(set_state, name="link1", state="occluded"),
        partial(set_certainty, name="link1", certainty="unsure"),
        partial(clear, name="link1"),
    ],
)
def test_a_locked_box_refuses_every_change(
    by_boxes: Annotation, edit: Callable[[Annotation], Annotation]
) -> None:
    locked = lock(by_boxes, "link1", True)
    with pytest.raises(EditRefused, match=r"The box of link1 is locked\. Unlock it to change it"):
        edit(locked)
    assert edit(lock(locked, "link1", False)) != by_boxes


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_a_pose_puts_every_part_where_the_tool_has_it(
    document: Annotation, forceps: ToolSpecification, pose: ToolPose, method: Method
) -> None:
    fresh = with_all_parts(changed(document, method=method), forceps)
    posed = pose_tool(fresh, forceps, pose)
    assert {(part.state, part.source) for part in posed.parts} == {("placed", "posed")}
    found = document_targets(posed, forceps)
    assert found.position_um == pytest.approx(pose.position_um, abs=1e-9)
    assert found.angles_deg == pytest.approx({"theta1": 30.0, "theta2": 40.0}, abs=1e-9)
    assert pose_tool(posed, forceps, pose) is posed


def test_a_pose_keeps_what_was_said_and_says_of_each_part_whether_it_is_in_view(
    by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    said = set_certainty(set_state(by_keypoints, "k1", "occluded"), "k1", "unsure")
    said = clear(said, "k5")
    posed = pose_tool(said, forceps, replace(pose, position_um=(7000.0, 100.0, 6000.0)))
    outside = {name for name, position_um in posed.positions_um.items() if position_um[1] < 0}
    assert 0 < len(outside) < 5
    expected = {name: "out_of_view" if name in outside else "placed" for name in posed.positions_um}
    if "k1" not in outside:
        expected["k1"] = "occluded"
    assert {part.name: part.state for part in posed.parts} == expected
    assert {part.source for part in posed.parts} == {"posed"}
    assert posed.keypoint("k1").certainty == "unsure"


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
@pytest.mark.parametrize("move", [pose_tool, refine])
def test_what_comes_back_into_view_is_placed(
    by_keypoints: Annotation,
    by_boxes: Annotation,
    forceps: ToolSpecification,
    pose: ToolPose,
    method: Method,
    move: Callable[[Annotation, ToolSpecification, ToolPose], Annotation],
) -> None:
    document = by_keypoints if method == "keypoints" else by_boxes
    name = document.parts[1].name
    document = set_state(document, name, "occluded")
    assert move(document, forceps, pose).part(name).state == "occluded"
    gone = move(document, forceps, replace(pose, position_um=(7000.0, 60_000.0, 6000.0)))
    assert {part.state for part in gone.parts} == {"out_of_view"}
    assert {part.state for part in move(gone, forceps, pose).parts} == {"placed"}


@pytest.mark.parametrize("state", ["placed", "occluded", "out_of_view"])
@pytest.mark.parametrize("move", [pose_tool, refine])
def test_of_a_box_that_is_moved_partly_out_of_view_stays_what_was_said(
    by_boxes: Annotation,
    forceps: ToolSpecification,
    pose: ToolPose,
    state: State,
    move: Callable[[Annotation, ToolSpecification, ToolPose], Annotation],
) -> None:
    x_um, y_um, z_um = pose.position_um
    to_edge = (x_um, y_um - by_boxes.placed_boxes["link0"].base_um[1] - 500.0, z_um)
    moved = move(set_state(by_boxes, "link0", state), forceps, replace(pose, position_um=to_edge))
    box = moved.placed_boxes["link0"]
    assert [moved.volume.contains(end_um) for end_um in (box.base_um, box.tip_um)] == [False, True]
    assert moved.part("link0").state == state


def test_what_was_filled_in_is_not_seen_because_it_was_moved(
    by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    said = fill_in(clear(clear(by_keypoints, "k4"), "k5"), {"k4": HERE_UM, "k5": THERE_UM})
    assert [said.keypoint(name).state for name in ("k4", "k5")] == ["occluded", "out_of_view"]
    gone = replace(pose, position_um=(7000.0, 60_000.0, 6000.0))
    for move, source in ((pose_tool, "posed"), (refine, "fitted")):
        for to, state in ((pose, "occluded"), (gone, "out_of_view")):
            moved = move(said, forceps, to)
            for name in ("k4", "k5"):
                assert (moved.keypoint(name).state, moved.keypoint(name).source) == (state, source)
    posed = pose_tool(said, forceps, pose)
    assert pose_tool(posed, forceps, pose) is posed


def test_a_pose_keeps_the_cross_section_that_a_person_measured(
    by_boxes: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    box = by_boxes.placed_boxes["link1"]
    measured = place_box(by_boxes, "link1", replace(box, size_um=(4800.0, 3900.0, 3800.0)), "dragged")
    posed = pose_tool(measured, forceps, pose)
    assert posed.placed_boxes["link1"].size_um == (5000.0, 3900.0, 3800.0)
    refined = refine(measured, forceps, pose)
    assert refined.placed_boxes["link1"].size_um == (4800.0, 3900.0, 3800.0)


def test_a_pose_is_refused_where_a_part_is_locked(
    by_boxes: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    locked = lock(by_boxes, "link2", True)
    with pytest.raises(EditRefused, match=r"link2 is locked\. Unlock"):
        pose_tool(locked, forceps, pose)
    with pytest.raises(EditRefused, match="link0, link2 are locked"):
        pose_tool(lock(locked, "link0", True), forceps, pose)


def test_what_is_filled_in_is_never_placed(document: Annotation) -> None:
    clicked = lock(place_keypoint(document, "k0", HERE_UM, "clicked"), "k3", True)
    filled = fill_in(clicked, {"k0": THERE_UM, "k1": HERE_UM, "k2": THERE_UM, "k3": HERE_UM})
    assert [keypoint.state for keypoint in filled.keypoints] == [
        "placed",
        "occluded",
        "out_of_view",
        "unplaced",
        "unplaced",
        "unplaced",
    ]
    assert filled.keypoint("k0") == clicked.keypoint("k0")
    assert {filled.keypoint(name).source for name in ("k1", "k2")} == {"fitted"}
    # A new fit moves what an old one filled in, and says anew whether it is in view.
    again = fill_in(filled, {"k1": THERE_UM, "k2": HERE_UM})
    assert [again.keypoint(name).state for name in ("k1", "k2")] == ["out_of_view", "occluded"]


def test_what_is_filled_in_is_placed_by_a_person_alone(document: Annotation) -> None:
    filled = fill_in(document, {"k1": HERE_UM})
    with pytest.raises(EditRefused, match="Keypoint k1 was filled in from the fit, and nobody has seen it"):
        set_state(filled, "k1", "placed")
    assert set_state(filled, "k1", "out_of_view").keypoint("k1").source == "fitted"
    assert place_keypoint(filled, "k1", HERE_UM, "dragged").keypoint("k1").state == "placed"


def test_refining_moves_what_is_placed_and_not_locked(
    by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    said = set_state(lock(clear(by_keypoints, "k5"), "k0", True), "k3", "occluded")
    moved = replace(pose, position_um=(7010.0, 8000.0, 6000.0))
    refined = refine(said, forceps, moved)
    assert (refined.keypoint("k0"), refined.keypoint("k5")) == (said.keypoint("k0"), said.keypoint("k5"))
    for name in ("k1", "k2", "k3", "k4"):
        after = refined.keypoint(name)
        assert (after.state, after.source) == (said.keypoint(name).state, "refined")
        assert after.position_um == keypoints_um(moved, forceps)[name]


def test_refining_makes_no_observation_of_what_was_filled_in(
    by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    filled = fill_in(clear(by_keypoints, "k5"), {"k5": HERE_UM})
    after = refine(filled, forceps, pose).keypoint("k5")
    assert (after.state, after.source) == ("occluded", "fitted")
    assert after.position_um == keypoints_um(pose, forceps)["k5"]


def test_a_fitted_box_is_placed_once_a_person_places_it(by_boxes: Annotation) -> None:
    part = changed(by_boxes.part("link1"), state="occluded", source="fitted")
    fitted = changed(by_boxes, boxes=(by_boxes.boxes[0], part, by_boxes.boxes[2]))
    with pytest.raises(EditRefused, match="The box of link1 was filled in from the fit"):
        set_state(fitted, "link1", "placed")
    assert place_box(fitted, "link1", BOX, "dragged").part("link1").state == "placed"
