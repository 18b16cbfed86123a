import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.geometry.angles import angle_deg
from annotations.geometry.frames import Vector, um_to_voxel, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import about_axis, quaternion
from annotations.geometry.targets import PoseTargets, pose_targets
from annotations.geometry.tool import ToolSpecification

BENT: dict[str, Vector] = {
    "k0": (0.0, 0.0, 0.0),
    "k1": (11_000.0, 0.0, 0.0),
    "k2": (11_200.0, 0.0, 0.0),
    "k3": (11_200.0 + 3_000.0, 3_000.0, 0.0),
    "k4": (14_300.0, 3_100.0, 0.0),
    "k5": (14_300.0, 3_100.0 + 6_000.0, 0.0),
}

poses = st.builds(
    ToolPose,
    st.tuples(*[st.floats(-30_000, 30_000)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda values: math.hypot(*values) > 1e-3).map(quaternion),
    st.fixed_dictionaries({"theta1": st.floats(-90, 90), "theta2": st.floats(0, 90)}),
)


def test_the_published_formulas(forceps: ToolSpecification) -> None:
    found = pose_targets(BENT, forceps)
    assert found.position_um == (5500.0, 0.0, 0.0)
    assert found.orientation == (1.0, 0.0, 0.0)
    assert found.angles_deg == pytest.approx({"theta1": 45.0, "theta2": 45.0}, abs=1e-12)


def test_without_hinge_axes_no_angle_has_a_sign(forceps: ToolSpecification) -> None:
    assert pose_targets(BENT, forceps).signed_angles_deg == {}
    assert set(pose_targets(BENT, forceps, {"theta2": (0.0, 0.0, 1.0)}).signed_angles_deg) == {"theta2"}
    assert pose_targets(BENT, forceps, {"theta1": (0.0, 0.0, 0.0)}).signed_angles_deg == {}


def test_the_sense_of_the_hinge_is_the_sign_of_the_angle(forceps: ToolSpecification) -> None:
    up, down = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
    found = pose_targets(BENT, forceps, {"theta1": up, "theta2": down})
    assert found.signed_angles_deg == pytest.approx({"theta1": 45.0, "theta2": -45.0}, abs=1e-12)


@given(pose=poses, axis=st.sampled_from([0, 1, 2]))
def test_a_mirror_flips_signed_angles_and_leaves_the_others(
    forceps: ToolSpecification, pose: ToolPose, axis: int
) -> None:
    mirror = np.ones(3)
    mirror[axis] = -1
    hinges = {"theta1": (0.48, 0.6, 0.64), "theta2": (0.0, 0.8, -0.6)}
    in_the_mirror = {name: vector(mirror * hinge) for name, hinge in hinges.items()}
    positions_um = keypoints_um(pose, forceps)
    before = pose_targets(positions_um, forceps, hinges)
    after = pose_targets(
        {name: vector(mirror * position_um) for name, position_um in positions_um.items()},
        forceps,
        in_the_mirror,
    )
    assert after.angles_deg == pytest.approx(before.angles_deg, abs=1e-9)
    for name, turn_deg in before.signed_angles_deg.items():
        assert math.remainder(after.signed_angles_deg[name] + turn_deg, 360) == pytest.approx(0, abs=1e-9)


@given(turn_deg=st.floats(-180, 180))
def test_the_roll_of_a_straight_tool_is_in_no_target(forceps: ToolSpecification, turn_deg: float) -> None:
    along = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    rolled = ToolPose((0.0, 0.0, 0.0), about_axis((1, 0, 0), turn_deg))
    assert pose_targets(keypoints_um(rolled, forceps), forceps) == pose_targets(
        keypoints_um(along, forceps), forceps
    )


@pytest.mark.parametrize(
    ("missing", "expected"),
    [
        ({"k0"}, (False, False, {"theta2"})),
        ({"k1"}, (False, False, {"theta2"})),
        ({"k2"}, (True, True, set())),
        ({"k3"}, (True, True, set())),
        ({"k4"}, (True, True, {"theta1"})),
        ({"k5"}, (True, True, {"theta1"})),
        ({"k0", "k5"}, (False, False, set())),
        (set(BENT), (False, False, set())),
    ],
)
def test_without_its_keypoints_a_target_is_absent(
    forceps: ToolSpecification, missing: set[str], expected: tuple[bool, bool, set[str]]
) -> None:
    known = {name: position_um for name, position_um in BENT.items() if name not in missing}
    found = pose_targets(known, forceps)
    assert (found.position_um is not None, found.orientation is not None, set(found.angles_deg)) == expected
    whole = pose_targets(BENT, forceps)
    for name in found.angles_deg:
        assert found.angles_deg[name] == whole.angles_deg[name]


def test_keypoints_in_one_place_have_no_direction(forceps: ToolSpecification) -> None:
    found = pose_targets(BENT | {"k1": BENT["k0"]}, forceps)
    assert found.position_um == BENT["k0"]
    assert found.orientation is None
    assert set(found.angles_deg) == {"theta2"}


def test_a_tool_has_the_targets_that_it_declares(
    needle: ToolSpecification, nine_keypoints: ToolSpecification
) -> None:
    found = pose_targets({"tip": (10.0, 20.0, 30.0), "shaft": (10.0, 20.0, 80.0)}, needle)
    assert found == PoseTargets((10.0, 20.0, 30.0), (0.0, 0.0, -1.0), {}, {})
    hub = {f"mark{index}": (0.0, 0.0, 0.0) for index in range(1, 8)} | {"hub": (0.0, 4.0, 3.0)}
    found = pose_targets(hub | {"tip": (0.0, 0.0, 0.0)}, nine_keypoints)
    assert found.position_um == (0.0, 0.0, 0.0)
    assert found.orientation == pytest.approx((0.0, -0.8, -0.6))
    bead = ToolSpecification.model_validate(
        {"schema": "oct-tool/1", "name": "bead", "keypoints": [{"name": "centre"}]}
    )
    assert pose_targets({"centre": (1.0, 2.0, 3.0)}, bead) == PoseTargets()


def test_keypoints_that_the_tool_does_not_know_change_nothing(forceps: ToolSpecification) -> None:
    assert pose_targets(BENT | {"k9": (1.0, 2.0, 3.0)}, forceps) == pose_targets(BENT, forceps)


def test_voxel_indices_would_give_other_angles(forceps: ToolSpecification) -> None:
    upright = {name: (x, z, y) for name, (x, y, z) in BENT.items()}
    in_voxels = {
        name: vector(um_to_voxel(position_um, (15.9, 13.5, 9.4))) for name, position_um in upright.items()
    }
    assert pose_targets(upright, forceps).angles_deg["theta1"] == pytest.approx(45.0)
    assert pose_targets(in_voxels, forceps).angles_deg["theta1"] == pytest.approx(
        math.degrees(math.atan(15.9 / 9.4))
    )


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1e3, 1e150])
def test_the_unit_of_length_matters_to_the_position_alone(forceps: ToolSpecification, scale: float) -> None:
    scaled = {name: vector(np.multiply(scale, position_um)) for name, position_um in BENT.items()}
    found, expected = pose_targets(scaled, forceps), pose_targets(BENT, forceps)
    assert found.position_um == pytest.approx((5500.0 * scale, 0.0, 0.0))
    assert found.orientation == pytest.approx(expected.orientation)
    assert found.angles_deg == pytest.approx(expected.angles_deg)


def test_the_bias_of_the_unsigned_angle_is_reported_as_it_is(forceps: ToolSpecification) -> None:
    """With 0.2 mm of noise along each axis a straight joint reads 5.3° (links of 5 and 6 mm), not 0°."""
    noise = np.random.default_rng(seed=5)
    straight = keypoints_um(ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), forceps)
    read = [
        pose_targets(
            {name: vector(position_um + noise.normal(0, 200, 3)) for name, position_um in straight.items()},
            forceps,
        ).angles_deg["theta2"]
        for _ in range(2000)
    ]
    assert min(read) > 0
    assert np.mean(read) == pytest.approx(5.3, abs=0.2)


def test_the_orientation_is_the_direction_from_base_to_tip(forceps: ToolSpecification) -> None:
    found = pose_targets({"k0": (1.0, 2.0, 3.0), "k1": (4.0, 2.0, 7.0)}, forceps)
    assert found.orientation == pytest.approx((0.6, 0.0, 0.8))
    assert found.orientation is not None
    assert angle_deg(found.orientation, (3.0, 0.0, 4.0)) == pytest.approx(0, abs=1e-9)
