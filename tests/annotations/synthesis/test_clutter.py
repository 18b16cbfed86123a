from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.body import LinkBody, link_bodies
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.clutter import random_clutter
from annotations.synthesis.conditions import SceneConditions
from annotations.synthesis.grid import Grid
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scene import SceneSeed, random_scene
from annotations.volumes.sampling import OMES_SAMPLING

FORCEPS = shipped_tools()["magnetic-forceps"]
EXTENT_UM = Grid().extent_um


def inside(body: LinkBody, count: int = 9) -> np.ndarray:
    """Return a grid of positions in µm within a body's box, its sides included."""
    shares = np.linspace(-1, 1, count)
    grid = np.stack(np.meshgrid(shares, shares, shares, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(body.center_um + (grid * body.half_size_um) @ body.axes.T)


@given(st.integers(0, 2**32))
def test_blocks_lie_in_the_volume_clear_of_the_tool(number: int) -> None:
    scene = random_scene(FORCEPS, SceneSeed(number), conditions=SceneConditions(clutter=(4, 4)))

    assert len(scene.clutter) == 4
    tool = list(link_bodies(scene.pose, FORCEPS).values())
    for block in scene.clutter:
        assert np.all((block.center_um >= 0) & (block.center_um <= EXTENT_UM))
        assert block.bounds_um()[0][2] > 0
        assert np.all((block.half_size_um >= 250) & (block.half_size_um <= 3000))
        for link in tool:
            assert link.distance_um(inside(block)).min() > 0
            assert block.distance_um(inside(link)).min() > 0


def test_blocks_lie_close_to_the_tool_as_well_as_far_from_it() -> None:
    gaps = [
        min(link.distance_um(inside(block)).min() for link in link_bodies(scene.pose, FORCEPS).values())
        for number in range(40)
        for scene in [random_scene(FORCEPS, SceneSeed(1, number), conditions=SceneConditions(clutter=(4, 4)))]
        for block in scene.clutter
    ]

    assert min(gaps) < 200
    assert max(gaps) > 5000


def test_as_many_blocks_as_was_asked_for() -> None:
    counts = [
        len(random_scene(FORCEPS, SceneSeed(2, number), conditions=SceneConditions(clutter=(1, 3))).clutter)
        for number in range(40)
    ]

    assert set(counts) == {1, 2, 3}


def test_a_block_that_finds_no_room_is_left_out() -> None:
    everywhere = LinkBody(np.array(EXTENT_UM) / 2, np.eye(3), np.full(3, 1e5), is_round=False)

    assert random_clutter(np.random.default_rng(1), [everywhere], 2, (500.0, 600.0), EXTENT_UM) == ()


def test_blocks_are_seen_and_cast_shadows() -> None:
    plain = random_scene(FORCEPS, SceneSeed(5))
    x_um, y_um = (OMES_SAMPLING.axis_um(axis, plain.grid.spacing_um) for axis in (0, 1))
    free = np.argwhere(~np.isfinite(plain.surface_at(x_um, y_um).depth_um))[200]
    center_um = np.array([x_um[free[0]], y_um[free[1]], 700.0])
    block = LinkBody(center_um, np.eye(3), np.array([400.0, 400.0, 200.0]), is_round=False)
    bare, full = (network_volume(scene, OMES_SAMPLING) for scene in (plain, replace(plain, clutter=(block,))))
    over = (np.abs(x_um - center_um[0]) < 300)[:, None] & (np.abs(y_um - center_um[1]) < 300)
    beside = (np.abs(x_um - center_um[0]) > 401)[:, None] | (np.abs(y_um - center_um[1]) > 401)

    z_um = OMES_SAMPLING.axis_um(2, plain.grid.spacing_um)
    assert over.any()
    assert np.all(np.abs(z_um[full[over].argmax(axis=1)] - 500) < OMES_SAMPLING.spacing_um[2])
    shadow = (z_um > 3000) & (z_um < 4000)
    assert full[over][:, shadow].mean() < bare[over][:, shadow].mean() - 1
    np.testing.assert_allclose(bare[beside], full[beside], atol=0.2)
