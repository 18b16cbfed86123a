from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from annotations.documents.annotation import Annotation, VolumeReference
from annotations.documents.checks import check_annotation
from annotations.geometry import rotations
from annotations.geometry.body import LinkBody
from annotations.geometry.kinematics import ToolPose, link_boxes
from annotations.geometry.targets import pose_targets
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.mesh_tool import MeshTool, read_mesh_tool
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.synthesis.truth import truth_annotation, truth_boxes
from tests.annotations.synthesis.stl_files import write_configurations, write_links, write_stl

FORCEPS = shipped_tools()["magnetic-forceps"]
ALONG_Y = rotations.about_axis((0, 0, 1), 90)
# The hinge, the tool's own y, lies across the light: the tool bends up and down.
HINGE_DOWN = rotations.about_axis((0, 0, 1), 90)


def truth_of(scene: Scene) -> Annotation:
    return truth_annotation(scene, reference_of(scene))


def boxes_of(scene: Scene) -> Annotation:
    return truth_boxes(scene, reference_of(scene))


def reference_of(scene: Scene) -> VolumeReference:
    return VolumeReference(
        path="v.npy",
        shape=scene.grid.shape,
        dtype="uint8",
        spacing_um=scene.grid.spacing_um,
        fingerprint="0",
    )


def posed(*position_um: float, rotation: rotations.Quaternion = ALONG_Y, **angles_deg: float) -> Scene:
    x, y, z = position_um
    return Scene(FORCEPS, ToolPose((x, y, z), rotation, angles_deg), SceneSeed(0))


def states(scene: Scene) -> dict[str, str]:
    return {keypoint.name: keypoint.state for keypoint in truth_of(scene).keypoints}


@given(st.integers(0, 2**32))
def test_the_targets_of_the_truth_are_those_of_the_pose(seed: int) -> None:
    scene = random_scene(FORCEPS, SceneSeed(seed))

    targets = pose_targets(truth_of(scene).positions_um, FORCEPS)

    assert targets.position_um == pytest.approx(scene.pose.position_um, abs=1e-9)
    assert targets.orientation == pytest.approx(rotations.matrix(scene.pose.rotation_wxyz)[:, 0], abs=1e-9)
    for name, angle_deg in scene.pose.angles_deg.items():
        assert targets.angles_deg[name] == pytest.approx(abs(angle_deg), abs=1e-9)


@given(st.integers(0, 2**32))
def test_the_truth_is_finished_and_plausible(seed: int) -> None:
    truth = truth_of(random_scene(FORCEPS, SceneSeed(seed)))

    assert truth.status == "done"
    assert truth.annotator == "truth"
    assert {keypoint.source for keypoint in truth.keypoints} == {"synthesized"}
    assert list(check_annotation(truth, FORCEPS)) == []


def test_a_tool_across_the_light_is_seen_whole() -> None:
    assert set(states(posed(8700, 8000, 3000)).values()) == {"placed"}


def test_what_leaves_the_volume_is_out_of_view() -> None:
    found = states(posed(8700, 20000, 3000))

    assert [name for name, state in found.items() if state == "out_of_view"] == ["k3", "k4", "k5"]
    assert [name for name, state in found.items() if state == "placed"] == ["k0", "k1", "k2"]


def test_what_lies_below_the_signals_end_is_occluded() -> None:
    assert set(states(posed(8700, 8000, 8500)).values()) == {"occluded"}


def test_the_lower_end_of_an_upright_link_is_occluded() -> None:
    scene = posed(8700, 8000, 2500, rotation=HINGE_DOWN, theta1=-90.0)
    down = truth_of(scene).positions_um
    assert down["k3"][2] - down["k2"][2] == pytest.approx(5000)

    found = states(scene)

    assert found["k2"] == "placed"
    assert found["k3"] == "occluded"


def test_what_lies_below_another_link_is_occluded() -> None:
    # Bent back by 180° in all, the last link lies below the first.
    folded = FORCEPS.model_copy(
        update={
            "joints": tuple(
                joint.model_copy(update={"limits_deg": (-90.0, 90.0)}) for joint in FORCEPS.joints
            )
        }
    )
    pose = ToolPose((8700, 10000, 2500), HINGE_DOWN, {"theta1": -90.0, "theta2": -90.0})
    found = states(Scene(folded, pose, SceneSeed(0)))

    assert found["k0"] == found["k1"] == "placed"
    assert found["k5"] == "occluded"


def test_what_lies_below_clutter_is_occluded() -> None:
    scene = posed(8700, 8000, 4000)
    first_um = np.array(truth_of(scene).positions_um["k0"])
    block = LinkBody(first_um - [0, 0, 3500], np.eye(3), np.array([1500.0, 1500.0, 700.0]), is_round=False)

    found = states(replace(scene, clutter=(block,)))

    assert [name for name, state in found.items() if state == "occluded"] == ["k0"]


def test_boxes_are_those_of_the_pose() -> None:
    scene = random_scene(FORCEPS, SceneSeed(4))
    document = boxes_of(scene)

    assert document.method == "boxes"
    assert document.status == "done"
    assert {box.source for box in document.boxes} == {"synthesized"}
    assert dict(document.placed_boxes) == link_boxes(scene.pose, FORCEPS)
    assert list(check_annotation(document, FORCEPS)) == []
    keypoints_um = truth_of(scene).positions_um
    for link in FORCEPS.links:
        box = document.placed_boxes[link.name]
        assert box.base_um == pytest.approx(keypoints_um[link.base], abs=1e-6)
        assert box.tip_um == pytest.approx(keypoints_um[link.tip], abs=1e-6)


def test_boxes_say_what_is_out_of_view_and_what_cannot_be_seen() -> None:
    beside = {box.link: box.state for box in boxes_of(posed(8700, 20000, 3000)).boxes}
    deep = {box.state for box in boxes_of(posed(8700, 8000, 8500)).boxes}

    assert list(beside.values()) == ["placed", "out_of_view", "out_of_view"]
    assert deep == {"occluded"}


def test_a_keypoint_at_the_end_of_no_link_stays_unplaced() -> None:
    tool = ToolSpecification.model_validate(
        {
            "schema": "oct-tool/1",
            "name": "rod-and-mark",
            "keypoints": [{"name": "a"}, {"name": "b"}, {"name": "mark"}],
            "links": [
                {
                    "name": "rod",
                    "base": "a",
                    "tip": "b",
                    "length_um": 5000.0,
                    "cross_section_um": (500.0, 500.0),
                    "color": "#112233",
                }
            ],
        }
    )

    truth = truth_of(random_scene(tool, SceneSeed(1)))

    assert truth.keypoint("mark").state == "unplaced"
    assert set(truth.positions_um) == {"a", "b"}
    assert truth.tool_copy == tool


def test_positions_do_not_depend_on_the_grid() -> None:
    fine = random_scene(FORCEPS, SceneSeed(4))
    coarse = random_scene(FORCEPS, SceneSeed(4), Grid.over_workspace((28, 144, 88)))

    np.testing.assert_array_equal(
        list(truth_of(fine).positions_um.values()), list(truth_of(coarse).positions_um.values())
    )


@pytest.mark.parametrize("per_configuration", [False, True], ids=["links", "configuration"])
@pytest.mark.parametrize(
    "plain",
    [
        posed(8700, 8000, 3000, theta1=-90.0),
        posed(8700, 20000, 3000, theta1=-90.0),
        posed(8700, 8000, 8500, theta1=-90.0),
        posed(8700, 8000, 2500, rotation=HINGE_DOWN, theta1=-90.0),
    ],
    ids=["across", "out of view", "deep", "upright"],
)
def test_meshes_hide_what_the_analytic_bodies_hide(
    tmp_path: Path, plain: Scene, per_configuration: bool
) -> None:
    folder = write_configurations(tmp_path, (-90, 0)) if per_configuration else write_links(tmp_path)

    meshed = replace(plain, mesh=read_mesh_tool(FORCEPS, folder, 1000.0))

    assert states(meshed) == states(plain)


def test_what_light_reaches_beside_a_mesh_is_seen_down_to_the_signals_end(tmp_path: Path) -> None:
    needle = shipped_tools()["needle"]
    beside = trimesh.creation.box((2000, 500, 500)).apply_translation((1000, 2000, 0))
    mesh = MeshTool.per_link(needle, {"needle": write_stl(beside, tmp_path / "needle.stl")}, 1.0)
    scene = Scene(needle, ToolPose((8000, 8000, 3000), (1, 0, 0, 0)), SceneSeed(0), mesh=mesh)

    assert set(states(scene).values()) == {"placed"}
    deep = replace(scene, pose=replace(scene.pose, position_um=(8000, 8000, 7000)))
    assert set(states(deep).values()) == {"occluded"}
