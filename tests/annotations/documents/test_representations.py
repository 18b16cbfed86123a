import pytest

from annotations.documents.annotation import Annotation, KeypointAnnotation
from annotations.documents.edits import clear, lock, set_certainty, set_state
from annotations.documents.record import changed
from annotations.documents.representations import document_targets, keypoint_positions_um, keypoints_of
from annotations.geometry.boxes import box_keypoints_um
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification


def test_the_keypoints_of_boxes_are_the_middles_of_their_ends(
    by_boxes: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    found = keypoints_of(by_boxes, forceps)
    expected = keypoints_um(pose, forceps)
    assert [keypoint.name for keypoint in found] == list(forceps.keypoint_names)
    for keypoint in found:
        assert keypoint.position_um == pytest.approx(expected[keypoint.name], abs=1e-9)
    assert keypoint_positions_um(by_boxes, forceps) == {
        keypoint.name: keypoint.position_um for keypoint in found
    }


def test_the_keypoints_of_a_box_are_as_it_is(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    said = set_certainty(set_state(by_boxes, "link1", "occluded"), "link1", "unsure")
    said = lock(clear(said, "link2"), "link0", True)
    found = {keypoint.name: keypoint for keypoint in keypoints_of(said, forceps)}
    for name, state, certainty, locked in (
        ("k0", "placed", "sure", True),
        ("k1", "placed", "sure", True),
        ("k2", "occluded", "unsure", False),
        ("k3", "occluded", "unsure", False),
    ):
        keypoint = found[name]
        assert (keypoint.state, keypoint.certainty, keypoint.locked) == (state, certainty, locked)
        assert keypoint.source == "clicked"
    assert found["k4"] == KeypointAnnotation(name="k4")
    assert set(keypoint_positions_um(said, forceps)) == {"k0", "k1", "k2", "k3"}


def test_a_keypoint_of_two_links_is_the_first_one_s(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    fields = forceps.model_dump(mode="json")
    fields["links"][1]["base"] = "k1"
    joined = ToolSpecification.model_validate(fields)
    positions_um = box_keypoints_um(by_boxes.placed_boxes, joined)
    assert positions_um["k1"] == by_boxes.placed_boxes["link0"].tip_um
    without = clear(by_boxes, "link0")
    assert keypoint_positions_um(without, joined)["k1"] == without.placed_boxes["link1"].base_um
    states = [
        next(
            point.state
            for point in keypoints_of(set_state(by_boxes, link, "occluded"), joined)
            if point.name == "k1"
        )
        for link in ("link0", "link1")
    ]
    assert states == ["occluded", "placed"]


def test_the_keypoints_of_keypoints_are_themselves(
    by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    assert keypoints_of(by_keypoints, forceps) == by_keypoints.keypoints
    assert keypoint_positions_um(by_keypoints, forceps) == by_keypoints.positions_um


def test_targets_have_a_sign_where_boxes_give_the_hinge(
    by_boxes: Annotation, by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    from_boxes, from_keypoints = (document_targets(each, forceps) for each in (by_boxes, by_keypoints))
    assert from_boxes.signed_angles_deg == pytest.approx(pose.angles_deg, abs=1e-9)
    assert from_keypoints.signed_angles_deg == {}
    assert from_boxes.angles_deg == pytest.approx(from_keypoints.angles_deg, abs=1e-9)
    assert from_boxes.position_um == pytest.approx(from_keypoints.position_um, abs=1e-9)
    without_parent = clear(by_boxes, "link0")
    assert set(document_targets(without_parent, forceps).signed_angles_deg) == {"theta2"}


def test_unplaced_boxes_give_nothing(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    empty = changed(by_boxes, boxes=())
    assert keypoint_positions_um(empty, forceps) == {}
    assert {keypoint.state for keypoint in keypoints_of(empty, forceps)} == {"unplaced"}
    assert document_targets(empty, forceps).angles_deg == {}
