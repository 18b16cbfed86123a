import math
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from annotations.agreement.consensus import Opinion, propose
from annotations.documents.annotation import (
    Annotation,
    BoxAnnotation,
    KeypointAnnotation,
    VolumeReference,
    new_annotation,
)
from annotations.documents.edits import (
    EditRefused,
    adopt,
    lock,
    place_box,
    place_keypoint,
    propose_consensus,
    set_certainty,
    set_state,
)
from annotations.documents.record import Method, changed
from annotations.geometry.boxes import Box
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.rotations import about_axis, product
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools

FORCEPS = shipped_tools()["magnetic-forceps"]
POSE = ToolPose((7000.0, 8000.0, 6000.0), about_axis((1, 2, 3), 80.0), {"theta1": -30.0, "theta2": 40.0})
TRUTH_UM = keypoints_um(POSE, FORCEPS)
BOXES = link_boxes(POSE, FORCEPS)
PEOPLE = ("anna", "ben", "carl")


def fresh(annotator: str, method: Method = "keypoints", tool: ToolSpecification = FORCEPS) -> Annotation:
    reference = VolumeReference(
        path="../../volumes/v001.npy",
        shape=(1096, 1936, 1152),
        dtype="uint8",
        spacing_um=(15.9, 13.5, 9.4),
        fingerprint="0" * 64,
    )
    begun = datetime(2026, 11, 22, 5, 0, 0, tzinfo=UTC)
    return changed(
        new_annotation(reference, tool, annotator, method, ships=True), created=begun, modified=begun
    )


def opinion(document: Annotation) -> Opinion:
    path = Path("/study/annotations") / document.annotator / f"v001.{document.method}.json"
    return Opinion(path, f"{len(document.annotator):064x}", document)


def by_keypoints(annotator: str, offsets_um: dict[str, tuple[float, float, float]]) -> Annotation:
    document = fresh(annotator)
    for name, position_um in TRUTH_UM.items():
        moved_um = vector(np.add(position_um, offsets_um.get(name, (0.0, 0.0, 0.0))))
        document = place_keypoint(document, name, moved_um, "clicked")
    return document


def by_boxes(annotator: str, change: Callable[[Box], Box] = lambda box: box) -> Annotation:
    document = fresh(annotator, "boxes")
    for link, box in BOXES.items():
        document = place_box(document, link, change(box), "clicked")
    return document


def test_of_two_annotators_the_proposal_lies_midway_and_both_count() -> None:
    documents = [by_keypoints("anna", {"k2": (0.0, 0.0, 3000.0)}), by_keypoints("ben", {})]
    agreed = propose([opinion(document) for document in documents])
    k2 = agreed.parts["k2"]
    assert k2.proposed.anchor_um == pytest.approx(np.add(TRUTH_UM["k2"], (0.0, 0.0, 1500.0)))
    assert k2.spread_um == pytest.approx(1500.0)
    assert (k2.used, k2.set_aside) == (("anna", "ben"), ())
    assert agreed.parts["k0"].spread_um == pytest.approx(0.0, abs=1e-6)


def test_one_of_three_who_stands_apart_is_set_aside_and_named() -> None:
    rng = np.random.default_rng(1)
    noise = {who: {name: vector(rng.normal(0, 40, 3)) for name in TRUTH_UM} for who in PEOPLE}
    noise["carl"]["k3"] = (2500.0, 0.0, 0.0)
    agreed = propose([opinion(by_keypoints(who, noise[who])) for who in PEOPLE])
    k3 = agreed.parts["k3"]
    assert (k3.used, k3.set_aside) == (("anna", "ben"), ("carl",))
    middle_um = np.mean([np.add(TRUTH_UM["k3"], noise[who]["k3"]) for who in ("anna", "ben")], axis=0)
    assert k3.proposed.anchor_um is not None
    assert math.dist(k3.proposed.anchor_um, middle_um) < 15
    assert all(not part.set_aside for name, part in agreed.parts.items() if name != "k3")


def test_where_all_agree_within_noise_the_proposal_is_near_their_mean() -> None:
    rng = np.random.default_rng(2)
    people = [f"p{number}" for number in range(7)]
    noise = {who: {name: vector(rng.normal(0, 40, 3)) for name in TRUTH_UM} for who in people}
    agreed = propose([opinion(by_keypoints(who, noise[who])) for who in people])
    for name, truth_um in TRUTH_UM.items():
        mean_um = np.mean([np.add(truth_um, noise[who][name]) for who in people], axis=0)
        anchor_um = agreed.parts[name].proposed.anchor_um
        assert anchor_um is not None
        assert math.dist(anchor_um, mean_um) < 12
        assert agreed.parts[name].used == tuple(people)


def test_three_who_all_differ_are_averaged_and_nobody_is_set_aside() -> None:
    offsets = {"anna": (9000.0, 0.0, 0.0), "ben": (0.0, 9000.0, 0.0), "carl": (0.0, 0.0, -9000.0)}
    agreed = propose([opinion(by_keypoints(who, dict.fromkeys(TRUTH_UM, offsets[who]))) for who in PEOPLE])
    assert agreed.parts["k1"].set_aside == ()
    assert agreed.parts["k1"].proposed.anchor_um == pytest.approx(np.add(TRUTH_UM["k1"], (3e3, 3e3, -3e3)))


def test_what_nobody_placed_where_it_is_does_not_count() -> None:
    documents = [by_keypoints("anna", {}), by_keypoints("ben", {})]
    predicted = changed(documents[1].keypoint("k4"), source="predicted")
    documents[1] = changed(
        documents[1], keypoints=(*documents[1].keypoints[:4], predicted, *documents[1].keypoints[5:])
    )
    k4 = propose([opinion(document) for document in documents]).parts["k4"]
    assert (k4.used, k4.spread_um) == (("anna",), None)
    alone = propose([opinion(fresh("anna")), opinion(fresh("ben"))])
    assert all(part.proposed.state == "unplaced" and not part.used for part in alone.parts.values())


def test_how_most_saw_it_is_kept_but_never_against_where_it_lies() -> None:
    documents = [by_keypoints(who, {"k5": (0.0, 0.0, 60_000.0)}) for who in PEOPLE]
    documents[0] = set_state(documents[0], "k1", "occluded")
    documents[1] = set_certainty(set_state(documents[1], "k1", "occluded"), "k1", "unsure")
    documents[2] = set_certainty(documents[2], "k1", "unsure")
    agreed = propose([opinion(document) for document in documents])
    assert (agreed.parts["k1"].proposed.state, agreed.parts["k1"].proposed.certainty) == (
        "occluded",
        "unsure",
    )
    assert agreed.parts["k5"].proposed.state == "out_of_view"
    assert (agreed.parts["k0"].proposed.state, agreed.parts["k0"].proposed.certainty) == ("placed", "sure")


def test_boxes_are_averaged_in_pose_and_size_and_turned_ones_are_turned_back() -> None:
    def measured(shift_um: float, width_um: float) -> Callable[[Box], Box]:
        return lambda box: Box(
            vector(np.add(box.center_um, (shift_um, 0.0, 0.0))),
            (box.size_um[0], width_um, box.size_um[2]),
            box.rotation_wxyz,
        )

    documents = [
        by_boxes("anna", measured(-30.0, 3900.0)),
        by_boxes("ben", measured(30.0, 4100.0)),
        by_boxes("carl", lambda box: measured(0.0, 4000.0)(box).turned_over),
    ]
    agreed = propose([opinion(document) for document in documents])
    for link, truth in BOXES.items():
        part = agreed.parts[link]
        assert (part.turned, part.used) == (("carl",), PEOPLE)
        assert isinstance(part.proposed, BoxAnnotation)
        box = part.proposed.box
        assert box is not None
        assert box.axes == pytest.approx(truth.axes, abs=1e-9)
        assert box.center_um == pytest.approx(truth.center_um, abs=5.0)
        assert box.size_um == pytest.approx((truth.size_um[0], 4000.0, truth.size_um[2]), abs=5.0)
        assert part.spread_um == pytest.approx(25.0, abs=10.0)


def test_small_turns_of_boxes_about_the_middle_cancel() -> None:
    def tilted(angle_deg: float) -> Callable[[Box], Box]:
        return lambda box: Box(
            box.center_um, box.size_um, product(about_axis((0, 0, 1), angle_deg), box.rotation_wxyz)
        )

    agreed = propose([opinion(by_boxes("anna", tilted(2.0))), opinion(by_boxes("ben", tilted(-2.0)))])
    for link, truth in BOXES.items():
        part = agreed.parts[link].proposed
        assert isinstance(part, BoxAnnotation)
        assert part.box is not None
        assert part.box.axes == pytest.approx(truth.axes, abs=1e-3)


def test_two_boxes_that_point_in_opposite_directions_give_one_of_them() -> None:
    def reversed_(box: Box) -> Box:
        return Box(box.center_um, box.size_um, product(box.rotation_wxyz, (0.0, 0.0, 0.0, 1.0)))

    agreed = propose([opinion(by_boxes("anna")), opinion(by_boxes("ben", reversed_))])
    part = agreed.parts["link0"].proposed
    assert isinstance(part, BoxAnnotation)
    assert part.box is not None
    assert part.box.axes[:, 0] == pytest.approx(BOXES["link0"].axes[:, 0])


def test_a_proposal_leaves_what_a_reviewer_decided_and_says_what_it_came_from() -> None:
    agreed = propose([opinion(by_keypoints(who, {})) for who in PEOPLE])
    path = Path("/study/annotations/consensus/v001.keypoints.json")
    parts = {name: part.proposed for name, part in agreed.parts.items()}
    settled = propose_consensus(fresh("consensus"), parts, agreed.contributions(path))
    assert [part.source for part in settled.parts] == ["consensus"] * 6
    assert [each.path for each in settled.consensus_of] == [f"../{who}/v001.keypoints.json" for who in PEOPLE]
    moved = place_keypoint(settled, "k2", (1.0, 2.0, 3.0), "dragged")
    taken = adopt(moved, by_keypoints("ben", {"k3": (5.0, 0.0, 0.0)}).part("k3"), "ben")
    locked = lock(taken, "k4", locked=True)
    again = propose_consensus(locked, {**parts, "k0": KeypointAnnotation(name="k0")}, locked.consensus_of)
    assert again.keypoint("k2").position_um == (1.0, 2.0, 3.0)
    assert (again.keypoint("k3").source, again.keypoint("k3").adopted_from) == ("adopted", "ben")
    assert again.keypoint("k4") == locked.keypoint("k4")
    assert again.keypoint("k0").state == "unplaced"
    assert propose_consensus(settled, parts, settled.consensus_of) is settled


def test_what_was_taken_from_an_annotator_and_moved_is_the_reviewers_own() -> None:
    theirs = by_keypoints("ben", {})
    taken = adopt(fresh("consensus"), theirs.part("k3"), "ben")
    assert taken.keypoint("k3").position_um == theirs.keypoint("k3").position_um
    moved = place_keypoint(taken, "k3", (1.0, 2.0, 3.0), "nudged")
    assert (moved.keypoint("k3").source, moved.keypoint("k3").adopted_from) == ("nudged", None)
    with pytest.raises(EditRefused, match="ben has not placed k0"):
        adopt(taken, fresh("ben").part("k0"), "ben")
