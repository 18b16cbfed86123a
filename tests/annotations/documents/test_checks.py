from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from annotations.documents.annotation import Annotation, BoxAnnotation, State, with_all_parts
from annotations.documents.checks import check_annotation, check_file
from annotations.documents.conversion import sibling_path, to_boxes
from annotations.documents.edits import clear, place_box, place_keypoint, set_state, set_status
from annotations.documents.files import annotation_bytes, save_annotation
from annotations.documents.record import changed
from annotations.geometry.boxes import Box, box_between
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import about_axis, product
from annotations.geometry.tool import ToolSpecification

Write = Callable[..., Path]
Begin = Callable[..., Annotation]


@pytest.fixture
def posed(document: Annotation, forceps: ToolSpecification) -> Annotation:
    """A finished document with a plausible tool inside the volume."""
    pose = ToolPose((7000.0, 8000.0, 6000.0), (0.7071, 0.0, 0.0, 0.7071), {"theta1": 10.0, "theta2": 20.0})
    for name, position_um in keypoints_um(pose, forceps).items():
        document = place_keypoint(document, name, position_um, "clicked")
    return set_status(document, "done")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "annotations" / "v001.keypoints.json"


@pytest.fixture
def volume_path(tmp_path: Path, write_volume: Write) -> Path:
    return write_volume(tmp_path / "volumes" / "v001.npy")


@pytest.fixture
def begun(volume_path: Path, path: Path, begin_document: Begin) -> Annotation:
    document = begin_document(volume_path, path)
    save_annotation(document, path, expected="")
    return document


def problems(document: Annotation, tool: ToolSpecification) -> list[tuple[str, str]]:
    return [(finding.kind, finding.problem) for finding in check_annotation(document, tool)]


def test_a_plausible_document_has_no_findings(posed: Annotation, forceps: ToolSpecification) -> None:
    assert problems(posed, forceps) == []


def test_a_fresh_document_has_no_findings(document: Annotation, forceps: ToolSpecification) -> None:
    assert problems(document, forceps) == []


def test_done_with_unplaced_keypoints_is_found(document: Annotation, forceps: ToolSpecification) -> None:
    placed = place_keypoint(document, "k0", (10.0, 10.0, 10.0), "clicked")
    assert problems(set_status(placed, "done"), forceps) == [
        ("keypoint", "it is marked as done, but k1, k2, k3, k4, k5 are unplaced")
    ]
    by_boxes = with_all_parts(changed(set_status(document, "done"), method="boxes"), forceps)
    assert problems(by_boxes, forceps) == [
        ("box", "it is marked as done, but link0, link1, link2 are unplaced")
    ]


def test_a_position_outside_is_found_unless_it_says_so(
    document: Annotation, forceps: ToolSpecification
) -> None:
    outside = place_keypoint(document, "k0", (-100.0, 10.0, 10.0), "clicked")
    assert problems(outside, forceps) == [
        ("keypoint", "k0 is placed, but its position is outside the volume")
    ]
    assert problems(set_state(outside, "k0", "out_of_view"), forceps) == []
    inside = set_state(place_keypoint(outside, "k0", (0.0, 10.0, 10.0), "clicked"), "k0", "out_of_view")
    assert problems(inside, forceps) == [
        ("keypoint", "k0 is out of view, but its position is inside the volume")
    ]


def test_a_box_outside_is_found_unless_it_says_so(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    assert problems(set_status(by_boxes, "done"), forceps) == []
    box = by_boxes.placed_boxes["link1"]
    outside = place_box(by_boxes, "link1", replace(box, center_um=(-9000.0, 8000.0, 6000.0)), "dragged")
    assert problems(outside, forceps) == [
        ("box", "link1 is placed, but its box, from end to end, is outside the volume")
    ]
    assert problems(set_state(outside, "link1", "out_of_view"), forceps) == []
    assert problems(set_state(by_boxes, "link1", "out_of_view"), forceps) == [
        ("box", "link1 is out of view, but its box, from end to end, is inside the volume")
    ]


@pytest.mark.parametrize("state", ["placed", "occluded", "out_of_view"])
def test_a_box_across_the_border_may_be_called_either(
    by_boxes: Annotation, forceps: ToolSpecification, state: State
) -> None:
    across = Box((0.0, 8000.0, 6000.0), (5000.0, 4000.0, 4000.0), (1.0, 0.0, 0.0, 0.0))
    alone = clear(clear(by_boxes, "link0"), "link2")
    cut = set_state(place_box(alone, "link1", across, "dragged"), "link1", state)
    assert problems(cut, forceps) == []


def test_a_box_of_an_implausible_length_is_found(by_boxes: Annotation, forceps: ToolSpecification) -> None:
    box = by_boxes.placed_boxes["link2"]
    short = place_box(by_boxes, "link2", replace(box, size_um=(2000.0, *box.size_um[1:])), "dragged")
    assert [kind for kind, _ in problems(short, forceps)] == ["link"]


@pytest.mark.parametrize("turn_deg", [15.0, -15.0, 40.0, 180.0])
def test_boxes_that_do_not_agree_about_a_hinge_are_found(
    by_boxes: Annotation, forceps: ToolSpecification, turn_deg: float
) -> None:
    box = by_boxes.placed_boxes["link2"]
    turned = replace(box, rotation_wxyz=product(box.rotation_wxyz, about_axis((1, 0, 0), turn_deg)))
    found = problems(place_box(by_boxes, "link2", turned, "dragged"), forceps)
    if abs(turn_deg) < 20:
        assert found == []
    else:
        [(kind, problem)] = found
        assert kind == "box"
        assert problem.startswith("link1 and link2 show the hinge of theta2 in directions that are")
        assert f"{turn_deg:.0f}° apart" in problem


def test_boxes_that_are_all_rolled_alike_are_found_by_their_bend(
    by_boxes: Annotation, forceps: ToolSpecification
) -> None:
    # Each begins with its parent's hinge as near as its own direction allows, as two clicks place it.
    rolled, hinge = by_boxes, by_boxes.placed_boxes["link0"].axes @ (0.0, 0.5, 0.866)
    for link, box in by_boxes.placed_boxes.items():
        placed = box_between(box.base_um, box.tip_um, box.size_um[1:], hinge)
        rolled, hinge = place_box(rolled, link, placed, "clicked"), placed.axes[:, 1]
    assert {kind for kind, _ in problems(rolled, forceps)} == {"box"}


def test_a_derived_document_is_held_against_its_original(
    path: Path, by_keypoints: Annotation, forceps: ToolSpecification
) -> None:
    derived_path = sibling_path(path, "boxes")

    def problem_after(derived: Annotation) -> str:
        save_annotation(derived, derived_path, expected="", overwrite=True)
        return "".join(found.problem for found in check_file(derived_path) if found.kind == "original")

    save_annotation(by_keypoints, path, expected="")
    derived = to_boxes(by_keypoints, forceps, original=path, derived=derived_path)
    later, earlier = (changed(derived, created=derived.created + timedelta(hours=hours)) for hours in (1, -1))
    assert problem_after(later) == ""
    assert "has been saved since then" in problem_after(earlier)
    path.unlink()
    assert "is not to be read" in problem_after(later)
    # A document that a person has gone over stands for itself.
    for link, box in derived.placed_boxes.items():
        later = place_box(later, link, box, "dragged")
    assert problem_after(later) == ""


@pytest.mark.parametrize(
    ("length_um", "plausible"), [(5400, False), (5600, True), (21_900, True), (22_100, False)]
)
def test_a_link_of_an_implausible_length_is_found(
    document: Annotation, forceps: ToolSpecification, length_um: float, plausible: bool
) -> None:
    linked = place_keypoint(document, "k0", (10.0, 10.0, 10.0), "clicked")
    linked = place_keypoint(linked, "k1", (10.0, 10.0 + length_um, 10.0), "clicked")
    assert [kind for kind, _ in problems(linked, forceps)] == ([] if plausible else ["link"])


def test_keypoints_in_astronomical_places_are_found_and_no_more(
    document: Annotation, forceps: ToolSpecification
) -> None:
    far = place_keypoint(document, "k0", (1e308, 0.0, 0.0), "typed")
    far = place_keypoint(far, "k1", (-1e308, 0.0, 0.0), "typed")
    assert [kind for kind, _ in problems(far, forceps)] == ["keypoint", "keypoint", "link"]


def test_a_sound_file_has_no_findings(path: Path, begun: Annotation) -> None:
    assert check_file(path) == ()


@pytest.mark.parametrize(
    ("fields", "kind", "problem"),
    [
        ({"shape": (6, 4, 5)}, "shape", "the annotation was made on (6, 4, 5)"),
        ({"dtype": "uint16"}, "dtype", "the annotation was made on uint16"),
        ({"fingerprint": "f" * 64}, "fingerprint", "not the one that was annotated"),
        ({"path": "../volumes/gone.npy"}, "volume", "gone.npy"),
        ({"dataset": "scan"}, "volume", "scan"),
    ],
)
def test_another_volume_is_found(
    path: Path, begun: Annotation, fields: dict[str, Any], kind: str, problem: str
) -> None:
    save_annotation(changed(begun, volume=changed(begun.volume, **fields)), path, expected="", overwrite=True)
    (finding,) = check_file(path)
    assert finding.kind == kind
    assert problem in finding.problem


def test_a_spoilt_volume_is_found(path: Path, begun: Annotation, volume_path: Path) -> None:
    volume_path.write_bytes(volume_path.read_bytes()[:-10])
    assert [finding.kind for finding in check_file(path)] == ["volume"]


def test_a_file_that_cannot_be_read_is_the_finding(path: Path, begun: Annotation) -> None:
    path.write_bytes(annotation_bytes(begun)[:200])
    (finding,) = check_file(path)
    assert finding.kind == "file"
    assert str(path) in finding.problem


def test_an_unknown_keypoint_is_found(path: Path, begun: Annotation) -> None:
    renamed = changed(begun, keypoints=(*begun.keypoints[1:], changed(begun.keypoints[0], name="tip")))
    save_annotation(renamed, path, expected="", overwrite=True)
    (finding,) = check_file(path)
    assert finding.kind == "keypoint"
    assert "'tip' is unknown to the tool 'magnetic-forceps'" in finding.problem


def test_a_missing_keypoint_of_a_finished_file_is_found(path: Path, begun: Annotation) -> None:
    save_annotation(changed(begun, keypoints=(), status="done"), path, expected="", overwrite=True)
    (finding,) = check_file(path)
    assert "k0, k1, k2, k3, k4, k5 are unplaced" in finding.problem


def test_a_box_on_an_unknown_link_is_found(path: Path, begun: Annotation) -> None:
    save_annotation(changed(begun, boxes=(BoxAnnotation(link="jaw"),)), path, expected="", overwrite=True)
    assert ["link 'jaw' is unknown" in finding.problem for finding in check_file(path)] == [True]


def test_an_unknown_or_another_tool_is_found(path: Path, begun: Annotation) -> None:
    save_annotation(changed(begun, tool="scissors"), path, expected="", overwrite=True)
    assert [finding.kind for finding in check_file(path)] == ["tool"]
    save_annotation(changed(begun, tool_fingerprint="f" * 64), path, expected="", overwrite=True)
    assert [finding.kind for finding in check_file(path)] == ["tool"]


def test_a_tool_that_travels_is_held_against_the_one_found_here(
    tmp_path: Path, path: Path, begin_document: Begin, volume_path: Path, probe: ToolSpecification
) -> None:
    save_annotation(begin_document(volume_path, path, probe, ships=False), path, expected="")
    assert check_file(path) == ()
    tools = tmp_path / "tools"
    tools.mkdir()
    specification = (
        'schema = "oct-tool/1"\nname = "probe"\nkeypoints = [{ name = "tip" }, { name = "shaft" }]\n'
    )
    (tools / "probe.toml").write_text(specification, encoding="utf-8")
    (finding,) = check_file(path, [tools])
    assert finding.kind == "tool"
    assert "its copy of the tool 'probe' is not the one found here" in finding.problem


def test_a_wrong_specification_found_here_is_named(
    tmp_path: Path, path: Path, begin_document: Begin, volume_path: Path, probe: ToolSpecification
) -> None:
    save_annotation(begin_document(volume_path, path, probe, ships=False), path, expected="")
    (tmp_path / "wrong.toml").write_text("schema = 5\n", encoding="utf-8")
    (finding,) = check_file(path, [tmp_path])
    assert finding.kind == "tool"
    assert "wrong.toml" in finding.problem


def test_everything_that_is_wrong_is_said_at_once(path: Path, begun: Annotation) -> None:
    wrong = place_keypoint(begun, "k0", (-5000.0, 0.0, 0.0), "clicked")
    wrong = set_status(place_keypoint(wrong, "k1", (0.0, 0.0, 0.0), "clicked"), "done")
    wrong = changed(wrong, volume=changed(wrong.volume, shape=(1, 1, 1), dtype="int8"))
    save_annotation(wrong, path, expected="", overwrite=True)
    kinds = [finding.kind for finding in check_file(path)]
    assert kinds == ["keypoint", "keypoint", "link", "shape", "dtype"]


def test_checking_changes_no_file(path: Path, begun: Annotation, volume_path: Path) -> None:
    beside = sorted(path.parent.iterdir())
    before = {each: each.read_bytes() for each in (path, volume_path)}
    check_file(path)
    assert {each: each.read_bytes() for each in before} == before
    assert sorted(path.parent.iterdir()) == beside
