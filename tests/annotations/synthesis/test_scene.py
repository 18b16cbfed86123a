import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.body import link_bodies
from annotations.geometry.frames import voxel_to_um
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import Grid
from annotations.synthesis.scene import Scene, SceneSeed, random_scene

FORCEPS = shipped_tools()["magnetic-forceps"]
SMALL = Grid.over_workspace((20, 31, 27))


def whole(scene: Scene) -> np.ndarray:
    return np.stack(list(scene.planes()))


@given(st.integers(0, 2**64), st.integers(0, 1000))
def test_the_same_seed_gives_the_same_volume(series: int, number: int) -> None:
    seed = SceneSeed(series, number)

    first, again = (whole(random_scene(FORCEPS, seed, SMALL)) for _ in range(2))

    assert first.shape == SMALL.shape
    assert first.dtype == np.uint8
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("other", [SceneSeed(8, 3), SceneSeed(7, 4)])
def test_another_seed_gives_another_pose_and_other_speckle(other: SceneSeed) -> None:
    first = random_scene(FORCEPS, SceneSeed(7, 3), SMALL)
    second = random_scene(FORCEPS, other, SMALL)

    assert first.pose.position_um != second.pose.position_um
    same_pose = Scene(FORCEPS, first.pose, other, SMALL)
    assert np.mean(whole(same_pose) != whole(first)) > 0.8


@given(st.integers(0, 19), st.integers(0, 100))
def test_a_plane_made_alone_is_that_of_the_whole_volume(index: int, number: int) -> None:
    scene = random_scene(FORCEPS, SceneSeed(1, number), SMALL)

    np.testing.assert_array_equal(scene.plane(index), whole(scene)[index])


def test_no_two_planes_have_the_same_speckle() -> None:
    volume = whole(random_scene(FORCEPS, SceneSeed(1), SMALL))

    assert len({plane[:, -3:].tobytes() for plane in volume}) == len(volume)


def test_grids_of_different_fineness_show_the_same_scene() -> None:
    coarse = random_scene(FORCEPS, SceneSeed(2, 5), SMALL)
    fine = random_scene(FORCEPS, SceneSeed(2, 5), Grid.over_workspace((40, 62, 54)))

    assert coarse.pose == fine.pose
    np.testing.assert_allclose(coarse.surface.depth_um, fine.surface.depth_um[::2, ::2], atol=0.01)


@given(st.integers(0, 1000))
def test_the_brightest_voxels_lie_on_the_body_facing_the_scanner(number: int) -> None:
    grid = Grid.over_workspace((55, 97, 115))
    scene = random_scene(FORCEPS, SceneSeed(3, number), grid)
    volume = whole(scene)
    # What returns the most light: columns whose surface turns towards the scanner.
    turned = np.argwhere(scene.surface.facing > 0.8)
    brightest = volume[turned[:, 0], turned[:, 1]].argmax(axis=1)
    positions_um = voxel_to_um(np.column_stack([turned, brightest]), grid.spacing_um)
    distance_um = np.min(
        [body.distance_um(positions_um) for body in link_bodies(scene.pose, FORCEPS).values()], axis=0
    )

    assert np.median(np.abs(distance_um)) < grid.spacing_um[2]
    # Speckle makes another voxel the brightest here and there, but none above the surface.
    assert np.quantile(distance_um, 0.99) < 1.5 * grid.spacing_um[2]


def test_below_the_tool_lies_its_shadow() -> None:
    grid = Grid.over_workspace((55, 97, 115))
    scene = random_scene(FORCEPS, SceneSeed(3, 1), grid)
    volume = whole(scene).astype(float)
    z_um = grid.axis_um(2)
    depth = scene.surface.depth_um[..., None]
    in_shadow = np.isfinite(depth) & (z_um > depth + 2500) & (z_um < 5500)
    beside = ~np.isfinite(depth) & (z_um > 4000) & (z_um < 5500)

    assert volume[in_shadow].mean() < volume[np.broadcast_to(beside, volume.shape)].mean()


def test_beyond_the_signals_end_there_is_noise_alone() -> None:
    scene = random_scene(FORCEPS, SceneSeed(3, 1), SMALL)
    volume = whole(scene).astype(float)
    beyond = volume[..., SMALL.axis_um(2) > scene.scanner.signal_end_um + 600]
    struck = np.isfinite(scene.surface.depth_um)

    assert beyond[struck].mean() == pytest.approx(beyond[~struck].mean(), abs=1.5)
