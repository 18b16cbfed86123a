import json
import math
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from pydantic import ValidationError

from annotations import __version__
from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    KeypointAnnotation,
    VolumeReference,
    new_annotation,
    without_stamps,
)
from annotations.documents.provenance import Derivation
from annotations.documents.record import Method, changed
from annotations.geometry.tool import ToolSpecification

PLACED: dict[str, Any] = {
    "name": "k0",
    "state": "placed",
    "position_um": (1.0, 2.0, 3.0),
    "source": "clicked",
}
BOX: dict[str, Any] = {
    "link": "link0",
    "state": "placed",
    "center_um": (1.0, 2.0, 3.0),
    "size_um": (10.0, 4.0, 4.0),
    "rotation_wxyz": (1.0, 0.0, 0.0, 0.0),
    "source": "dragged",
}
VOLUME: dict[str, Any] = {
    "path": "v.npy",
    "shape": (4, 5, 6),
    "dtype": "uint8",
    "spacing_um": (15.9, 13.5, 9.4),
    "fingerprint": "…",
}


@pytest.mark.parametrize(
    "wrong",
    [
        {"state": "unplaced"},
        {"state": "unplaced", "source": None},
        {"state": "unplaced", "position_um": None},
        {"position_um": None, "source": None},
        {"position_um": None},
        {"source": None},
        {"position_um": (1.0, 2.0)},
        {"position_um": (1.0, 2.0, 3.0, 4.0)},
        {"position_um": (1.0, 2.0, math.nan)},
        {"position_um": (1.0, math.inf, 3.0)},
        {"position_um": (-math.inf, 2.0, 3.0)},
        {"position_um": (1.0, 2.0, "3.0")},
        {"position_um": (1.0, 2.0, True)},
        {"position_um": (1.0, 2.0, None)},
        {"position_um": "123"},
        {"name": None},
        {"name": 5},
        {"state": "lost"},
        {"certainty": "certain"},
        {"source": "guessed"},
        {"locked": 1},
        {"locked": "true"},
        {"confidence": 0.5},
    ],
    ids=str,
)
def test_an_impossible_keypoint_is_refused(wrong: dict[str, Any]) -> None:
    KeypointAnnotation(**PLACED)
    with pytest.raises(ValidationError):
        KeypointAnnotation(**PLACED | wrong)


@pytest.mark.parametrize("state", ["placed", "occluded", "out_of_view"])
def test_every_state_but_unplaced_has_a_position(state: str) -> None:
    assert KeypointAnnotation(**PLACED | {"state": state}).position_um == (1.0, 2.0, 3.0)
    with pytest.raises(ValidationError, match=f"is {state} but has no position_um"):
        KeypointAnnotation(**PLACED | {"state": state, "position_um": None, "source": None})


def test_a_position_outside_every_volume_is_legal() -> None:
    assert KeypointAnnotation(**PLACED | {"position_um": (-1e9, 0.0, 1e9)}).position_um == (-1e9, 0.0, 1e9)


def test_the_origin_is_a_position_like_any_other() -> None:
    assert KeypointAnnotation(**PLACED | {"position_um": (0, 0, 0)}).position_um == (0.0, 0.0, 0.0)


def test_numbers_become_plain_floats() -> None:
    position_um = KeypointAnnotation(
        **PLACED | {"position_um": (np.float32(1), np.float64(2), 3)}
    ).position_um
    assert position_um is not None
    assert [type(value) for value in position_um] == [float, float, float]


@pytest.mark.parametrize(
    "wrong",
    [
        {"state": "unplaced"},
        {"center_um": None},
        {"size_um": None},
        {"rotation_wxyz": None},
        {"source": None},
        {"size_um": (10.0, 0.0, 4.0)},
        {"size_um": (10.0, -4.0, 4.0)},
        {"center_um": (math.nan, 0.0, 0.0)},
        {"rotation_wxyz": (0.0, 0.0, 0.0, 0.0)},
        {"rotation_wxyz": (math.nan, 0.0, 0.0, 1.0)},
        {"rotation_wxyz": (1.0, 0.0, 0.0)},
        {"yaw_deg": 5.0},
    ],
    ids=str,
)
def test_an_impossible_box_is_refused(wrong: dict[str, Any]) -> None:
    BoxAnnotation(**BOX)
    with pytest.raises(ValidationError):
        BoxAnnotation(**BOX | wrong)


def test_a_boxs_rotation_is_a_unit_quaternion_with_no_negative_w() -> None:
    box = BoxAnnotation(**BOX | {"rotation_wxyz": (-3.0, 0.0, 4.0, 0.0)})
    assert box.rotation_wxyz == pytest.approx((0.6, 0.0, -0.8, 0.0))
    assert changed(box, certainty="unsure").rotation_wxyz == box.rotation_wxyz


@pytest.mark.parametrize(
    "wrong",
    [
        {"spacing_um": (15.9, 0.0, 9.4)},
        {"spacing_um": (15.9, -13.5, 9.4)},
        {"spacing_um": (15.9, math.nan, 9.4)},
        {"spacing_um": (15.9, math.inf, 9.4)},
        {"spacing_um": (15.9, 13.5)},
        {"shape": (0, 5, 6)},
        {"shape": (4, 5)},
        {"shape": (4, 5, 6, 7)},
        {"shape": (4.0, 5.0, 6.0)},
        {"path": ""},
        {"path": "a\0b"},
        {"path": "a\ud800b"},
        {"path": None},
        {"units": "mm"},
    ],
    ids=str,
)
def test_an_impossible_volume_is_refused(wrong: dict[str, Any]) -> None:
    VolumeReference(**VOLUME)
    with pytest.raises(ValidationError):
        VolumeReference(**VOLUME | wrong)


def test_two_keypoints_of_one_name_are_refused(document: Annotation) -> None:
    with pytest.raises(ValidationError, match="keypoint 'k3' stands more than once"):
        changed(document, keypoints=(*document.keypoints, KeypointAnnotation(name="k3")))


def test_two_boxes_on_one_link_are_refused(document: Annotation) -> None:
    with pytest.raises(ValidationError, match="the box of link 'link0' stands more than once"):
        changed(document, boxes=(BoxAnnotation(link="link0"), BoxAnnotation(**BOX)))


@pytest.mark.parametrize(
    ("method", "parts", "name"),
    [
        ("keypoints", {"boxes": (BoxAnnotation(**BOX),)}, "link0"),
        ("boxes", {"keypoints": (KeypointAnnotation(**PLACED),)}, "k0"),
    ],
)
def test_nothing_is_placed_in_the_other_method(
    document: Annotation, method: Method, parts: dict[str, Any], name: str
) -> None:
    with pytest.raises(ValidationError, match=f"method is '{method}', so '{name}' cannot be placed as well"):
        changed(document, method=method, **parts)
    other: Method = "boxes" if method == "keypoints" else "keypoints"
    assert changed(document, method=other, **parts).parts


def test_the_parts_are_those_of_the_method(document: Annotation, by_boxes: Annotation) -> None:
    assert document.parts == document.keypoints
    assert by_boxes.parts == by_boxes.boxes
    assert by_boxes.part("link1") is by_boxes.boxes[1]
    assert by_boxes.part("link1").name == "link1"
    with pytest.raises(KeyError):
        by_boxes.part("k0")


def test_a_box_is_looked_for_at_its_centre(by_boxes: Annotation) -> None:
    part = by_boxes.boxes[0]
    assert part.box is not None
    assert part.anchor_um == part.box.center_um
    assert list(by_boxes.placed_boxes) == ["link0", "link1", "link2"]
    unplaced = BoxAnnotation(link="link0")
    assert (unplaced.box, unplaced.anchor_um) == (None, None)


@pytest.mark.parametrize(
    "wrong", [{"path": ""}, {"method": "polygons"}, {"roll_deg": math.nan}, {"roll_deg": "5"}], ids=str
)
def test_an_impossible_derivation_is_refused(wrong: dict[str, Any]) -> None:
    sound: dict[str, Any] = {"path": "v001.keypoints.json", "method": "keypoints", "roll_deg": 37.2}
    Derivation(**sound)
    with pytest.raises(ValidationError):
        Derivation(**sound | wrong)


def test_a_copy_of_the_tool_is_the_tool_that_the_document_names(
    document: Annotation, probe: ToolSpecification
) -> None:
    with pytest.raises(ValidationError, match="tool is 'magnetic-forceps', but tool_copy is 'probe'"):
        changed(document, tool_copy=probe)
    with pytest.raises(ValidationError, match="not the specification that tool_fingerprint names"):
        changed(document, tool="probe", tool_copy=probe)
    fingerprint = probe.fingerprint
    assert changed(document, tool="probe", tool_copy=probe, tool_fingerprint=fingerprint).tool_copy == probe


@pytest.mark.parametrize(
    "wrong",
    [
        {"method": "polygons"},
        {"status": "finished"},
        {"active_seconds": -1.0},
        {"active_seconds": math.inf},
        {"created": datetime(2026, 11, 22, 5, 0, 0)},  # noqa: DTZ001 - without a zone on purpose
        {"created": 1_700_000_000},
        {"created": "1700000000"},
        {"created": "yesterday"},
        {"created": "0001-01-01T00:00:00+23:00"},
        {"schema_id": "oct-annotation/2"},
        {"colour": "red"},
    ],
    ids=str,
)
def test_an_impossible_document_is_refused(document: Annotation, wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        changed(document, **wrong)


def test_times_are_kept_in_utc_to_the_second(document: Annotation) -> None:
    local = datetime(2026, 11, 22, 6, 0, 7, 900_000, tzinfo=timezone(timedelta(hours=1)))
    kept = changed(document, created=local)
    assert kept.created == datetime(2026, 11, 22, 5, 0, 7, tzinfo=UTC)
    assert kept.model_dump(mode="json")["created"] == "2026-11-22T05:00:07Z"


def test_a_record_cannot_be_changed(document: Annotation) -> None:
    with pytest.raises(ValidationError, match="frozen"):
        document.status = "done"  # type: ignore[misc]
    with pytest.raises(ValidationError, match="frozen"):
        document.keypoints[0].state = "placed"  # type: ignore[misc]


def test_a_fresh_document_has_every_keypoint_unplaced(forceps: ToolSpecification) -> None:
    fresh = new_annotation(VolumeReference(**VOLUME), forceps, "anna", "keypoints", ships=True)
    assert [keypoint.name for keypoint in fresh.keypoints] == ["k0", "k1", "k2", "k3", "k4", "k5"]
    assert {keypoint.state for keypoint in fresh.keypoints} == {"unplaced"}
    assert fresh.positions_um == {}
    assert fresh.tool_fingerprint == forceps.fingerprint
    assert fresh.tool_copy is None
    assert fresh.created == fresh.modified
    assert fresh.program == __version__


def test_a_fresh_document_of_boxes_has_every_link_unplaced(forceps: ToolSpecification) -> None:
    fresh = new_annotation(VolumeReference(**VOLUME), forceps, "anna", "boxes", ships=True)
    assert [part.link for part in fresh.boxes] == ["link0", "link1", "link2"]
    assert {part.state for part in fresh.boxes} == {"unplaced"}
    assert fresh.keypoints == ()


def test_a_tool_that_does_not_ship_travels_with_the_document(probe: ToolSpecification) -> None:
    assert (
        new_annotation(VolumeReference(**VOLUME), probe, "anna", "keypoints", ships=False).tool_copy == probe
    )


def test_positions_are_those_of_keypoints_that_have_one(document: Annotation) -> None:
    placed = changed(
        document,
        keypoints=(KeypointAnnotation(name="k1"), KeypointAnnotation(**PLACED | {"state": "occluded"})),
    )
    assert placed.positions_um == {"k0": (1.0, 2.0, 3.0)}
    assert placed.keypoint("k1").state == "unplaced"
    with pytest.raises(KeyError):
        placed.keypoint("k9")


@given(document=...)
def test_a_document_survives_the_way_through_json(document: Annotation) -> None:
    assert Annotation.model_validate_json(document.model_dump_json()) == document
    assert Annotation.model_validate(json.loads(json.dumps(document.model_dump(mode="json")))) == document
    assert Annotation.model_validate(document.model_dump()) == document


@given(document=...)
def test_nothing_changes_where_nothing_is_changed(document: Annotation) -> None:
    assert changed(document) == document


@given(document=...)
def test_stamps_are_no_content(document: Annotation) -> None:
    stamped = changed(document, modified=datetime.now(UTC), active_seconds=12.5, program="9.9")
    assert without_stamps(stamped) == without_stamps(document)
    assert without_stamps(changed(document, annotator=document.annotator + "x")) != without_stamps(document)
