from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from annotations.volumes import Volume, open_volume, snap_to_edge, snap_to_maximum

SPACING_UM = (15.9, 13.5, 9.4)
SHAPE = (30, 32, 40)


def saved(folder: Path, array: np.ndarray) -> Volume:
    np.save(folder / "v.npy", array)
    return open_volume(folder / "v.npy")


def index_grids() -> list[np.ndarray]:
    return np.meshgrid(*(np.arange(length, dtype=np.float64) for length in SHAPE), indexing="ij")


@given(st.tuples(*[st.floats(10, length - 11) for length in SHAPE]), st.tuples(*[st.floats(-30, 30)] * 3))
@settings(max_examples=30, deadline=None)
def test_a_blob_is_found_between_the_voxels(
    tmp_path_factory: pytest.TempPathFactory,
    place: tuple[float, float, float],
    off_um: tuple[float, float, float],
) -> None:
    squared = sum((grid - at) ** 2 for grid, at in zip(index_grids(), place, strict=True))
    volume = saved(tmp_path_factory.mktemp("blob"), 200 * np.exp(-squared / (2 * 2.0**2)))
    expected = np.multiply(place, SPACING_UM)
    found = snap_to_maximum(volume, SPACING_UM, expected + off_um, 80.0)
    assert np.abs((found - expected) / SPACING_UM).max() < 0.1


@given(st.integers(0, 2), st.floats(12, 18), st.booleans(), st.floats(-20, 20))
@settings(max_examples=30, deadline=None)
def test_an_edge_is_found_between_the_voxels(
    tmp_path_factory: pytest.TempPathFactory, axis: int, edge: float, falling: bool, off_um: float
) -> None:
    """A step blurred over some voxels, as a scanner blurs it."""
    across = np.tanh((index_grids()[axis] - edge) / 1.5) * (-1 if falling else 1)
    volume = saved(tmp_path_factory.mktemp("edge"), 100 + 50 * across)
    start = np.multiply((15.0, 16.0, 20.0), SPACING_UM)
    start[axis] = edge * SPACING_UM[axis] + off_um
    found = snap_to_edge(volume, SPACING_UM, start, 60.0)
    assert abs(found[axis] / SPACING_UM[axis] - edge) < 0.1
    along = [other for other in range(3) if other != axis]
    # Along the edge there is nothing to choose: the nearest voxel's place is kept.
    assert np.abs(np.subtract(found, start)[along] / np.array(SPACING_UM)[along]).max() <= 0.5001


def test_an_edge_of_a_slanting_plane_is_found_across_it(tmp_path: Path) -> None:
    normal = np.array([0.48, 0.6, 0.64])
    positions = np.stack(index_grids(), axis=-1) * SPACING_UM
    middle = np.multiply((15.3, 16.4, 19.6), SPACING_UM)
    volume = saved(tmp_path, 100 + 50 * np.tanh((positions - middle) @ normal / 25.0))
    found = snap_to_edge(volume, SPACING_UM, middle + 20 * normal, 60.0)
    assert abs((found - middle) @ normal) < 0.5


def test_one_bright_speckle_does_not_win(tmp_path: Path) -> None:
    grids = index_grids()
    squared = sum((grid - 15) ** 2 for grid in grids)
    array = 120 * np.exp(-squared / (2 * 2.0**2))
    array[15, 15, 22] = 255
    found = snap_to_maximum(saved(tmp_path, array), SPACING_UM, np.multiply(15, SPACING_UM), 90.0)
    np.testing.assert_allclose(found, np.multiply(15, SPACING_UM), atol=3)


def test_what_is_not_a_number_is_dark_among_decibels(tmp_path: Path) -> None:
    grids = index_grids()
    squared = sum((grid - 15) ** 2 for grid in grids)
    array = -80 + 60 * np.exp(-squared / (2 * 2.0**2))
    array[12:14, 12:14, 12:14] = np.nan
    found = snap_to_maximum(saved(tmp_path, array), SPACING_UM, np.multiply(14, SPACING_UM), 60.0)
    np.testing.assert_allclose(found, np.multiply(15, SPACING_UM), atol=8)


@pytest.mark.parametrize("snap", [snap_to_maximum, snap_to_edge])
@pytest.mark.parametrize("value", [0, 77])
def test_a_constant_volume_leaves_the_position(tmp_path: Path, snap, value: int) -> None:
    volume = saved(tmp_path, np.full(SHAPE, value, np.uint8))
    assert snap(volume, SPACING_UM, (100.5, 90.25, 80.0), 50.0) == (100.5, 90.25, 80.0)


@pytest.mark.parametrize("snap", [snap_to_maximum, snap_to_edge])
def test_far_outside_the_volume_nothing_moves(tmp_path: Path, snap) -> None:
    volume = saved(tmp_path, np.random.default_rng(0).random(SHAPE))
    assert snap(volume, SPACING_UM, (-5000.0, 90.0, 9e6), 50.0) == (-5000.0, 90.0, 9e6)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("snap", [snap_to_maximum, snap_to_edge])
@pytest.mark.parametrize("shape", [(1, 9, 9), (9, 1, 9), (1, 1, 9), (1, 1, 1)])
def test_thin_volumes_and_strange_values_do_no_harm(
    tmp_path: Path, snap, shape: tuple[int, int, int]
) -> None:
    array = np.random.default_rng(3).random(shape).astype(np.float32)
    array.ravel()[::4] = np.nan
    array.ravel()[1::4] = np.inf
    found = snap(saved(tmp_path, array), (622.0, 13.5, 9.4), (10.0, 50.0, 40.0), 60.0)
    assert np.isfinite(found).all()


def test_a_radius_less_than_the_spacing_searches_the_neighbours(tmp_path: Path) -> None:
    array = np.zeros((8, 40, 40))
    array[4, 20:22, 20:22] = 100.0
    found = snap_to_maximum(saved(tmp_path, array), (622.0, 13.5, 9.4), (4.4 * 622, 270.0, 180.0), 50.0)
    assert abs(found[0] - 4 * 622) < 622 / 4


@pytest.mark.parametrize("snap", [snap_to_maximum, snap_to_edge])
@given(seed=st.integers(0, 100), start=st.tuples(*[st.floats(0, 400)] * 3), radius_um=st.floats(20, 100))
@settings(max_examples=20, deadline=None)
def test_a_snap_goes_no_further_than_its_radius(
    tmp_path_factory: pytest.TempPathFactory,
    snap,
    seed: int,
    start: tuple[float, float, float],
    radius_um: float,
) -> None:
    volume = saved(tmp_path_factory.mktemp("random"), np.random.default_rng(seed).random(SHAPE))
    found = snap(volume, SPACING_UM, start, radius_um)
    # A voxel's place within the radius, and at most half a voxel to either side of it.
    assert np.linalg.norm(np.subtract(found, start)) <= radius_um + np.linalg.norm(SPACING_UM) / 2
