from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from annotations.errors import Cancelled
from annotations.fitting.surface_samples import SurfaceSamples, depth_last, surface_samples
from annotations.geometry import rotations
from annotations.geometry.body import surface_from_above
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import Grid, Scene, SceneSeed
from annotations.volumes import Volume, open_volume

FORCEPS = shipped_tools()["magnetic-forceps"]
GRID = Grid.over_workspace((110, 190, 230))
SCENE = Scene(
    FORCEPS,
    ToolPose((9000.0, 12000.0, 3500.0), rotations.along((0.8, 0.6, 0.05), 20), {"theta1": 20, "theta2": 30}),
    SceneSeed(1),
    GRID,
)
BODIES = list(SCENE.bodies.values())
REACH_UM = 800.0


@pytest.fixture(scope="module")
def voxels() -> np.ndarray:
    return np.stack(list(SCENE.planes()))


def saved(folder: Path, voxels: np.ndarray) -> Volume:
    np.save(folder / "volume.npy", voxels)
    return open_volume(folder / "volume.npy")


def samples_of(volume: Volume, **wishes: Any) -> SurfaceSamples:
    asked = {"progress": lambda _share: None, "cancelled": lambda: False} | wishes
    with volume:
        return surface_samples(volume, GRID.spacing_um, BODIES, REACH_UM, **asked)


def true_depth_um(samples: SurfaceSamples) -> np.ndarray:
    return np.min([body.first_hit(*samples.across_um.T).depth_um for body in BODIES], axis=0)


def test_surfaces_are_found_where_they_are(tmp_path: Path, voxels: np.ndarray) -> None:
    found = samples_of(saved(tmp_path, voxels))

    depth_um = true_depth_um(found)
    struck = np.isfinite(depth_um)
    both = struck & found.found
    errors_um = found.depth_um[both] - depth_um[both]
    assert found.found[struck].mean() > 0.8
    assert np.abs(np.median(errors_um)) < GRID.spacing_um[2] / 2
    assert np.quantile(np.abs(errors_um), 0.9) < 1.5 * GRID.spacing_um[2]
    assert found.positions_um.shape == (found.found.sum(), 3)


def test_beside_the_tool_hardly_any_are_found(tmp_path: Path, voxels: np.ndarray) -> None:
    found = samples_of(saved(tmp_path, voxels))

    assert found.found[~np.isfinite(true_depth_um(found))].mean() < 0.05


def test_columns_cover_the_tool_and_what_is_in_reach(tmp_path: Path, voxels: np.ndarray) -> None:
    across_um = samples_of(saved(tmp_path, voxels)).across_um

    around = [replace(body, half_size_um=body.half_size_um + REACH_UM) for body in BODIES]
    wide = surface_from_above(around, GRID.axis_um(0), GRID.axis_um(1)).depth_um
    index = np.rint(across_um / GRID.spacing_um[:2]).astype(int)
    assert np.isfinite(wide[tuple(index.T)]).all()
    assert len(np.unique(index, axis=0)) == len(index) >= 0.99 * np.isfinite(wide).sum()


def test_brightness_further_above_than_the_reach_does_not_count(tmp_path: Path, voxels: np.ndarray) -> None:
    covered = voxels.copy()
    covered[:, :, :4] = 255
    plain = samples_of(saved(tmp_path, voxels))

    found = samples_of(saved(tmp_path, covered))

    lower = plain.found & (plain.depth_um > REACH_UM + 600)
    assert lower.sum() > 1000
    np.testing.assert_allclose(found.depth_um[lower], plain.depth_um[lower], atol=GRID.spacing_um[2])


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.float32, np.float64])
def test_any_type_and_scale_of_intensities_will_do(
    tmp_path: Path, voxels: np.ndarray, dtype: type[np.generic]
) -> None:
    scaled = voxels if dtype == np.uint8 else (voxels.astype(np.float64) * 3 - 300).clip(0).astype(dtype)

    found = samples_of(saved(tmp_path, scaled))

    errors_um = found.depth_um[found.found] - true_depth_um(found)[found.found]
    assert np.median(np.abs(errors_um)) < GRID.spacing_um[2]


def test_what_is_no_number_does_not_shine(tmp_path: Path, voxels: np.ndarray) -> None:
    holed = voxels.astype(np.float32) - 400
    rng = np.random.default_rng(0)
    for bad in (np.nan, np.inf, -np.inf):
        holed[tuple(rng.integers(0, size, 500) for size in holed.shape)] = bad

    found = samples_of(saved(tmp_path, holed))

    expected = samples_of(saved(tmp_path, voxels))
    assert np.mean(found.found == expected.found) > 0.95


def test_no_more_than_a_part_of_the_volume_is_read(tmp_path: Path, voxels: np.ndarray) -> None:
    volume = saved(tmp_path, voxels)
    read: list[int] = []
    storage = volume._storage

    class Counting(type(storage)):  # type: ignore[misc]
        def __init__(self) -> None:
            pass

        def read(self, region: tuple[slice, slice, slice]) -> np.ndarray:
            values: np.ndarray = storage.read(region)
            read.append(values.size)
            return values

        def prefetch(self, region: tuple[slice, slice, slice]) -> None:
            pass

        def close(self) -> None:
            storage.close()

    samples_of(replace(volume, _storage=Counting()))

    assert len(read) > 5
    assert sum(read) < voxels.size / 3


def test_a_volume_that_is_too_shallow_shows_nothing(tmp_path: Path) -> None:
    assert not samples_of(saved(tmp_path, np.full((110, 190, 2), 90, np.uint8))).found.any()


def test_it_stops_when_asked(tmp_path: Path, voxels: np.ndarray) -> None:
    with pytest.raises(Cancelled):
        samples_of(saved(tmp_path, voxels), cancelled=lambda: True)


@pytest.mark.parametrize("depth_axis", [0, 1, 2])
def test_axes_that_end_with_depth_mirror_nothing(depth_axis: int) -> None:
    order = depth_last(depth_axis)

    assert order[2] == depth_axis
    assert np.linalg.det(np.eye(3)[list(order)]) == pytest.approx(1)
