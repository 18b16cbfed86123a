from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from annotations.documents.annotation import Annotation, Source, VolumeReference, new_annotation
from annotations.documents.edits import place_box, place_keypoint, pose_tool, set_certainty, set_state
from annotations.documents.files import save_annotation
from annotations.documents.record import Method, changed
from annotations.documents.study import annotation_path
from annotations.fitting.calibration import (
    Calibration,
    LinkMeasures,
    Measured,
    calibrate,
    calibrate_study,
    calibrated_tool,
)
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolError, ToolSpecification
from annotations.geometry.tool_library import load_tool, shipped_tools, write_tool

VOLUME = VolumeReference(
    path="../../volumes/v001.npy",
    shape=(1096, 1936, 1152),
    dtype="uint8",
    spacing_um=(15.9, 13.5, 9.4),
    fingerprint="0" * 64,
)
POSE = ToolPose((7000.0, 8000.0, 6000.0), (0.8, 0.0, 0.0, 0.6), {"theta1": 20.0, "theta2": 30.0})

Make = Callable[..., Annotation]


@pytest.fixture(scope="session")
def forceps() -> ToolSpecification:
    return shipped_tools()["magnetic-forceps"]


def with_lengths(tool: ToolSpecification, lengths_um: Sequence[float]) -> ToolSpecification:
    links = [
        link.model_copy(update={"length_um": length_um})
        for link, length_um in zip(tool.links, lengths_um, strict=True)
    ]
    return tool.model_copy(update={"links": tuple(links)})


@pytest.fixture(scope="session")
def make(forceps: ToolSpecification) -> Make:
    """Make a finished document in which the links have the lengths asked for, in the tool's order."""

    def make(
        *lengths_um: float, method: Method = "keypoints", source: Source = "clicked", annotator: str = "anna"
    ) -> Annotation:
        document = new_annotation(VOLUME, forceps, annotator, method, ships=True)
        real = with_lengths(forceps, lengths_um)
        if method == "keypoints":
            for name, position_um in keypoints_um(POSE, real).items():
                document = place_keypoint(document, name, position_um, source)
        else:
            for link, box in link_boxes(POSE, real).items():
                document = place_box(document, link, box, source)
        return changed(document, status="done")

    return make


def lengths(calibration: Calibration) -> dict[str, Measured | None]:
    return {name: measures.length for name, measures in calibration.links.items()}


def number_of(calibration: Calibration, link: str) -> int:
    length = calibration.links[link].length
    return 0 if length is None else length.number


@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_lengths_are_medians_with_a_robust_spread(
    make: Make, forceps: ToolSpecification, method: Method
) -> None:
    documents = [make(length_um, 5100.0, 6200.0, method=method) for length_um in (10_900, 10_950, 12_500)]
    found = calibrate(documents, forceps)
    link0 = found.links["link0"].length
    assert link0 is not None
    assert link0.median_um == pytest.approx(10_950)
    # Absolute deviations of 0, 50 and 1,550 µm.
    assert link0.spread_um == pytest.approx(1.4826 * 50)
    assert link0.number == found.documents == 3
    assert found.links["link1"].length == Measured(pytest.approx(5100), pytest.approx(0, abs=1e-6), 3)


def test_the_spread_of_normal_errors_is_their_standard_deviation(
    make: Make, forceps: ToolSpecification
) -> None:
    random = np.random.default_rng(1)
    found = calibrate([make(*row) for row in random.normal((11_000, 5000, 6000), 80.0, (300, 3))], forceps)
    for measured in lengths(found).values():
        assert measured is not None
        assert measured.spread_um == pytest.approx(80.0, rel=0.2)


def test_one_measurement_has_no_spread(make: Make, forceps: ToolSpecification) -> None:
    link0 = calibrate([make(10_900, 5100, 6200)], forceps).links["link0"].length
    assert link0 is not None
    assert (link0.spread_um, link0.number) == (None, 1)


def test_every_annotator_and_both_methods_count(make: Make, forceps: ToolSpecification) -> None:
    documents = [
        make(10_900, 5100, 6200),
        make(10_900, 5100, 6200, annotator="ben"),
        make(10_900, 5100, 6200, method="boxes"),
    ]
    assert number_of(calibrate(documents, forceps), "link0") == 3


def test_unfinished_annotations_do_not_count(make: Make, forceps: ToolSpecification) -> None:
    found = calibrate([changed(make(10_900, 5100, 6200), status="in_progress")], forceps)
    assert found.documents == 0
    assert set(lengths(found).values()) == {None}


@pytest.mark.parametrize("source", ["posed", "refined", "derived", "fitted", "predicted", "synthesized"])
@pytest.mark.parametrize("method", ["keypoints", "boxes"])
def test_what_repeats_the_specification_is_no_evidence(
    make: Make, forceps: ToolSpecification, source: Source, method: Method
) -> None:
    found = calibrate([make(10_900, 5100, 6200, source=source, method=method)], forceps)
    assert set(lengths(found).values()) == {None}
    assert found.documents == 0


@pytest.mark.parametrize("source", ["clicked", "typed", "dragged", "nudged", "snapped"])
def test_what_a_person_places_is(make: Make, forceps: ToolSpecification, source: Source) -> None:
    assert number_of(calibrate([make(10_900, 5100, 6200, source=source)], forceps), "link0") == 1


def test_a_person_must_have_seen_both_ends_and_be_sure(make: Make, forceps: ToolSpecification) -> None:
    said = set_state(make(10_900, 5100, 6200), "k1", "occluded")
    said = set_certainty(said, "k2", "unsure")
    assert [number_of(calibrate([said], forceps), link.name) for link in forceps.links] == [0, 0, 1]


def test_a_box_that_was_only_moved_has_not_been_measured(make: Make, forceps: ToolSpecification) -> None:
    document = pose_tool(make(10_900, 5100, 6200, method="boxes"), forceps, POSE)
    box = document.placed_boxes["link0"]
    moved = place_box(document, "link0", replace(box, center_um=(5000.0, 5000.0, 5000.0)), "dragged")
    assert number_of(calibrate([moved], forceps), "link0") == 0
    longer = place_box(document, "link0", replace(box, size_um=(11_200.0, *box.size_um[1:])), "dragged")
    assert number_of(calibrate([longer], forceps), "link0") == 1


def test_cross_sections_are_those_that_a_person_changed(make: Make, forceps: ToolSpecification) -> None:
    document = make(10_900, 5100, 6200, method="boxes")
    untouched = calibrate([document], forceps).links
    assert {(links.width, links.height) for links in untouched.values()} == {(None, None)}
    box = document.placed_boxes["link2"]
    flatter = place_box(document, "link2", replace(box, size_um=(*box.size_um[:2], 1800.0)), "dragged")
    found = calibrate([document, flatter], forceps).links["link2"]
    assert found.width is None
    assert found.height == Measured(1800.0, None, 1)


def test_a_round_link_has_one_diameter(make: Make, forceps: ToolSpecification) -> None:
    document = make(10_900, 5100, 6200, method="boxes")
    box = document.placed_boxes["link1"]
    measured = place_box(document, "link1", replace(box, size_um=(5100.0, 3800.0, 3900.0)), "dragged")
    found = calibrate([measured], forceps)
    assert found.links["link1"].width == found.links["link1"].height
    link = calibrated_tool(forceps, found, "mine").link("link1")
    assert link.cross_section_um == (3850.0, 3850.0)
    assert link.is_round


def test_a_calibrated_tool_has_the_medians_under_its_own_name(make: Make, forceps: ToolSpecification) -> None:
    found = calibrate([make(10_900.04, 5100, 6200), make(10_900.08, 5100, 6200)], forceps)
    tool = calibrated_tool(forceps, found, "forceps-2026")
    assert [link.length_um for link in tool.links] == [10_900.1, 5100.0, 6200.0]
    assert tool.name == "forceps-2026"
    assert tool.title == "Magnetic forceps: three links, two joints, calibrated on 2 annotations"
    alone = calibrated_tool(forceps, calibrate([make(10_900, 5100, 6200)], forceps), "forceps-2026")
    assert alone.title is not None
    assert alone.title.endswith("calibrated on 1 annotation")
    back = tool.model_copy(update={"name": forceps.name, "title": forceps.title, "links": forceps.links})
    assert back == forceps


def test_what_was_not_measured_stays(make: Make, forceps: ToolSpecification) -> None:
    found = Calibration({"link1": LinkMeasures(length=Measured(4900.0, None, 1))}, 1)
    tool = calibrated_tool(forceps, found, "mine")
    assert [link.length_um for link in tool.links] == [11_000.0, 4900.0, 6000.0]
    assert tool.link("link2") == forceps.link("link2")


@pytest.mark.parametrize("name", ["magnetic-forceps", "", "my forceps", "../forceps"])
def test_a_calibrated_tool_needs_a_name_of_its_own(make: Make, forceps: ToolSpecification, name: str) -> None:
    with pytest.raises(ToolError, match="name"):
        calibrated_tool(forceps, calibrate([make(10_900, 5100, 6200)], forceps), name)


def test_without_a_measurement_there_is_no_calibrated_tool(forceps: ToolSpecification) -> None:
    with pytest.raises(ToolError, match="no finished annotation measures a link"):
        calibrated_tool(forceps, calibrate([], forceps), "mine")


def test_a_study_is_read_whole_and_what_cannot_be_is_told(
    make: Make, forceps: ToolSpecification, tmp_path: Path
) -> None:
    for annotator, volume_id, method in (
        ("anna", "v001", "keypoints"),
        ("anna", "v001", "boxes"),
        ("ben", "v002", "keypoints"),
    ):
        document = make(10_900, 5100, 6200, method=method, annotator=annotator)
        save_annotation(document, annotation_path(tmp_path, annotator, volume_id, method), expected="")
    other = changed(make(10_900, 5100, 6200), tool="scissors", tool_fingerprint=None)
    save_annotation(other, annotation_path(tmp_path, "cleo", "v001", "keypoints"), expected="")
    broken = annotation_path(tmp_path, "ben", "v003", "keypoints")
    broken.write_text("{", encoding="utf-8")

    found = calibrate_study(tmp_path, forceps)

    assert (number_of(found, "link0"), found.documents) == (3, 3)
    first, second = found.skipped
    assert str(broken) in str(first)
    assert "another tool ('scissors')" in str(second)
    assert calibrate_study(tmp_path / "nothing", forceps).documents == 0
    bens = calibrate_study(tmp_path, forceps, "ben")
    assert bens.documents < found.documents
    assert [str(broken) in str(error) for error in bens.skipped] == [True]


def test_a_calibrated_tool_goes_into_the_study(
    make: Make, forceps: ToolSpecification, tmp_path: Path
) -> None:
    tool = calibrated_tool(forceps, calibrate([make(10_900, 5100, 6200)], forceps), "mine")
    write_tool(tool, tmp_path / "tools" / "mine.toml")
    assert load_tool(tmp_path / "tools" / "mine.toml") == tool
