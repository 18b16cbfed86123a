import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from annotations.errors import Cancelled, UserError
from annotations.fitting.refine import Refinement, Support, refine_pose
from annotations.geometry import rotations
from annotations.geometry.angles import angle_deg
from annotations.geometry.body import Surface
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool import ToolSpecification
from annotations.geometry.tool_library import shipped_tools
from annotations.synthesis import Grid, Scanner, Scene, SceneSeed, random_scene, write_volume
from annotations.volumes import Volume, open_volume, write_sidecar

FORCEPS = shipped_tools()["magnetic-forceps"]
NEEDLE = shipped_tools()["needle"]
GRID = Grid.over_workspace((110, 190, 170))
FINE = Grid.over_workspace((220, 380, 230))
LEVEL = rotations.along((0.8, 0.6, 0.05), roll_deg=20)


@dataclass(frozen=True)
class Case:
    scene: Scene
    volume: Volume
    start: ToolPose

    def refined(self) -> Refinement:
        return refine_pose(self.volume, self.scene.grid.spacing_um, self.scene.tool, self.start)

    def errors_um(self, pose: ToolPose) -> np.ndarray:
        truth_um, found_um = (keypoints_um(each, self.scene.tool) for each in (self.scene.pose, pose))
        return np.array([math.dist(truth_um[name], found_um[name]) for name in truth_um])


Make = Callable[[Scene], Volume]


@pytest.fixture(scope="module")
def make(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Make]:
    opened: list[Volume] = []

    def volume_of(scene: Scene) -> Volume:
        path = tmp_path_factory.mktemp("scene") / "volume.npy"
        write_volume(scene, path)
        opened.append(open_volume(path))
        return opened[-1]

    yield volume_of
    for volume in opened:
        volume.close()


@pytest.fixture(scope="module")
def cases(make: Make) -> list[Case]:
    made = []
    for number in range(8):
        scene = random_scene(FORCEPS, SceneSeed(5, number), GRID)
        made.append(Case(scene, make(scene), perturbed(scene.pose, FORCEPS, number)))
    return made


@pytest.fixture(scope="module")
def refined(cases: list[Case]) -> list[Refinement]:
    return [case.refined() for case in cases]


@pytest.fixture(scope="module")
def level(make: Make) -> Case:
    pose = ToolPose((9000.0, 12000.0, 3500.0), LEVEL, {"theta1": 20.0, "theta2": 30.0})
    scene = Scene(FORCEPS, pose, SceneSeed(1), GRID)
    return Case(scene, make(scene), shifted(pose, (90.0, -120.0, 60.0)))


def perturbed(pose: ToolPose, tool: ToolSpecification, seed: int) -> ToolPose:
    """Move a pose as an unsteady hand does: by about 150 µm along each axis, 1.5° and 2°."""
    rng = np.random.default_rng(seed)
    turn = rotations.about_axis(rng.normal(size=3), 1.5 * rng.choice([-1, 1]))
    limits = {joint.name: joint.limits_deg for joint in tool.joints}
    return ToolPose(
        vector(np.asarray(pose.position_um) + rng.normal(0, 150, 3)),
        rotations.product(turn, pose.rotation_wxyz),
        {
            name: float(np.clip(angle + 2 * rng.choice([-1, 1]), *limits[name]))
            for name, angle in pose.angles_deg.items()
        },
    )


def shifted(pose: ToolPose, by_um: tuple[float, float, float]) -> ToolPose:
    return replace(pose, position_um=vector(np.add(pose.position_um, by_um)))


def with_surface(scene: Scene, surface: Surface) -> Scene:
    changed = replace(scene)
    vars(changed)["surface"] = surface
    return changed


def emptied(scene: Scene, hidden: np.ndarray | None = None) -> Scene:
    """Return a scene that shows nothing, or nothing where its columns are to be hidden."""
    where = np.ones(scene.grid.shape[:2], bool) if hidden is None else hidden
    surface = scene.surface
    return with_surface(
        scene, Surface(np.where(where, np.inf, surface.depth_um), np.where(where, 0.0, surface.facing))
    )


def test_keypoints_come_much_nearer_to_the_truth(cases: list[Case], refined: list[Refinement]) -> None:
    before_um = np.array([case.errors_um(case.start) for case in cases])
    after_um = np.array([case.errors_um(each.pose) for case, each in zip(cases, refined, strict=True)])

    assert np.median(before_um) > 150
    assert np.median(after_um) < np.median(before_um) / 6
    assert np.all(after_um.mean(axis=1) < before_um.mean(axis=1) / 2)


@pytest.mark.parametrize("target", ["direction", "theta1", "theta2"])
def test_angles_come_nearer_to_the_truth(cases: list[Case], refined: list[Refinement], target: str) -> None:
    def error_deg(pose: ToolPose, truth: ToolPose) -> float:
        if target == "direction":
            first, second = (rotations.matrix(each.rotation_wxyz)[:, 0] for each in (pose, truth))
            return angle_deg(first, second)
        return abs(pose.angles_deg[target] - truth.angles_deg[target])

    before = np.array([error_deg(case.start, case.scene.pose) for case in cases])
    after = np.array(
        [error_deg(each.pose, case.scene.pose) for case, each in zip(cases, refined, strict=True)]
    )

    assert np.sum(after < before) >= 7
    assert np.median(after) < 0.25


def test_the_exact_pose_hardly_moves(cases: list[Case]) -> None:
    for case in cases[:3]:
        moves_um = replace(case, start=case.scene.pose).refined().moves_um

        # Half a voxel along the light, which is the coarsest of what the depths could be known to.
        assert max(moves_um.values()) < GRID.spacing_um[2] / 2 + 5


def test_moves_support_and_distances_are_told(cases: list[Case], refined: list[Refinement]) -> None:
    for case, found in zip(cases, refined, strict=True):
        before_um, after_um = keypoints_um(case.start, FORCEPS), keypoints_um(found.pose, FORCEPS)
        assert found.moves_um == pytest.approx({n: math.dist(before_um[n], after_um[n]) for n in before_um})
        assert set(found.support) == {"link0", "link1", "link2"}
        assert all(0 <= each.found <= each.sought for each in found.support.values())
        assert found.surface_rms_after_um < 30
        assert found.surface_rms_after_um < found.surface_rms_before_um / 2


def test_a_tool_in_full_view_needs_no_remark(level: Case) -> None:
    assert level.refined().remark == ""


@pytest.mark.parametrize("by_deg", [-20.0, 20.0])
def test_a_joint_that_was_placed_far_off_is_found_in_one_go(level: Case, by_deg: float) -> None:
    angles_deg = {"theta1": 20.0, "theta2": 30.0 + by_deg}
    case = replace(level, start=replace(level.start, angles_deg=angles_deg))

    found = case.refined()

    assert case.errors_um(found.pose).max() < 40
    assert found.remark == "It moved far: look whether it lies on the tool."


def test_what_is_not_yet_settled_is_told(level: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("annotations.fitting.refine._MOST_READINGS", 1)

    found = level.refined()

    assert found.remark == "It was moving still: refining again may bring it nearer."


def test_an_unsteady_start_beyond_a_joints_limits_ends_within_them(make: Make) -> None:
    pose = ToolPose((9000.0, 12000.0, 3500.0), LEVEL, {"theta1": 20.0, "theta2": 0.0})
    scene = Scene(FORCEPS, pose, SceneSeed(2), GRID)
    start = replace(pose, angles_deg={"theta1": 20.0, "theta2": -3.0})

    found = Case(scene, make(scene), start).refined().pose

    assert 0 <= found.angles_deg["theta2"] < 0.5
    assert found.angles_deg["theta1"] == pytest.approx(20, abs=0.5)


def test_a_joint_that_is_not_named_is_straight(make: Make) -> None:
    pose = ToolPose((9000.0, 12000.0, 3500.0), LEVEL)
    scene = Scene(FORCEPS, pose, SceneSeed(2), GRID)

    found = Case(scene, make(scene), shifted(pose, (100.0, 0.0, 0.0))).refined().pose

    assert found.angles_deg == pytest.approx({"theta1": 0, "theta2": 0}, abs=0.5)


@pytest.mark.parametrize("shift_um", [(150.0, -150.0, 300.0), (-100.0, 100.0, -400.0)])
def test_a_thin_needle_is_not_drawn_to_its_lower_side(
    make: Make, shift_um: tuple[float, float, float]
) -> None:
    scene = random_scene(NEEDLE, SceneSeed(4, 1), FINE)
    case = Case(scene, make(scene), shifted(scene.pose, shift_um))

    found = case.refined()

    assert case.errors_um(found.pose).max() < 40
    assert "how it is turned about its own axis" in found.remark


def test_what_no_voxel_shows_stays_as_it_was_placed(make: Make) -> None:
    scene = random_scene(NEEDLE, SceneSeed(4, 1), FINE)
    start = replace(
        scene.pose,
        rotation_wxyz=rotations.product(scene.pose.rotation_wxyz, rotations.about_axis((1, 0, 0), 5)),
    )

    found = Case(scene, make(scene), start).refined().pose

    turn = rotations.matrix(start.rotation_wxyz).T @ rotations.matrix(found.rotation_wxyz)
    assert abs(math.degrees(math.atan2(turn[2, 1], turn[1, 1]))) < 0.1


@pytest.mark.parametrize("depth_axis", [0, 1])
def test_depth_may_lie_along_any_axis(level: Case, tmp_path: Path, depth_axis: int) -> None:
    order = np.roll((0, 1, 2), depth_axis + 1)
    voxels = np.ascontiguousarray(level.volume.read((slice(None),) * 3).transpose(order))
    np.save(tmp_path / "turned.npy", voxels)
    spacing = tuple(np.asarray(GRID.spacing_um)[order].tolist())
    write_sidecar(tmp_path / "turned.npy", spacing, depth_axis)
    axes = rotations.from_matrix(np.eye(3)[order])
    start = ToolPose(
        vector(np.asarray(level.start.position_um)[order]),
        rotations.product(axes, level.start.rotation_wxyz),
        level.start.angles_deg,
    )

    with open_volume(tmp_path / "turned.npy") as volume:
        found = refine_pose(volume, spacing, FORCEPS, start)

    expected = level.refined()
    assert found.moves_um == pytest.approx(expected.moves_um, abs=2)
    assert found.pose.position_um == pytest.approx(np.asarray(expected.pose.position_um)[order], abs=2)
    assert found.support == expected.support


def test_the_few_planes_of_a_real_time_volume_are_enough(make: Make) -> None:
    grid = Grid((28, 190, 170), (622.0, *GRID.spacing_um[1:]))
    scene = random_scene(FORCEPS, SceneSeed(6, 2), grid)
    case = Case(scene, make(scene), perturbed(scene.pose, FORCEPS, 2))

    assert case.errors_um(case.refined().pose).max() < 40


def test_links_that_the_specification_has_too_short_spoil_little_else(make: Make) -> None:
    content = FORCEPS.model_dump(by_alias=True)
    for link in content["links"]:
        link["length_um"] -= 200
    shorter = ToolSpecification.model_validate(content)
    scene = random_scene(FORCEPS, SceneSeed(6, 3), GRID)
    case = Case(scene, make(scene), perturbed(scene.pose, FORCEPS, 3))

    found = refine_pose(case.volume, GRID.spacing_um, shorter, case.start).pose

    assert case.errors_um(found)[:2].max() < 250
    assert found.angles_deg == pytest.approx(scene.pose.angles_deg, abs=2.5)


def test_faint_surfaces_are_found_through_the_speckle(make: Make) -> None:
    scene = random_scene(FORCEPS, SceneSeed(6, 4), GRID, Scanner(surface_db=26))
    case = Case(scene, make(scene), perturbed(scene.pose, FORCEPS, 4))

    assert case.errors_um(case.refined().pose).max() < 60


def test_a_link_that_is_not_seen_is_named(level: Case, make: Make) -> None:
    tip_um = keypoints_um(level.scene.pose, FORCEPS)["k4"]
    x_um, y_um = np.meshgrid(GRID.axis_um(0), GRID.axis_um(1), indexing="ij")
    along = rotations.matrix(LEVEL)[:2, 0]
    hidden = (x_um - tip_um[0]) * along[0] + (y_um - tip_um[1]) * along[1] > -1500

    found = Case(level.scene, make(emptied(level.scene, hidden)), level.start).refined()

    assert found.support["link2"].found < 0.05 * found.support["link2"].sought
    assert "link2" in found.remark
    assert "the angle theta2" in found.remark
    assert found.pose.angles_deg["theta2"] == pytest.approx(30, abs=0.5)
    assert found.pose.angles_deg["theta1"] == pytest.approx(20, abs=0.5)


def test_where_nothing_is_bright_a_person_is_told(level: Case, make: Make) -> None:
    case = replace(level, volume=make(emptied(level.scene)))

    with pytest.raises(UserError, match="shows nothing of the tool's surface within 1000 µm"):
        case.refined()


@pytest.mark.parametrize("value", [0, 77])
def test_a_constant_volume_shows_nothing(level: Case, tmp_path: Path, value: int) -> None:
    np.save(tmp_path / "flat.npy", np.full((40, 60, 60), value, np.uint8))

    with open_volume(tmp_path / "flat.npy") as volume, pytest.raises(UserError, match="nothing"):
        refine_pose(volume, (430.0, 430.0, 180.0), FORCEPS, level.start)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("far_um", [-60_000.0, 60_000.0])
def test_a_tool_outside_the_volume_is_told(level: Case, axis: int, far_um: float) -> None:
    away = shifted(level.start, vector(far_um * np.eye(3)[axis]))

    with pytest.raises(UserError, match="nothing of the tool's surface"):
        replace(level, start=away).refined()


def test_a_tool_too_far_from_its_surface_is_told(level: Case) -> None:
    far = shifted(level.scene.pose, (0.0, 0.0, -3000.0))

    with pytest.raises(UserError, match="Bring the tool nearer"):
        replace(level, start=far).refined()


def test_a_tool_without_links_has_no_surface(level: Case) -> None:
    points = ToolSpecification.model_validate(
        {"schema": "oct-tool/1", "name": "points", "keypoints": [{"name": "a"}]}
    )

    with pytest.raises(UserError, match="no links"):
        refine_pose(level.volume, GRID.spacing_um, points, level.start)


@pytest.mark.parametrize("asked", [1, 5, 14])
def test_it_can_be_cancelled_at_any_time(level: Case, asked: int) -> None:
    answers = iter([False] * asked + [True] * 100)

    with pytest.raises(Cancelled):
        refine_pose(level.volume, GRID.spacing_um, FORCEPS, level.start, cancelled=lambda: next(answers))


def test_progress_goes_up_to_all(level: Case) -> None:
    told: list[float] = []

    refine_pose(level.volume, GRID.spacing_um, FORCEPS, level.start, progress=told.append)

    assert told == sorted(told)
    assert 0 < told[0] < 0.2
    assert told[-1] == 1


@pytest.mark.parametrize(
    ("found", "sought", "is_thin"), [(0, 0, True), (14, 14, True), (80, 100, False), (400, 1000, True)]
)
def test_support_is_thin_where_little_is_found(found: int, sought: int, is_thin: bool) -> None:
    assert Support(found, sought).is_thin is is_thin
