from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry import rotations
from annotations.geometry.body import link_bodies, surface_from_above
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import mesh_tool as module
from annotations.synthesis.grid import Grid
from annotations.synthesis.mesh_file import MeshError
from annotations.synthesis.mesh_tool import MeshTool, read_mesh_tool
from tests.annotations.synthesis.stl_files import (
    FORCEPS,
    link_shapes,
    without,
    write_configurations,
    write_links,
    write_stl,
)

NEEDLE = shipped_tools()["needle"]
GRID = Grid.over_workspace((40, 60, 40))


def random_pose(seed: int) -> ToolPose:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(6000, 11000), rng.uniform(10000, 16000)
    angles_deg = {"theta1": rng.uniform(-90, 90), "theta2": rng.uniform(0, 90)}
    return ToolPose((x, y, 5000.0), rotations.quaternion(rng.normal(size=4)), angles_deg)


# By a seed, so that no outline runs along columns: there, 24 bits decide what is met.
poses = st.builds(random_pose, st.integers(0, 10**6))


@pytest.fixture(scope="module")
def links(tmp_path_factory: pytest.TempPathFactory) -> MeshTool:
    return read_mesh_tool(FORCEPS, write_links(tmp_path_factory.mktemp("links")), 1000.0)


@pytest.fixture(scope="module")
def configurations(tmp_path_factory: pytest.TempPathFactory) -> MeshTool:
    folder = tmp_path_factory.mktemp("configurations")
    return read_mesh_tool(FORCEPS, write_configurations(folder, (-30, 45), (0, 0), (60, 20)), 1000.0)


@given(poses)
def test_meshes_of_the_links_stand_where_the_analytic_bodies_do(links: MeshTool, pose: ToolPose) -> None:
    exact, meshes = link_bodies(pose, FORCEPS), links.bodies(pose)

    assert meshes.keys() == exact.keys()
    for name, body in exact.items():
        distance_um = body.distance_um(meshes[name].mesh.vertices_um)
        # Sharp edges lie outside of rounded ones.
        assert distance_um.max() < body.edge_um
        assert distance_um.min() > -1


@given(poses)
def test_a_mesh_for_the_configuration_shows_what_those_of_the_links_show(
    links: MeshTool, configurations: MeshTool, pose: ToolPose
) -> None:
    there = configurations.nearest_pose(pose)

    ours, theirs = (
        surface_from_above(meshes.bodies(there).values(), GRID.axis_um(0), GRID.axis_um(1))
        for meshes in (configurations, links)
    )

    assert configurations.bodies(pose).keys() == {"magnetic-forceps"}
    apart = ~np.isclose(ours.depth_um, theirs.depth_um, atol=0.1)
    # Files hold 24 bits of a number: a column at the very outline may pass on either side.
    assert apart.sum() <= 1


def test_the_nearest_configuration_is_what_is_true(configurations: MeshTool) -> None:
    pose = ToolPose((1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5), {"theta1": -14.9, "theta2": 24.0})

    assert configurations.nearest_pose(pose) == ToolPose(
        (1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5), {"theta1": -30.0, "theta2": 45.0}
    )
    assert configurations.nearest_pose(ToolPose((0, 0, 0), (1, 0, 0, 0))).angles_deg == {
        "theta1": 0.0,
        "theta2": 0.0,
    }


def test_random_angles_are_those_of_the_configurations(configurations: MeshTool) -> None:
    rng = np.random.default_rng(1)
    drawn = [tuple(configurations.angles_deg(rng).values()) for _ in range(300)]

    assert set(drawn) == {(-30, 45), (0, 0), (60, 20)}
    assert min(drawn.count(angles) for angles in set(drawn)) > 70


def test_random_angles_of_links_are_anything_within_the_limits(links: MeshTool) -> None:
    rng = np.random.default_rng(1)
    drawn = np.array([list(links.angles_deg(rng).values()) for _ in range(300)])

    low, high = np.array([joint.limits_deg for joint in FORCEPS.joints]).T
    assert np.all((drawn >= low) & (drawn <= high))
    assert np.all(np.ptp(drawn, axis=0) > 0.9 * (high - low))
    pose = ToolPose((1, 2, 3), (1, 0, 0, 0), {"theta1": 12.34})
    assert links.nearest_pose(pose) == pose


def test_a_configurations_mesh_is_read_when_it_is_needed_and_then_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write_configurations(tmp_path, (0, 0), (10, 0), (20, 0))
    read: list[str] = []
    really = module.read_mesh
    monkeypatch.setattr(module, "read_mesh", lambda path, unit: read.append(path.name) or really(path, unit))
    tool = MeshTool.per_configuration(FORCEPS, folder, 1000.0)
    at = [ToolPose((0, 0, 0), (1, 0, 0, 0), {"theta1": angle}) for angle in (0, 10, 20)]

    assert read == []
    for index in (1, 1, 0, 1):
        tool.bodies(at[index])
    assert read == ["theta1_10_theta2_0.stl", "theta1_0_theta2_0.stl"]

    # With room for one and a half, the one that was used last stays.
    triangles = len(tool.bodies(at[0])["magnetic-forceps"].mesh.triangles)
    monkeypatch.setattr(module, "_MOST_KEPT", 1.5 * triangles)
    tool.bodies(at[2])
    del read[:]
    for index in (2, 0):
        tool.bodies(at[index])
    assert read == ["theta1_0_theta2_0.stl"]


def test_configurations_outside_the_limits_do_not_occur(tmp_path: Path) -> None:
    tool = MeshTool.per_configuration(FORCEPS, write_configurations(tmp_path, (0, 0), (0, -10)), 1000.0)

    assert tool.nearest_pose(ToolPose((0, 0, 0), (1, 0, 0, 0), {"theta2": -10.0})).angles_deg["theta2"] == 0


def test_what_was_mended_is_told(tmp_path: Path) -> None:
    write_links(tmp_path)
    write_stl(without(link_shapes()["link2"], 0), tmp_path / "link2.stl")

    tool = read_mesh_tool(FORCEPS, tmp_path, 1000.0)

    assert list(tool.repairs) == [tmp_path / "link2.stl"]
    assert "holes filled with 1 triangles" in tool.repairs[tmp_path / "link2.stl"][0]


def test_a_tool_without_joints_has_a_mesh_of_its_link(tmp_path: Path) -> None:
    shape = trimesh.creation.box((2, 0.5, 0.5)).apply_translation((1, 0, 0))
    tool = read_mesh_tool(NEEDLE, write_stl(shape, tmp_path / "needle.STL").parent, 1000.0)

    body = tool.bodies(ToolPose((5000, 5000, 5000), (1, 0, 0, 0)))["needle"]

    assert body.bounds_um()[0] == pytest.approx([4000, 4750, 4750])
    assert body.bounds_um()[1] == pytest.approx([6000, 5250, 5250])


def test_a_link_without_a_mesh_is_told(tmp_path: Path) -> None:
    (write_links(tmp_path) / "link1.stl").unlink()

    with pytest.raises(MeshError, match="no mesh for link1"):
        read_mesh_tool(FORCEPS, tmp_path, 1000.0)


def test_a_name_that_is_no_links_is_told(tmp_path: Path) -> None:
    (write_links(tmp_path) / "link1.stl").rename(tmp_path / "jaw.stl")

    with pytest.raises(MeshError, match="no link of that name; its links are link0, link1, link2") as caught:
        read_mesh_tool(FORCEPS, tmp_path, 1000.0)

    assert caught.value.where == tmp_path / "jaw.stl"


@pytest.mark.parametrize(
    "name", ["theta1_0.stl", "theta2_0_theta1_0.stl", "theta1_0_theta2_x.stl", "theta1_0_theta2_0 (2).stl"]
)
def test_a_name_that_says_no_angles_is_told(tmp_path: Path, name: str) -> None:
    write_configurations(tmp_path, (0, 0))
    (tmp_path / name).write_bytes(b"")

    with pytest.raises(MeshError, match="does not say how the joints") as caught:
        read_mesh_tool(FORCEPS, tmp_path, 1000.0)

    assert caught.value.where == tmp_path / name
    assert "theta1_90_theta2_90.stl" in caught.value.remedy


def test_two_files_for_the_same_angles_are_told(tmp_path: Path) -> None:
    write_configurations(tmp_path, (0, 0))
    (tmp_path / "theta1_-0.0_theta2_+0.stl").write_bytes(b"")

    with pytest.raises(MeshError, match="the same angles"):
        read_mesh_tool(FORCEPS, tmp_path, 1000.0)


def test_a_folder_without_meshes_is_told(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="no mesh of the tool"):
        read_mesh_tool(FORCEPS, tmp_path, 1000.0)
    with pytest.raises(MeshError, match="no mesh for needle"):
        read_mesh_tool(NEEDLE, tmp_path, 1000.0)
    with pytest.raises(MeshError, match="could not be read"):
        read_mesh_tool(FORCEPS, tmp_path / "none", 1000.0)


def test_configurations_of_a_tool_without_joints_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="no joints"):
        MeshTool.per_configuration(NEEDLE, tmp_path, 1000.0)


@pytest.mark.parametrize("um_per_unit", [1.0, 1e6])
def test_a_wrong_unit_is_found_by_the_tools_size(tmp_path: Path, um_per_unit: float) -> None:
    with pytest.raises(MeshError, match="where the tool 'magnetic-forceps' has 11 mm") as caught:
        read_mesh_tool(FORCEPS, write_links(tmp_path), um_per_unit)

    assert "how many µm a unit" in caught.value.remedy
