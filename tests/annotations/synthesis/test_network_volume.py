from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from annotations.geometry import rotations
from annotations.geometry.kinematics import ToolPose
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.grid import FULL_SHAPE, REALTIME_SHAPE, Grid
from annotations.synthesis.network_volume import network_volume
from annotations.synthesis.scanner import Scanner
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from annotations.synthesis.volume_file import write_volume
from annotations.volumes import open_volume
from annotations.volumes.sampling import OMES_SAMPLING, PUBLISHED_SAMPLING, Sampling, sample_volume

FORCEPS = shipped_tools()["magnetic-forceps"]
# Columns as close together as voxels are, so that all of a small block's look alike.
BLOCK = ToolSpecification.model_validate(
    {
        "schema": "oct-tool/1",
        "name": "block",
        "keypoints": [{"name": "a"}, {"name": "b"}],
        "links": [
            {
                "name": "block",
                "base": "a",
                "tip": "b",
                "length_um": 40_000.0,
                "cross_section_um": (40_000.0, 20_000.0),
                "color": "#112233",
            }
        ],
    }
)
COLUMNS = (40, 50)


def columns(
    top_um: float, tilt_deg: float = 0.0, scanner: Scanner | None = None, *, is_averaged: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Return what a network sees of many columns on a slope, and what it is to see; shape (n, 83) each."""
    grid = Grid((*COLUMNS, FULL_SHAPE[2]))
    sampling = OMES_SAMPLING.model_copy(
        update={
            "shape": (*COLUMNS, 83),
            "spacing_um": (*grid.spacing_um[:2], OMES_SAMPLING.spacing_um[2]),
            "is_averaged": is_averaged,
        }
    )
    rotation = rotations.about_axis((1, 0, 0), tilt_deg)
    # The middle of the upper face lies over the middle of the columns.
    down_um = rotations.matrix(rotation)[:, 2] * 10_000
    middle_um = np.array([grid.axis_um(0).mean(), grid.axis_um(1).mean(), top_um]) + down_um
    scene = Scene(BLOCK, ToolPose(tuple(middle_um), rotation), SceneSeed(3), grid, scanner or Scanner())
    return network_volume(scene, sampling).reshape(-1, 83), sampled(scene, sampling).reshape(-1, 83)


def sampled(scene: Scene, sampling: Sampling) -> np.ndarray:
    planes = np.stack(list(scene.planes())).astype(np.float32)
    starts = np.arange(0, scene.grid.shape[2], 14)
    if not sampling.is_averaged:
        return planes[..., starts]
    return np.add.reduceat(planes, starts, axis=2) / np.diff(np.append(starts, scene.grid.shape[2]))


SCANNERS = {
    "noisy": Scanner(noise_sigma_grey=6.0, looks=1.0),
    "dark": Scanner(noise_grey=10.0, looks=3.5),
}
SURFACES = {
    "nothing": (90_000.0, 0.0),
    "flat, mid-sample": (2040.0, 0.0),
    "flat, between samples": (1975.0, 0.0),
    "oblique": (2600.0, 40.0),
    "steep": (3000.0, 75.0),
    "grazing": (3000.0, 86.0),
    "near the signal's end": (5600.0, 10.0),
    "beyond it": (7000.0, 0.0),
}


@pytest.mark.parametrize(
    ("surface", "scanner"),
    [
        *(pytest.param(surface, Scanner(), id=name) for name, surface in SURFACES.items()),
        *(pytest.param(SURFACES["oblique"], scanner, id=name) for name, scanner in SCANNERS.items()),
    ],
)
def test_means_and_spreads_at_every_depth_are_those_of_the_sampled_volume(
    surface: tuple[float, float], scanner: Scanner
) -> None:
    made, full = columns(*surface, scanner)

    # One voxel stands for all but around the surface: too few only where the signal ends under a bright one.
    tolerance_grey = 1.5 if surface == SURFACES["near the signal's end"] else 0.9
    np.testing.assert_allclose(made.mean(axis=0), full.mean(axis=0), atol=tolerance_grey)
    np.testing.assert_allclose(made.std(axis=0), full.std(axis=0), rtol=0.1)


@pytest.mark.parametrize("surface", [SURFACES["nothing"], SURFACES["oblique"]])
def test_single_voxels_are_drawn_like_those_of_the_volume(surface: tuple[float, float]) -> None:
    made, full = columns(*surface, SCANNERS["noisy"], is_averaged=False)

    np.testing.assert_array_equal(made, np.round(made))
    np.testing.assert_allclose(made.mean(axis=0), full.mean(axis=0), atol=2.2)
    np.testing.assert_allclose(made.std(axis=0), full.std(axis=0), rtol=0.1)


def test_the_tails_are_those_of_the_sampled_volume() -> None:
    made, full = columns(*SURFACES["nothing"])
    shares = (0.001, 0.01, 0.99, 0.999)

    np.testing.assert_allclose(np.quantile(made, shares), np.quantile(full, shares), atol=0.7)


@pytest.mark.parametrize("sampling", [OMES_SAMPLING, PUBLISHED_SAMPLING])
def test_samples_lie_where_those_of_a_volume_lie(tmp_path: Path, sampling: Sampling) -> None:
    coarse = Grid.over_workspace((28, 139, 1152))
    # Hardly any noise, so that only a shift by a sample could make a difference.
    scanner = replace(Scanner(), looks=1e4)
    scene = random_scene(FORCEPS, SceneSeed(8), coarse, scanner)
    write_volume(scene, tmp_path / "v.npy")
    with open_volume(tmp_path / "v.npy") as volume:
        spacing_um = (coarse.spacing_um[0], coarse.spacing_um[1], coarse.spacing_um[2])
        coarser = sampling.model_copy(update={"spacing_um": (*spacing_um[:2], sampling.spacing_um[2])})
        full = sample_volume(volume, spacing_um, coarser)

    made = network_volume(scene, coarser)

    assert made.dtype == full.dtype
    assert np.abs(made - full).max() < 5
    assert np.mean(np.abs(made - full) > 1) < 0.01
    assert full.max() - full.min() > 100


@pytest.mark.parametrize(
    ("count", "spacing_um"), [(600, 9.31), (40, 14 * 9.4)], ids=["cells without a voxel", "half the depth"]
)
def test_depths_that_no_published_sampling_has_are_seen_like_those_of_a_volume(
    tmp_path: Path, count: int, spacing_um: float
) -> None:
    grid = Grid.over_workspace((12, 60, FULL_SHAPE[2]))
    scene = random_scene(FORCEPS, SceneSeed(8), grid, replace(Scanner(), looks=1e4))
    sampling = Sampling(shape=(12, 60, count), spacing_um=(*grid.spacing_um[:2], spacing_um))
    write_volume(scene, tmp_path / "v.npy")
    with open_volume(tmp_path / "v.npy") as volume:
        full = sample_volume(volume, grid.spacing_um, sampling)

    made = network_volume(scene, sampling)

    assert np.isfinite(made).all()
    assert np.abs(made - full).max() < 5
    # Of a single voxel the noise that is left is seen, and that it is whole.
    assert np.mean(np.abs(made - full) > 2) < 0.01


def test_full_and_real_time_volumes_are_seen_alike() -> None:
    full, live = (
        network_volume(random_scene(FORCEPS, SceneSeed(5), Grid.over_workspace(shape)), OMES_SAMPLING)
        for shape in (FULL_SHAPE, REALTIME_SHAPE)
    )

    # The planes are at most half of a full volume's voxel apart, 8 µm.
    assert np.mean(np.abs(full - live) < 5) > 0.98


def test_samples_beyond_the_volumes_end_are_empty() -> None:
    scene = random_scene(FORCEPS, SceneSeed(5), Grid((500, 1000, 600)))

    samples = network_volume(scene, OMES_SAMPLING)

    assert not samples[13:].any()
    assert not samples[:, 72:].any()
    assert not samples[:, :, 43:].any()
    assert samples[:13, :72, :43].all()


def test_a_seed_gives_the_same_samples_and_another_seed_others() -> None:
    first, again, other = (
        network_volume(random_scene(FORCEPS, SceneSeed(2, number)), OMES_SAMPLING) for number in (0, 0, 1)
    )

    np.testing.assert_array_equal(first, again)
    assert np.mean(first != other) > 0.9


def test_another_depth_axis_is_refused() -> None:
    with pytest.raises(ValueError, match="axis 2"):
        network_volume(
            random_scene(FORCEPS, SceneSeed(2)), OMES_SAMPLING.model_copy(update={"depth_axis": 0})
        )
