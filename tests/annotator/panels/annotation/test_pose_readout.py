"""Pose, lengths and distances as the panel writes them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.documents.annotation import Annotation, VolumeReference, new_annotation, with_all_parts
from annotations.documents.edits import place_box, place_keypoint, set_certainty
from annotations.documents.record import Method, changed
from annotations.geometry.frames import Vector
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import find_tool
from annotator.looks.angles import angle_title
from annotator.panels.annotation.pose_readout import Reading, pose_readout
from annotator.session.editing.box_handles import rolled

FORCEPS = find_tool("magnetic-forceps")
NEEDLE = find_tool("needle")
BENT: dict[str, Vector] = {
    "k0": (0.0, 0.0, 0.0),
    "k1": (11000.0, 0.0, 0.0),
    "k2": (11000.0, 250.0, 0.0),
    "k3": (11000.0, 5250.0, 0.0),
    "k4": (11000.0, 5500.0, 0.0),
    "k5": (11000.0, 11500.0, 0.0),
}
COORDINATE = st.floats(-30_000, 30_000)


def empty_document(tool: ToolSpecification, method: Method = "keypoints") -> Annotation:
    volume = VolumeReference(
        path="v001.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=(15.9, 13.5, 9.4),
        fingerprint="0",
    )
    return with_all_parts(
        changed(new_annotation(volume, tool, "anna", "keypoints", ships=True), method=method), tool
    )


def placed(positions_um: dict[str, Vector], tool: ToolSpecification = FORCEPS) -> Annotation:
    document = empty_document(tool)
    for name, position_um in positions_um.items():
        document = place_keypoint(document, name, position_um, "clicked")
    return document


def posed(pose: ToolPose, *links: str) -> Annotation:
    document = empty_document(FORCEPS, "boxes")
    boxes = link_boxes(pose, FORCEPS)
    for link in links or boxes:
        document = place_box(document, link, boxes[link], "clicked")
    return document


def readings(positions_um: dict[str, Vector]) -> dict[str, Reading]:
    return {reading.name: reading for reading in pose_readout(placed(positions_um), FORCEPS).targets}


def test_every_target_of_a_known_pose_is_written_with_its_unit() -> None:
    found = readings(BENT)
    assert found["position_um"].values == (5500.0, 0.0, 0.0)
    assert found["position_um"].texts[0].endswith("µm")
    assert found["position_um"].texts[1].startswith("5.500  0.000  0.000")
    assert found["orientation"].texts == ("1.0000  0.0000  0.0000",)
    assert found["theta1_deg"].texts == ("90.00°",)
    assert found["theta1_deg"].title == "θ1"
    assert found["theta2_deg"].values == pytest.approx((0.0,))
    assert all(not reading.missing for reading in found.values())


def test_an_absent_target_names_the_keypoints_it_needs() -> None:
    found = readings({"k0": BENT["k0"], "k1": BENT["k1"], "k4": BENT["k4"]})
    assert found["position_um"].values
    assert found["theta1_deg"].missing == "needs k2, k3"
    assert found["theta2_deg"].missing == "needs k2, k3, k5"
    assert found["theta2_deg"].values == ()
    assert readings({})["position_um"].missing == "needs k0, k1"


def test_two_keypoints_at_one_place_give_no_direction_and_the_reason() -> None:
    found = readings(BENT | {"k1": BENT["k0"]})
    assert found["orientation"].missing == "k0 and k1 are at one place"
    assert found["theta1_deg"].missing == "the ends of a link are at one place"
    assert found["position_um"].values == (0.0, 0.0, 0.0)


def test_another_tool_has_other_targets() -> None:
    readout = pose_readout(placed({"tip": (1.0, 2.0, 3.0), "shaft": (1.0, 2.0, 0.0)}, NEEDLE), NEEDLE)
    assert [reading.name for reading in readout.targets] == ["position_um", "orientation"]
    assert readout.names == ("tip", "shaft")
    assert angle_title("yaw") == "yaw"


def test_lengths_stand_beside_their_nominal_ones() -> None:
    links = pose_readout(placed({name: BENT[name] for name in ("k0", "k1", "k2")}), FORCEPS).links
    assert [link.measured_um for link in links] == [11000.0, None, None]
    assert [link.nominal_um for link in links] == [11000.0, 5000.0, 6000.0]
    assert links[0].deviation == 0.0
    assert links[1].deviation is None


@given(st.lists(st.tuples(COORDINATE, COORDINATE, COORDINATE), min_size=6, max_size=6))
def test_distances_are_those_between_every_two_keypoints(points: list[Vector]) -> None:
    positions_um = dict(zip(FORCEPS.keypoint_names, points, strict=True))
    distances_um = pose_readout(placed(positions_um), FORCEPS).distances_um
    assert len(distances_um) == 15
    for (first, second), distance_um in distances_um.items():
        assert distance_um == pytest.approx(math.dist(positions_um[first], positions_um[second]))


def test_the_table_has_one_quantity_a_line_with_its_unit() -> None:
    lines = pose_readout(placed(BENT), FORCEPS).table().splitlines()
    values = dict(line.split("\t") for line in lines)
    assert lines[0] == "quantity\tvalue"
    assert values["position_um_x"] == "5500"
    assert values["orientation_x"] == "1"
    assert float(values["theta1_deg"]) == pytest.approx(90)
    assert values["length_link1_um"] == "5000"
    assert values["nominal_length_link2_um"] == "6000"
    assert values["distance_k0_k1_um"] == "11000"
    assert values["state_k0"] == "placed"
    assert values["source_k0"] == "clicked"
    assert len(values) == 1 + 3 + 3 + 2 + 6 + 15 + 12


def test_what_is_absent_is_empty_in_the_table() -> None:
    values = dict(line.split("\t") for line in pose_readout(placed({}), FORCEPS).table().splitlines())
    assert values["theta1_deg"] == ""
    assert values["position_um"] == ""
    assert values["length_link0_um"] == ""


def test_boxes_give_signed_angles_beside_the_published_ones() -> None:
    readout = pose_readout(
        posed(ToolPose((5000.0, 6000.0, 4000.0), (1, 0, 0, 0), {"theta1": -35.2})), FORCEPS
    )
    found = {reading.name: reading for reading in readout.targets}
    assert found["theta1_deg"].texts == ("35.20°   signed \N{MINUS SIGN}35.20°",)
    assert found["theta1_deg"].values == pytest.approx((35.2,))
    assert found["theta2_deg"].texts == ("0.00°   signed 0.00°",)
    values = dict(line.split("\t") for line in readout.table().splitlines())
    assert float(values["theta1_signed_deg"]) == pytest.approx(-35.2)
    assert float(values["theta1_deg"]) == pytest.approx(35.2)
    assert "theta1_signed_deg" not in dict(
        line.split("\t") for line in pose_readout(placed(BENT), FORCEPS).table().splitlines()
    )


def test_a_signed_angle_that_contradicts_the_unsigned_one_is_doubted() -> None:
    boxes = link_boxes(ToolPose((5000.0, 6000.0, 4000.0), (1, 0, 0, 0), {"theta1": 47.33}), FORCEPS)

    def theta1(rolled_deg: float) -> Reading:
        document = posed(ToolPose((5000.0, 6000.0, 4000.0), (1, 0, 0, 0), {"theta1": 47.33}))
        document = place_box(document, "link0", rolled(boxes["link0"], rolled_deg), "clicked")
        return next(each for each in pose_readout(document, FORCEPS).targets if each.name == "theta1_deg")

    assert theta1(15.0).doubt == ""
    assert "signed" in theta1(15.0).texts[0]
    wrong = theta1(90.0)
    assert wrong.texts == ("47.33°",)
    assert wrong.doubt == "signed 0.00°: the hinge of link0's box is not across the bend, see Check"
    assert wrong.signed_deg == pytest.approx(0.0, abs=1e-9)


def test_nothing_is_written_as_minus_zero() -> None:
    origin = readings({name: (-0.01, -0.01, x) for name, (x, _, _) in BENT.items()})
    assert origin["position_um"].texts[0].startswith("0.0")
    assert origin["position_um"].texts[1].startswith("0.000")
    assert origin["orientation"].texts == ("0.0000  0.0000  1.0000",)


def test_absent_boxes_are_named_by_their_links() -> None:
    readout = pose_readout(posed(ToolPose((5000.0, 6000.0, 4000.0), (1, 0, 0, 0)), "link0"), FORCEPS)
    found = {reading.name: reading for reading in readout.targets}
    assert found["position_um"].values == (5000.0, 6000.0, 4000.0)
    assert found["theta1_deg"].missing == "needs link1"
    assert found["theta2_deg"].missing == "needs link1, link2"


@pytest.mark.parametrize(
    ("length_um", "judged"), [(11900.0, "plausible"), (12100.0, "doubtful"), (13200.0, "implausible")]
)
def test_a_length_is_judged_by_clicks_and_an_uncalibrated_nominal_one(length_um: float, judged: str) -> None:
    document = placed({"k0": (0.0, 0.0, 0.0), "k1": (length_um, 0.0, 0.0)})
    assert pose_readout(document, FORCEPS).links[0].plausibility == judged


def test_an_unsure_end_excuses_a_length() -> None:
    document = placed({"k2": (0.0, 0.0, 0.0), "k3": (5600.0, 0.0, 0.0)})
    assert pose_readout(document, FORCEPS).links[1].plausibility == "doubtful"
    unsure = set_certainty(document, "k3", "unsure")
    assert pose_readout(unsure, FORCEPS).links[1].plausibility == "plausible"
