from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from annotations.geometry.body import link_bodies
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis.conditions import PLAIN_CONDITIONS, TRAINING_CONDITIONS, SceneConditions
from annotations.synthesis.grid import Grid
from annotations.synthesis.scanner import Scanner
from annotations.synthesis.scene import Scene, SceneSeed, random_scene
from tests.annotations.synthesis.counted_share import share_out_of_view

FORCEPS = shipped_tools()["magnetic-forceps"]


def scenes(conditions: SceneConditions, count: int = 60) -> list[Scene]:
    return [random_scene(FORCEPS, SceneSeed(7, number), conditions=conditions) for number in range(count)]


def test_nothing_varies_by_default_but_the_pose() -> None:
    for scene in scenes(PLAIN_CONDITIONS, 10):
        assert scene.scanner == Scanner()
        assert scene.clutter == ()
        assert share_out_of_view(scene.pose, FORCEPS, Grid()) == 0


def test_a_scanners_own_figures_stay_where_no_range_is_given() -> None:
    scanner = Scanner(surface_db=30.0, medium_db=1.0)
    conditions = SceneConditions(medium_db=(4.0, 5.0))

    drawn = random_scene(FORCEPS, SceneSeed(1), scanner=scanner, conditions=conditions).scanner

    assert drawn.surface_db == 30.0
    assert 4 <= drawn.medium_db <= 5


@pytest.mark.parametrize(
    "name",
    [
        "attenuation_db_per_mm",
        "surface_db",
        "medium_db",
        "noise_grey",
        "looks",
        "noise_sigma_grey",
        "signal_end_um",
    ],
)
def test_the_scanner_varies_over_the_whole_range(name: str) -> None:
    low, high = getattr(TRAINING_CONDITIONS, name)

    drawn = [getattr(scene.scanner, name) for scene in scenes(TRAINING_CONDITIONS)]

    assert low <= min(drawn) < low + 0.2 * (high - low)
    assert high - 0.2 * (high - low) < max(drawn) <= high


def test_few_different_noises_are_drawn_because_each_is_worked_out_once() -> None:
    noises = {scene.scanner.noise for scene in scenes(TRAINING_CONDITIONS, 300)}

    assert 50 < len(noises) <= 11 * 13


def test_the_chosen_share_of_the_scenes_has_up_to_the_chosen_share_of_the_tool_out_of_view() -> None:
    conditions = SceneConditions(out_of_view_probability=0.5, largest_out_of_view_share=0.3)

    shares = np.array([share_out_of_view(scene.pose, FORCEPS, Grid()) for scene in scenes(conditions, 100)])

    assert 0.35 < np.mean(shares > 0) < 0.65
    assert 0.25 < shares.max() <= 0.3 + 1e-3
    assert np.median(shares[shares > 0]) == pytest.approx(0.15, abs=0.06)


def test_the_tool_leaves_the_volume_beside_it_and_never_through_its_depth() -> None:
    plain, moved = (
        scenes(SceneConditions(out_of_view_probability=probability), 20) for probability in (0.0, 1.0)
    )

    for before, after in zip(plain, moved, strict=True):
        assert after.pose.position_um[2] == before.pose.position_um[2]
        assert after.pose.position_um[:2] != before.pose.position_um[:2]
        assert after.pose.angles_deg == before.pose.angles_deg


def test_a_wider_tilt_is_used() -> None:
    def tilt_deg(scene: Scene) -> float:
        axis = link_bodies(scene.pose, FORCEPS)["link0"].axes[:, 0]
        return float(np.degrees(np.arcsin(abs(axis[2]))))

    assert max(map(tilt_deg, scenes(PLAIN_CONDITIONS, 40))) <= 15
    # A long tool that is tilted much further has no room above the signal's end.
    assert 17 < max(map(tilt_deg, scenes(SceneConditions(largest_tilt_deg=30.0), 80))) <= 30


def test_a_seed_gives_the_same_scene_and_no_choice_depends_on_another() -> None:
    alone = random_scene(FORCEPS, SceneSeed(3), conditions=SceneConditions(clutter=(3, 3)))
    again = random_scene(FORCEPS, SceneSeed(3), conditions=SceneConditions(clutter=(3, 3)))
    noisier = random_scene(
        FORCEPS, SceneSeed(3), conditions=SceneConditions(clutter=(3, 3), surface_db=(10.0, 60.0))
    )

    for other in (again, noisier):
        assert other.pose == alone.pose
        for one, two in zip(alone.clutter, other.clutter, strict=True):
            np.testing.assert_array_equal(one.center_um, two.center_um)
            np.testing.assert_array_equal(one.half_size_um, two.half_size_um)
    assert noisier.scanner != alone.scanner


@pytest.mark.parametrize(
    "wrong",
    [
        {"out_of_view_probability": 1.2},
        {"out_of_view_probability": "0.5"},
        {"clutter": [3, 1]},
        {"clutter": [0, 1.5]},
        {"clutter": [-1, 1]},
        {"clutter_size_um": [0, 10]},
        {"looks": [0, 2]},
        {"surface_db": [50, 40]},
        {"surface_db": [float("nan"), 40]},
        {"noise_sigma_grey": [0, 400]},
        {"largest_tilt_deg": 91},
        {"tilt": 10},
    ],
)
def test_impossible_conditions_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        SceneConditions.model_validate(wrong)


def test_conditions_can_be_written_and_read_again() -> None:
    written = TRAINING_CONDITIONS.model_dump(mode="json", exclude_none=True)

    assert SceneConditions.model_validate(written) == TRAINING_CONDITIONS
