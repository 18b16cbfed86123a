"""The pose that fits predicted keypoints, single blunders or not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um
from annotations.geometry.rotations import quaternion
from annotations.geometry.tool_library import shipped_tools
from annotations.prediction.predicted_pose import fit_prediction
from annotations.volumes.sampling import Sampling
from tests.annotations.prediction.known_keypoints import FORCEPS, described, predicted

NEEDLE = shipped_tools()["needle"]
BENT = ToolPose(
    (8700.0, 13000.0, 4000.0), quaternion((0.8, 0.3, -0.4, 0.2)), {"theta1": 35.0, "theta2": 50.0}
)
TRUE_UM = keypoints_um(BENT, FORCEPS)

poses = st.builds(
    ToolPose,
    st.tuples(*[st.floats(-5e3, 2e4)] * 3),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda parts: math.hypot(*parts) > 0.1).map(quaternion),
    st.fixed_dictionaries({"theta1": st.floats(20, 90), "theta2": st.floats(20, 90)}),
)


def moved(position_um: Vector, by_um: Vector) -> Vector:
    return vector(np.add(position_um, by_um))


@given(poses)
@settings(max_examples=15)
def test_exact_keypoints_give_the_pose_and_nothing_is_left_out(pose: ToolPose) -> None:
    true_um = keypoints_um(pose, FORCEPS)

    found = fit_prediction(predicted(true_um), described())

    assert found is not None
    assert found.left_out == ()
    assert found.fit.pose.angles_deg == pytest.approx(pose.angles_deg, abs=0.01)
    for name, position_um in true_um.items():
        assert found.keypoints_um[name] == pytest.approx(position_um, abs=1.0)
        assert found.residuals_um[name] < 1.0


@pytest.mark.parametrize("name", FORCEPS.keypoint_names)
def test_one_keypoint_far_off_is_left_out(name: str) -> None:
    off_um = {**TRUE_UM, name: moved(TRUE_UM[name], (2500.0, -3500.0, 3500.0))}

    found = fit_prediction(predicted(off_um), described())

    assert found is not None
    assert found.left_out == (name,)
    # Where either end of the tool is, nothing else tells.
    told = set(TRUE_UM) - ({name} if name in ("k0", "k5") else set())
    for other in told:
        assert found.keypoints_um[other] == pytest.approx(TRUE_UM[other], abs=1.0)
    if name in told:
        assert found.residuals_um[name] == pytest.approx(math.dist(off_um[name], TRUE_UM[name]), abs=1.0)


def test_two_keypoints_far_off_are_left_out() -> None:
    off_um = TRUE_UM | {
        "k1": moved(TRUE_UM["k1"], (0.0, 5500.0, 0.0)),
        "k4": moved(TRUE_UM["k4"], (3000.0, 0.0, 4000.0)),
    }

    found = fit_prediction(predicted(off_um), described())

    assert found is not None
    assert found.left_out == ("k1", "k4")
    assert found.keypoints_um["k1"] == pytest.approx(TRUE_UM["k1"], abs=1.0)


def test_usual_errors_leave_nothing_out() -> None:
    generator = np.random.default_rng(5)
    for _ in range(10):
        noisy_um = {name: moved(um, generator.normal(0, 200, 3)) for name, um in TRUE_UM.items()}

        found = fit_prediction(predicted(noisy_um), described())

        assert found is not None
        assert found.left_out == ()


def test_four_keypoints_are_the_fewest_that_stay() -> None:
    some_um = {name: TRUE_UM[name] for name in ("k0", "k1", "k2")}
    some_um["k3"] = moved(TRUE_UM["k3"], (0.0, 5500.0, 0.0))

    found = fit_prediction(predicted(some_um), described())

    assert found is not None
    assert found.left_out == ()
    assert found.fit.rms_um > 500


def test_a_wide_heatmap_counts_for_less() -> None:
    off_um = {**TRUE_UM, "k1": moved(TRUE_UM["k1"], (0.0, 600.0, 600.0))}
    sure = fit_prediction(predicted(off_um), described())
    unsure = fit_prediction(predicted(off_um, spread_um={"k1": (3000.0, 3000.0, 3000.0)}), described())

    assert sure is not None
    assert unsure is not None
    apart_um = [math.dist(each.keypoints_um["k1"], TRUE_UM["k1"]) for each in (sure, unsure)]
    assert apart_um[1] < 0.5 * apart_um[0]


def test_what_the_keypoints_do_not_tell_stays_open() -> None:
    found = fit_prediction(predicted({name: TRUE_UM[name] for name in ("k0", "k1")}), described())

    assert found is not None
    assert {"rotation_x_deg", "theta1_deg", "theta2_deg"} <= set(found.fit.open_parameters)
    assert set(found.keypoints_um) == {"k0", "k1"}


@pytest.mark.parametrize("names", [(), ("k0",)])
def test_too_few_keypoints_give_no_pose(names: tuple[str, ...]) -> None:
    assert fit_prediction(predicted({name: TRUE_UM[name] for name in names}), described()) is None


def test_a_tool_of_one_link_is_fitted_too() -> None:
    fine = Sampling(shape=(32, 32, 32), spacing_um=(100.0, 100.0, 50.0))
    about = described(fine, tool=NEEDLE)
    true_um = {"tip": (100.0, 200.0, 300.0), "shaft": (2100.0, 200.0, 300.0)}

    found = fit_prediction(predicted(true_um, about), about)

    assert found is not None
    assert found.keypoints_um["tip"] == pytest.approx(true_um["tip"], abs=1.0)
