"""A click in the scene lands on the instrument: first on what is shown, then at full resolution.

The volumes are synthetic, with speckle, so that the surface that a ray meets is known exactly.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from annotations.geometry.frames import Vector, vector
from annotations.geometry.tool_library import find_tool
from annotations.synthesis import Grid, Scene, SceneSeed, random_scene, write_volume
from annotations.volumes import (
    Level,
    Ray,
    Volume,
    averaged_level,
    intensity_window,
    open_volume,
    strided_preview,
    surface_threshold,
)
from annotator.session.editing.pick_refiner import PickRefiner
from annotator.session.jobs import Jobs
from annotator.session.viewing.placing import depth_along_ray
from annotator.session.viewing.view import View

SHAPE = (219, 387, 230)
RAYS = 60
START_UM = 20_000.0


@dataclass(frozen=True)
class Clicks:
    """A synthetic volume, what the scene shows of it, and rays that meet its tool after 20 mm."""

    volume: Volume
    spacing_um: Vector
    levels: dict[str, Level]
    rays: tuple[Ray, ...]
    views: dict[str, View]


def visible_rays(scene: Scene, rng: np.random.Generator) -> Iterator[Ray]:
    """Yield rays to points on the lit surface, up to 60° from the light, that nothing of the tool hides."""
    depth_um = scene.surface.depth_um
    columns = np.argwhere((depth_um < 5000) & (scene.surface.facing > 0.3))
    approach_um = np.arange(60.0, 15_000.0, 30.0)
    while True:
        x, y = columns[rng.integers(len(columns))]
        target_um = np.array([*np.multiply((x, y), scene.grid.spacing_um[:2]), depth_um[x, y]])
        tilt, turn = rng.uniform(0, np.pi / 3), rng.uniform(0, 2 * np.pi)
        along = np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        before_um = target_um - approach_um[:, None] * along
        if all((body.distance_um(before_um) > 0).all() for body in scene.bodies.values()):
            yield Ray(vector(target_um - START_UM * along), vector(along))


@pytest.fixture(scope="module", params=[3, 4], ids="scene{}".format)
def clicks(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clicks]:
    scene = random_scene(
        find_tool("magnetic-forceps"), SceneSeed(11, request.param), Grid.over_workspace(SHAPE)
    )
    path = tmp_path_factory.mktemp("clicks") / "v001.npy"
    write_volume(scene, path)
    spacing_um = scene.grid.spacing_um
    rays = visible_rays(scene, np.random.default_rng(request.param))
    with open_volume(path) as volume:
        strided = strided_preview(volume, spacing_um)
        averaged = averaged_level(
            volume,
            spacing_um,
            budget_voxels=4_000_000,
            progress=lambda _share: None,
            cancelled=lambda: False,
        )
        low, high = intensity_window(strided)
        yield Clicks(
            volume,
            spacing_um,
            {"strided": strided, "averaged": averaged},
            tuple(next(rays) for _ in range(RAYS)),
            {
                # Within the speckle: a third of the voxels before the tool are brighter.
                "low": View(window=(low, high), opacity_threshold=low + 0.25 * (high - low)),
                "above": View(window=(low, high), opacity_threshold=surface_threshold(strided)),
            },
        )


@pytest.fixture
def jobs(qtbot: QtBot) -> Iterator[Jobs]:
    jobs = Jobs()
    yield jobs
    jobs.close()


@pytest.fixture
def refiner(jobs: Jobs) -> PickRefiner:
    refiner = PickRefiner(jobs)

    def fail(error: Exception) -> None:
        raise error

    refiner.failed.connect(fail)
    return refiner


def refined(
    qtbot: QtBot,
    jobs: Jobs,
    refiner: PickRefiner,
    clicks: Clicks,
    level: Level,
    proposed_um: Vector,
    ray: Ray,
    view: View,
) -> Vector:
    """Return where a click ends: the refined position, or the proposed one where none is found."""
    found: list[Vector] = []
    connection = refiner.ray_refined.connect(lambda _proposed, _ray, position_um: found.append(position_um))
    refiner.refine_ray(clicks.volume, clicks.spacing_um, level.spacing_um, proposed_um, ray, view)
    qtbot.waitUntil(lambda: not jobs.running)
    refiner.ray_refined.disconnect(connection)
    return found[0] if found else proposed_um


def error_um(ray: Ray, position_um: Vector) -> float:
    """Return how far along the ray a position lies behind the true surface."""
    return float(np.subtract(position_um, ray.at(START_UM)) @ ray.direction)


def of_all(errors_um: list[float]) -> tuple[float, float]:
    """Return the median, and what 95 % of the errors stay within."""
    return float(np.median(errors_um)), float(np.percentile(np.abs(errors_um), 95))


# A voxel is 170 µm wide in the strided level, 120 µm in the averaged one, 64 µm in the volume itself. What
# smoothing and the beam's width smear lies before the surface, so that the median is negative.
@pytest.mark.parametrize("threshold", ["low", "above"])
@pytest.mark.parametrize(("kind", "median_um", "most_um"), [("strided", 280, 700), ("averaged", 260, 480)])
def test_clicks_land_on_the_instrument(
    qtbot: QtBot,
    jobs: Jobs,
    refiner: PickRefiner,
    clicks: Clicks,
    threshold: str,
    kind: str,
    median_um: float,
    most_um: float,
) -> None:
    level, view = clicks.levels[kind], clicks.views[threshold]
    coarse_um, fine_um = [], []
    for ray in clicks.rays:
        proposed_um = depth_along_ray(level, ray, view)
        if proposed_um is None:
            continue
        position_um = refined(qtbot, jobs, refiner, clicks, level, proposed_um, ray, view)
        coarse_um.append(error_um(ray, proposed_um))
        fine_um.append(error_um(ray, position_um))
        # A refinement stays on the ray, and near.
        reach_um = 2 / np.max(np.abs(ray.direction) / np.asarray(level.spacing_um))
        assert abs(coarse_um[-1] - fine_um[-1]) <= reach_um + 1e-6
        assert position_um == pytest.approx(ray.at(START_UM + fine_um[-1]), abs=1e-6)
    # A grazed flank may be as faint as speckle; nearly all the tool is there to be clicked.
    assert len(fine_um) >= 0.95 * RAYS
    median, most = of_all(coarse_um)
    assert -median_um < median < 0
    assert most < most_um
    median, most = of_all(fine_um)
    assert -120 < median < 20
    assert most < 320


def test_in_a_projection_the_brightest_place_is_refined(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, clicks: Clicks
) -> None:
    level, view = clicks.levels["averaged"], replace(clicks.views["low"], rendering="mip")
    errors_um = []
    for ray in clicks.rays:
        proposed_um = depth_along_ray(level, ray, view)
        assert proposed_um is not None
        position_um = refined(qtbot, jobs, refiner, clicks, level, proposed_um, ray, view)
        errors_um.append(error_um(ray, position_um))
    median, most = of_all(errors_um)
    # Just below the surface it is brightest.
    assert 0 < median < 150
    assert most < 300


SLAB_SPACING_UM = (15.9, 13.5, 9.4)
SLAB_VIEW = View(window=(0.0, 200.0), opacity_threshold=50.0)
SLAB_TOP_UM = 59.5 * 9.4
DOWN = Ray((320.0, 270.0, -1000.0), (0.0, 0.0, 1.0))


def slab(tmp_path: Path, data: np.ndarray) -> Clicks:
    np.save(tmp_path / "slab.npy", data)
    volume = open_volume(tmp_path / "slab.npy")
    coarse = Level(data[::10, ::10, ::15], (159.0, 135.0, 141.0), (0.0, 0.0, 0.0), "strided", (10, 10, 15))
    return Clicks(volume, SLAB_SPACING_UM, {"strided": coarse}, (DOWN,), {})


@pytest.fixture
def slab_data() -> np.ndarray:
    """Noise below 40, and a slab of 200 from index 60 along axis 2."""
    data = np.random.default_rng(0).integers(0, 40, (41, 41, 120)).astype(np.uint8)
    data[:, :, 60:100] = 200
    return data


def after_refining(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, clicks: Clicks, z_um: float, view: View
) -> float:
    proposed_um = (320.0, 270.0, z_um)
    found = refined(qtbot, jobs, refiner, clicks, clicks.levels["strided"], proposed_um, DOWN, view)
    assert found[:2] == pytest.approx(proposed_um[:2])
    return found[2]


def test_a_bright_voxel_before_the_surface_is_passed(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, tmp_path: Path, slab_data: np.ndarray
) -> None:
    slab_data[20, 20, 45:47] = 255
    found_um = after_refining(qtbot, jobs, refiner, slab(tmp_path, slab_data), SLAB_TOP_UM - 120, SLAB_VIEW)
    assert found_um == pytest.approx(SLAB_TOP_UM, abs=9.4)


def test_the_surface_nearest_to_the_proposal_is_taken(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, tmp_path: Path, slab_data: np.ndarray
) -> None:
    slab_data[:, :, 40:48] = 200
    found_um = after_refining(qtbot, jobs, refiner, slab(tmp_path, slab_data), SLAB_TOP_UM - 50, SLAB_VIEW)
    assert found_um == pytest.approx(SLAB_TOP_UM, abs=9.4)


def test_glare_behind_a_surface_does_not_draw_the_click_through_it(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, tmp_path: Path, slab_data: np.ndarray
) -> None:
    bright = slab_data.astype(np.float32)
    bright[:, :, 70:72] = 5000
    found_um = after_refining(qtbot, jobs, refiner, slab(tmp_path, bright), SLAB_TOP_UM - 30, SLAB_VIEW)
    assert found_um == pytest.approx(SLAB_TOP_UM, abs=9.4)


def test_where_there_is_no_surface_the_proposal_stays(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, tmp_path: Path, slab_data: np.ndarray
) -> None:
    clicks = slab(tmp_path, slab_data)
    # Nothing is bright enough within two coarse voxels, or all of it is, or what is bright is cropped away.
    assert after_refining(qtbot, jobs, refiner, clicks, 200.0, SLAB_VIEW) == 200.0
    clear = replace(SLAB_VIEW, opacity_threshold=-1.0, window=(-10.0, -5.0))
    assert after_refining(qtbot, jobs, refiner, clicks, 500.0, clear) == 500.0
    cropped = replace(SLAB_VIEW, cropping_um=((0.0, 0.0, 0.0), (640.0, 540.0, 540.0)))
    assert after_refining(qtbot, jobs, refiner, clicks, 500.0, cropped) == 500.0


def test_what_is_not_a_number_is_no_surface(
    qtbot: QtBot, jobs: Jobs, refiner: PickRefiner, tmp_path: Path, slab_data: np.ndarray
) -> None:
    strange = slab_data.astype(np.float32)
    strange[:, :, 30:56] = np.nan
    strange[:, :, 56:58] = -np.inf
    found_um = after_refining(qtbot, jobs, refiner, slab(tmp_path, strange), SLAB_TOP_UM - 50, SLAB_VIEW)
    assert found_um == pytest.approx(SLAB_TOP_UM, abs=9.4)


@pytest.mark.parametrize(
    ("spacing_um", "farthest_um"), [((622.0, 13.5, 9.4), 725.0), ((15.9, 13.5, 9.4), 110.0)]
)
def test_snapping_stays_as_near_as_a_person_means(
    qtbot: QtBot,
    jobs: Jobs,
    refiner: PickRefiner,
    tmp_path: Path,
    spacing_um: Vector,
    farthest_um: float,
) -> None:
    """A brighter place two coarse planes away, or 300 µm along a fine axis, is not what was meant."""
    data = np.zeros((28, 120, 120), np.float32)
    data[:, 60:63, 66:69] = 100
    data[:, 60:63, 95:98] = 255
    data[16, 60:63, 66:69] = 255
    np.save(tmp_path / "v.npy", data)
    began_um = vector(np.multiply((14, 60, 64), spacing_um))
    with open_volume(tmp_path / "v.npy") as volume, qtbot.waitSignal(refiner.snapped) as snapped:
        refiner.snap(volume, spacing_um, "k0", began_um, "maximum")
    name, before_um, found_um = snapped.args
    assert (name, before_um) == ("k0", began_um)
    assert found_um[1:] == pytest.approx((61 * spacing_um[1], 67 * spacing_um[2]), abs=9.4)
    assert abs(found_um[0] - began_um[0]) < farthest_um
    assert np.linalg.norm(np.subtract(found_um[1:], began_um[1:])) < 110
