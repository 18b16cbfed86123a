import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.fitting.pose_search import LARGEST_BEND_DEG, PoseSearch
from annotations.fitting.surface_samples import SurfaceSamples
from annotations.geometry import rotations
from annotations.geometry.body import surface_from_above
from annotations.geometry.frames import vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.tool_library import shipped_tools

FORCEPS = shipped_tools()["magnetic-forceps"]
NEEDLE = shipped_tools()["needle"]
POSE = ToolPose(
    (9000.0, 12000.0, 3500.0), rotations.along((0.8, 0.6, 0.05), 20), {"theta1": 20, "theta2": 30}
)


def ideal_samples(pose: ToolPose, step_um: float = 150.0) -> SurfaceSamples:
    """Return what a scanner without faults sees of the tool."""
    search = PoseSearch.about(pose, FORCEPS)
    x_um, y_um = np.arange(0, 20_000, step_um), np.arange(0, 27_000, step_um)
    depth_um = surface_from_above(search.bodies(search.unchanged).values(), x_um, y_um).depth_um
    across_um = np.stack(np.meshgrid(x_um, y_um, indexing="ij"), axis=-1)
    return SurfaceSamples(across_um.reshape(-1, 2), depth_um.ravel())


changes = st.lists(st.floats(-3, 3), min_size=8, max_size=8).map(np.array)


@given(changes)
def test_a_change_is_in_standard_deviations_of_placing_along_the_root_links_axes(change: np.ndarray) -> None:
    search = PoseSearch.about(POSE, FORCEPS)
    pose = search.pose(change)

    axes = rotations.matrix(POSE.rotation_wxyz)
    shift_um = axes.T @ np.subtract(pose.position_um, POSE.position_um)
    assert shift_um == pytest.approx(150 * change[:3], abs=1e-6)
    turn = axes.T @ rotations.matrix(pose.rotation_wxyz)
    assert np.trace(turn) == pytest.approx(1 + 2 * np.cos(np.radians(3 * np.linalg.norm(change[3:6]))))
    bends_deg = [pose.angles_deg["theta1"] - 20, pose.angles_deg["theta2"] - 30]
    assert bends_deg == pytest.approx(4 * change[6:], abs=1e-9)


def test_limits_are_those_of_the_joints_where_they_are_near() -> None:
    search = PoseSearch.about(
        ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), {"theta1": 95.0, "theta2": 3.0}), FORCEPS
    )
    low, high = search.limits

    assert search.start.angles_deg == {"theta1": 90, "theta2": 3}
    assert search.pose(high).angles_deg == pytest.approx({"theta1": 90, "theta2": 3 + LARGEST_BEND_DEG})
    assert search.pose(low).angles_deg == pytest.approx({"theta1": 90 - LARGEST_BEND_DEG, "theta2": 0})


def test_a_tool_without_joints_has_six_changes() -> None:
    search = PoseSearch.about(ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), NEEDLE)

    assert len(search.unchanged) == len(search.limits[0]) == len(search.limits[1]) == 6
    assert search.pose(search.unchanged) == search.start


def test_ideal_samples_lead_back_to_the_pose_that_they_are_of() -> None:
    samples = ideal_samples(POSE)
    search = PoseSearch.about(POSE, FORCEPS)
    true_um = keypoints_um(POSE, FORCEPS)
    returned = 0
    for seed in range(40):
        away = search.pose(np.random.default_rng(seed).uniform(-1, 1, 8))
        back = PoseSearch.about(away, FORCEPS)
        change = back.unchanged
        for reach_um in (1000.0, 1000.0, 600.0, 250.0):
            change, left = back.improved(change, samples, reach_um)
        found_um = keypoints_um(back.pose(change), FORCEPS)
        is_near = all(found_um[name] == pytest.approx(true_um[name], abs=5) for name in true_um)
        returned += is_near and bool(np.all((left > 0) & (left < 0.1)))

    # From one start in a hundred or so, a link settles on its neighbour's samples.
    assert returned >= 39


def test_too_few_samples_change_nothing_and_leave_everything() -> None:
    search = PoseSearch.about(POSE, FORCEPS)
    few = SurfaceSamples(np.tile([9000.0, 12000.0], (5, 1)), np.full(5, 1500.0))

    change, left = search.improved(search.unchanged, few, 1000.0)

    assert not change.any()
    assert np.all(left == 1)
    assert not search.lowered(few, 1000.0).any()


def test_samples_without_a_link_are_those_nearer_to_the_others() -> None:
    samples = ideal_samples(POSE)
    search = PoseSearch.about(POSE, FORCEPS)

    rest = search.without(["link2"], search.unchanged, samples)

    bodies = search.bodies(search.unchanged)
    on_link2 = np.abs(bodies["link2"].distance_um(samples.positions_um)) < 0.01
    assert 0 < on_link2.sum() < len(on_link2) / 2
    assert np.array_equal(
        rest.found,
        samples.found & ~np.isin(np.arange(len(samples.found)), np.flatnonzero(samples.found)[on_link2]),
    )


def test_a_roll_that_no_sample_shows_is_left_open() -> None:
    pose = ToolPose((9000.0, 12000.0, 3500.0), (1.0, 0.0, 0.0, 0.0))
    search = PoseSearch.about(pose, NEEDLE)
    x_um, y_um = (
        pose.position_um[0] + np.arange(-900, 901, 25),
        pose.position_um[1] + np.arange(-240, 241, 20),
    )
    depth_um = surface_from_above(search.bodies(search.unchanged).values(), x_um, y_um).depth_um
    samples = SurfaceSamples(
        np.stack(np.meshgrid(x_um, y_um, indexing="ij"), axis=-1).reshape(-1, 2), depth_um.ravel()
    )

    _, left = search.improved(search.unchanged, samples, 500.0)

    assert left[3] > 0.99
    assert np.all(left[[1, 2, 4, 5]] < 0.1)


@pytest.mark.parametrize("off_um", [-700.0, 400.0])
def test_a_tool_is_lowered_or_raised_to_its_samples(off_um: float) -> None:
    placed = ToolPose(
        vector(np.add(POSE.position_um, (0.0, 0.0, off_um))), POSE.rotation_wxyz, POSE.angles_deg
    )
    search = PoseSearch.about(placed, FORCEPS)

    lowered = search.pose(search.lowered(ideal_samples(POSE), 1000.0))

    assert lowered.position_um == pytest.approx(POSE.position_um, abs=30)
