import errno
import math
import os
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from annotations.durable_files import SaveError
from annotations.errors import Cancelled, UserError
from annotations.geometry.body import link_bodies
from annotations.geometry.frames import voxel_to_um
from annotations.synthesis.conditions import SceneConditions
from annotations.synthesis.grid import Grid
from annotations.synthesis.mask_file import mask_planes, write_mask
from annotations.synthesis.mesh_tool import MeshTool, read_mesh_tool
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from tests.annotations.synthesis.stl_files import FORCEPS, write_configurations, write_links

SMALL = Grid.over_workspace((60, 90, 50))
FINE = Grid.over_workspace((100, 150, 80))


def scene_in(grid: Grid, mesh: MeshTool | None = None, seed: int = 1, **conditions: object) -> Scene:
    return random_scene(FORCEPS, SceneSeed(seed), grid, conditions=SceneConditions(**conditions), mesh=mesh)


def mask_of(scene: Scene) -> NDArray[np.uint8]:
    return np.stack(list(mask_planes(scene)))


def distances_um(scene: Scene) -> list[NDArray[np.float64]]:
    """Return how far each voxel is from each link as the specification describes it, in its order."""
    positions_um = voxel_to_um(np.moveaxis(np.indices(scene.grid.shape), 0, -1), scene.grid.spacing_um)
    bodies = link_bodies(scene.pose, scene.tool)
    return [bodies[link.name].distance_um(positions_um) for link in scene.tool.links]


def first_within(scene: Scene) -> NDArray[np.uint8]:
    """Return the number of the first link that each voxel is in, 0 where it is in none."""
    inside = np.array(distances_um(scene)) <= 0
    return np.where(inside.any(axis=0), inside.argmax(axis=0) + 1, 0).astype(np.uint8)


@pytest.fixture(scope="module")
def links(tmp_path_factory: pytest.TempPathFactory) -> MeshTool:
    return read_mesh_tool(FORCEPS, write_links(tmp_path_factory.mktemp("links")), 1000.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_voxel_has_the_number_of_the_first_link_that_it_is_in(seed: int) -> None:
    scene = scene_in(SMALL, seed=seed)

    mask = mask_of(scene)

    assert mask.dtype == np.uint8
    assert set(np.unique(mask)) == {0, 1, 2, 3}
    np.testing.assert_array_equal(mask, first_within(scene))


def test_where_links_overlap_the_first_has_the_voxels() -> None:
    # Folded up, the forceps' last link lies in the one before.
    scene = scene_in(SMALL)
    folded = replace(scene, pose=replace(scene.pose, angles_deg={"theta1": 0.0, "theta2": 180.0}))
    both = np.logical_and(*[distance_um <= 0 for distance_um in distances_um(folded)[1:]])

    assert both.any()
    assert not (mask_of(folded)[both] == 3).any()


def test_what_is_out_of_view_is_cut_off_and_nothing_else() -> None:
    seen = scene_in(SMALL)
    moved_um = np.array([0, 30, 0]) * SMALL.spacing_um
    pose = replace(seen.pose, position_um=tuple(np.array(seen.pose.position_um) + moved_um))

    whole, cut = mask_of(seen), mask_of(replace(seen, pose=pose))

    np.testing.assert_array_equal(cut[:, 30:], whole[:, :-30])
    assert whole[:, -30:].any()


def test_with_all_of_it_out_of_view_a_mask_is_empty() -> None:
    scene = scene_in(SMALL)

    assert not mask_of(replace(scene, pose=replace(scene.pose, position_um=(9e4, 9e4, 9e4)))).any()


def test_clutter_is_no_part_of_the_tool() -> None:
    scene = scene_in(SMALL, clutter=(5, 5))

    assert len(scene.clutter) == 5
    np.testing.assert_array_equal(mask_of(scene), mask_of(replace(scene, clutter=())))


def test_meshes_give_the_mask_of_the_bodies_that_they_are_of_within_a_voxel(links: MeshTool) -> None:
    scene = scene_in(SMALL, links)
    analytic, meshed = mask_of(replace(scene, mesh=None)), mask_of(scene)

    # Edges are sharp in the meshes and rounded in the bodies, by less than a voxel here.
    differs = analytic != meshed
    assert 0 < np.count_nonzero(differs) < np.count_nonzero(analytic) / 4
    nearest_um = np.abs(distances_um(scene)).min(axis=0)
    assert nearest_um[differs].max() < min(SMALL.spacing_um)


def test_links_have_the_volumes_of_their_meshes(links: MeshTool) -> None:
    scene = scene_in(FINE, links)
    counts = np.bincount(mask_of(scene).ravel(), minlength=4)[1:]
    inside = np.array(distances_um(scene)) <= 0

    for index, link in enumerate(FORCEPS.links):
        width, height = link.cross_section_um
        expected_um3 = link.length_um * width * height * (math.pi / 4 if link.is_round else 1)
        given_up = np.count_nonzero(inside[index] & inside[:index].any(axis=0))
        assert (counts[index] + given_up) * np.prod(FINE.spacing_um) == pytest.approx(expected_um3, rel=0.01)


def test_a_mesh_of_the_whole_tool_is_shared_out_to_the_nearest_links(tmp_path: Path) -> None:
    mesh = read_mesh_tool(FORCEPS, write_configurations(tmp_path, (-35, 50)), 1000.0)
    scene = scene_in(SMALL, mesh)
    nearest = np.argmin(distances_um(scene), axis=0) + 1

    mask = mask_of(scene)

    assert set(np.unique(mask)) == {0, 1, 2, 3}
    np.testing.assert_array_equal(mask[mask > 0], nearest[mask > 0])


def test_more_links_than_a_mask_can_tell_apart_are_refused() -> None:
    scene = scene_in(SMALL)
    many = FORCEPS.model_copy(update={"links": FORCEPS.links * 86})

    with pytest.raises(UserError, match="258 links, and a mask tells 255 apart"):
        next(mask_planes(replace(scene, tool=many)))


def test_the_file_holds_the_planes(empty_folder: Path) -> None:
    scene = scene_in(SMALL)
    shares: list[float] = []

    write_mask(scene, empty_folder / "masks" / "v001.npy", shares.append)

    written = np.load(empty_folder / "masks" / "v001.npy")
    assert written.flags.c_contiguous
    np.testing.assert_array_equal(written, mask_of(scene))
    assert shares == pytest.approx(np.arange(1, 61) / 60)


def test_cancelling_leaves_nothing_behind(empty_folder: Path) -> None:
    shares: list[float] = []

    with pytest.raises(Cancelled):
        write_mask(scene_in(SMALL), empty_folder / "v.npy", shares.append, lambda: len(shares) == 4)

    assert len(shares) == 4
    assert list(empty_folder.iterdir()) == []


def test_a_full_disk_is_told_and_leaves_nothing_behind(
    empty_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)

    with pytest.raises(SaveError, match=os.strerror(errno.ENOSPC)):
        write_mask(scene_in(SMALL), empty_folder / "v.npy")

    assert list(empty_folder.iterdir()) == []


def test_a_large_mask_needs_little_memory(empty_folder: Path) -> None:
    shape = (160, 484, 576)
    scene = scene_in(Grid.over_workspace(shape))
    tracemalloc.start()
    try:
        write_mask(scene, empty_folder / "v.npy")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert peak < math.prod(shape) / 2
