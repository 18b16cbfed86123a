from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.annotation import Annotation, Certainty, State, with_all_parts
from annotations.documents.checks import check_annotation
from annotations.documents.conversion import (
    ConversionRefused,
    keypoints_without_box,
    sibling_path,
    to_boxes,
    to_keypoints,
)
from annotations.documents.edits import (
    clear,
    fill_in,
    lock,
    place_box,
    place_keypoint,
    set_certainty,
    set_state,
    set_status,
)
from annotations.documents.files import annotation_bytes, load_annotation, parse_annotation, save_annotation
from annotations.documents.provenance import Derivation, PredictionOrigin
from annotations.documents.record import changed
from annotations.documents.representations import document_targets
from annotations.fitting.evidence import document_points
from annotations.geometry.box_conversion import RollUnknown
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.rotations import yaw_pitch_roll_deg
from annotations.geometry.tool import ToolSpecification

ORIGINAL = Path("study/annotations/anna/v001.keypoints.json")
DERIVED = Path("study/annotations/anna/v001.boxes.json")


def boxes_of(document: Annotation, tool: ToolSpecification, roll_deg: float | None = None) -> Annotation:
    return to_boxes(document, tool, original=ORIGINAL, derived=DERIVED, roll_deg=roll_deg)


def keypoints_from(document: Annotation, tool: ToolSpecification) -> Annotation:
    return to_keypoints(document, tool, original=DERIVED, derived=ORIGINAL)


def test_keypoints_come_back_from_their_boxes(by_keypoints: Annotation, forceps: ToolSpecification) -> None:
    back = keypoints_from(boxes_of(by_keypoints, forceps), forceps)
    for name, position_um in by_keypoints.positions_um.items():
        np.testing.assert_allclose(back.positions_um[name], position_um, rtol=0, atol=1e-9)


def test_boxes_come_back_from_their_keypoints(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    roll_deg = yaw_pitch_roll_deg(by_boxes.placed_boxes["link0"].rotation_wxyz)[2]
    for given_deg in (None, roll_deg):
        back = boxes_of(keypoints_from(by_boxes, forceps), forceps, given_deg)
        for link, box in by_boxes.placed_boxes.items():
            np.testing.assert_allclose(back.placed_boxes[link].center_um, box.center_um, rtol=0, atol=1e-9)
            np.testing.assert_allclose(back.placed_boxes[link].size_um, box.size_um, rtol=0, atol=1e-9)
            np.testing.assert_allclose(back.placed_boxes[link].axes, box.axes, rtol=0, atol=1e-9)


def test_boxes_around_predicted_keypoints_say_where_these_came_from(
    by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    origin = PredictionOrigin(path="../../predictions/Lean/v001.json", checkpoint="Lean", sha256="0" * 64)
    begun = changed(by_keypoints, predicted_from=origin)
    elsewhere = Path("study/annotations/anna/boxes/v001.boxes.json")

    beside = boxes_of(begun, forceps)
    below = to_boxes(begun, forceps, original=ORIGINAL, derived=elsewhere)

    assert beside.predicted_from == origin
    assert below.predicted_from == changed(origin, path="../../../predictions/Lean/v001.json")
    assert keypoints_from(beside, forceps).predicted_from == origin
    assert boxes_of(by_keypoints, forceps).predicted_from is None


def test_a_conversion_leaves_the_targets_as_they_are(
    by_keypoints: Annotation, forceps: ToolSpecification, pose: ToolPose
) -> None:
    before = document_targets(by_keypoints, forceps)
    after = document_targets(boxes_of(by_keypoints, forceps), forceps)
    assert after.position_um == pytest.approx(before.position_um, abs=1e-9)
    assert after.orientation == pytest.approx(before.orientation, abs=1e-12)
    assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-9)
    assert after.signed_angles_deg == pytest.approx(pose.angles_deg, abs=1e-9)


def test_a_derived_document_is_a_new_one_of_the_same_person(
    by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    worked = changed(set_status(by_keypoints, "done"), active_seconds=80.0)
    derived = boxes_of(lock(worked, "k0", True), forceps)
    assert derived.method == "boxes"
    assert derived.keypoints == ()
    assert (derived.annotator, derived.tool) == (worked.annotator, worked.tool)
    assert derived.tool_fingerprint == forceps.fingerprint
    assert (derived.status, derived.active_seconds) == ("in_progress", 0.0)
    assert derived.created == derived.modified
    assert derived.created > worked.created
    assert {(part.source, part.locked) for part in derived.parts} == {("derived", False)}
    assert derived.derived_from == Derivation(path="v001.keypoints.json", method="keypoints")
    assert derived.volume == worked.volume


def test_a_roll_that_a_person_said_is_kept(by_keypoints: Annotation, forceps: ToolSpecification) -> None:
    derived = boxes_of(by_keypoints, forceps, 37.2)
    assert derived.derived_from is not None
    assert derived.derived_from.roll_deg == 37.2
    assert yaw_pitch_roll_deg(derived.placed_boxes["link0"].rotation_wxyz)[2] == pytest.approx(37.2)


def test_paths_are_seen_from_the_new_document(
    by_keypoints: Annotation, forceps: ToolSpecification, tmp_path: Path
) -> None:
    original = tmp_path / "study" / "annotations" / "anna" / "v001.keypoints.json"
    elsewhere = tmp_path / "boxes" / "v001.json"
    named = changed(by_keypoints, volume=changed(by_keypoints.volume, path="../../volumes/v001.npy"))
    derived = to_boxes(named, forceps, original=original, derived=elsewhere)
    assert derived.volume.path == "../study/volumes/v001.npy"
    assert derived.derived_from is not None
    assert derived.derived_from.path == "../study/annotations/anna/v001.keypoints.json"


@pytest.mark.parametrize(
    ("base", "tip", "expected"),
    [
        (("placed", "sure"), ("placed", "sure"), ("placed", "sure")),
        (("placed", "unsure"), ("occluded", "sure"), ("occluded", "unsure")),
        (("occluded", "sure"), ("out_of_view", "sure"), ("out_of_view", "sure")),
        (("out_of_view", "sure"), ("placed", "unsure"), ("out_of_view", "unsure")),
    ],
)
def test_a_box_was_seen_as_well_as_the_worse_of_its_keypoints(
    by_keypoints: Annotation,
    forceps: ToolSpecification,
    base: tuple[State, Certainty],
    tip: tuple[State, Certainty],
    expected: tuple[State, Certainty],
) -> None:
    said = by_keypoints
    for name, (state, certainty) in (("k2", base), ("k3", tip)):
        said = set_certainty(set_state(said, name, state), name, certainty)
    part = boxes_of(said, forceps).part("link1")
    assert (part.state, part.certainty) == expected
    assert boxes_of(said, forceps).part("link0").state == "placed"


def test_keypoints_are_as_their_box(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    said = lock(set_certainty(set_state(by_boxes, "link1", "occluded"), "link1", "unsure"), "link0", True)
    derived = keypoints_from(clear(said, "link2"), forceps)
    assert [keypoint.state for keypoint in derived.keypoints] == [
        "placed",
        "placed",
        "occluded",
        "occluded",
        "unplaced",
        "unplaced",
    ]
    assert [keypoint.certainty for keypoint in derived.keypoints[2:4]] == ["unsure", "unsure"]
    assert [keypoint.source for keypoint in derived.keypoints] == ["derived"] * 4 + [None, None]
    assert not any(keypoint.locked for keypoint in derived.keypoints)
    assert derived.derived_from == Derivation(path="v001.boxes.json", method="boxes")


def test_what_nobody_has_seen_is_not_placed_in_the_other_method_either(
    by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    filled = fill_in(clear(by_keypoints, "k5"), {"k5": by_keypoints.positions_um["k5"]})
    derived = boxes_of(filled, forceps)
    assert (derived.part("link2").state, derived.part("link2").source) == ("occluded", "fitted")
    assert derived.part("link1").source == "derived"
    assert [point.link for point in document_points(derived, forceps)] == ["link0"] * 3 + ["link1"] * 3
    back = keypoints_from(derived, forceps)
    assert [keypoint.source for keypoint in back.keypoints] == ["derived"] * 4 + ["fitted"] * 2


def test_the_ends_of_a_box_that_is_partly_in_view_are_seen_as_they_lie(
    by_boxes: Annotation, forceps: ToolSpecification
) -> None:
    box = by_boxes.placed_boxes["link2"]
    partly = place_box(by_boxes, "link2", replace(box, center_um=(0.0, 8000.0, 6000.0)), "dragged")
    ends = [partly.placed_boxes["link2"].base_um, partly.placed_boxes["link2"].tip_um]
    inside = [end_um[0] >= 0 for end_um in ends]
    assert sorted(inside) == [False, True]
    for state, seen in (("placed", "placed"), ("occluded", "occluded"), ("out_of_view", "occluded")):
        derived = keypoints_from(set_state(partly, "link2", state), forceps)
        expected = [seen if is_in else "out_of_view" for is_in in inside]
        assert [derived.part(name).state for name in ("k4", "k5")] == expected
        assert [finding for finding in check_annotation(derived, forceps) if finding.kind != "link"] == []


def test_a_keypoint_without_the_other_end_is_told(
    by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    partly = clear(by_keypoints, "k2")
    derived = boxes_of(partly, forceps, 10.0)
    assert [part.state for part in derived.boxes] == ["placed", "unplaced", "placed"]
    assert keypoints_without_box(partly, derived, forceps) == ["k3"]
    assert keypoints_without_box(by_keypoints, boxes_of(by_keypoints, forceps), forceps) == []


def test_a_document_of_the_same_method_is_refused(
    by_keypoints: Annotation, by_boxes: Annotation, forceps: ToolSpecification
) -> None:
    with pytest.raises(ConversionRefused, match="a document of keypoints already"):
        to_keypoints(by_keypoints, forceps, original=ORIGINAL, derived=DERIVED)
    with pytest.raises(ConversionRefused, match="a document of boxes already"):
        boxes_of(by_boxes, forceps)


def test_no_roll_is_invented(by_keypoints: Annotation, forceps: ToolSpecification) -> None:
    for name in ("k2", "k3", "k4", "k5"):
        by_keypoints = clear(by_keypoints, name)
    with pytest.raises(RollUnknown):
        boxes_of(by_keypoints, forceps)


def test_of_nothing_nothing_follows(
    document: Annotation, by_keypoints: Annotation, by_boxes: Annotation, forceps: ToolSpecification
) -> None:
    apart = clear(clear(clear(by_keypoints, "k0"), "k3"), "k4")
    for nothing in (document, apart):
        with pytest.raises(ConversionRefused, match="no boxes follow"):
            boxes_of(nothing, forceps, 10.0)
    with pytest.raises(ConversionRefused, match="no keypoints follow"):
        keypoints_from(changed(by_boxes, boxes=()), forceps)


def test_a_tool_that_does_not_ship_travels_on(document: Annotation, probe: ToolSpecification) -> None:
    bare = changed(document, tool="probe", tool_fingerprint=probe.fingerprint, tool_copy=probe, keypoints=())
    own = with_all_parts(bare, probe)
    for name in probe.keypoint_names:
        own = place_keypoint(own, name, (100.0 * len(name), 0.0, 0.0), "clicked")
    assert boxes_of(own, probe, 0.0).tool_copy == probe


def test_a_derived_document_survives_its_file(
    by_keypoints: Annotation, forceps: ToolSpecification, tmp_path: Path
) -> None:
    derived = boxes_of(by_keypoints, forceps, -142.8)
    saved, _ = save_annotation(derived, tmp_path / "v001.boxes.json", expected="")
    assert load_annotation(tmp_path / "v001.boxes.json")[0] == saved
    assert saved.boxes == derived.boxes
    assert saved.derived_from == derived.derived_from
    # Reading and writing again changes nothing, rounding included.
    assert annotation_bytes(parse_annotation(annotation_bytes(saved), "x")) == annotation_bytes(saved)


@pytest.mark.parametrize(
    ("name", "sibling"),
    [
        ("v001.keypoints.json", "v001.boxes.json"),
        ("v001.boxes.json", "v001.boxes.json"),
        ("v.1.json", "v.1.boxes.json"),
        ("scan", "scan.boxes.json"),
    ],
)
def test_the_other_method_is_kept_beside_the_one(name: str, sibling: str) -> None:
    assert sibling_path(Path("anna") / name, "boxes") == Path("anna") / sibling
