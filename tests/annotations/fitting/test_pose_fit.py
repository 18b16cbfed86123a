import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, kstest

from annotations.documents.annotation import Annotation
from annotations.fitting.evidence import BodyPoint
from annotations.fitting.mistakes import likely_mistakes
from annotations.fitting.pose_fit import ToolFit, fit_document, fit_points
from annotations.geometry import rotations
from annotations.geometry.boxes import Box
from annotations.geometry.frames import Vector, vector
from annotations.geometry.kinematics import ToolPose, keypoints_um, link_boxes
from annotations.geometry.tool import ToolSpecification

Write = Callable[..., Annotation]
Draw = Callable[..., ToolPose]
See = Callable[..., dict[str, Vector]]

STRAIGHT = (1.0, 0.0, 0.0, 0.0)
ALL = (
    "x_um",
    "y_um",
    "z_um",
    "rotation_x_deg",
    "rotation_y_deg",
    "rotation_z_deg",
    "theta1_deg",
    "theta2_deg",
)


def bent(theta1: float, theta2: float) -> ToolPose:
    return ToolPose((7000.0, 8000.0, 3000.0), STRAIGHT, {"theta1": theta1, "theta2": theta2})


def error(fit: ToolFit, truth: ToolPose) -> NDArray[np.float64]:
    """Return how far a fit is from the truth, in the order of all parameters."""
    found, true = (rotations.matrix(pose.rotation_wxyz) for pose in (fit.pose, truth))
    turn_deg = np.degrees(Rotation.from_matrix(found.T @ true).as_rotvec())
    shift_um = np.subtract(truth.position_um, fit.pose.position_um)
    bends_deg = [angle_deg - fit.pose.angles_deg[name] for name, angle_deg in truth.angles_deg.items()]
    return np.concatenate([shift_um, turn_deg, bends_deg])


def kinds(fit: ToolFit | None) -> list[tuple[str, str]]:
    assert fit is not None
    return [(question.kind, question.joint) for question in fit.open_questions]


def test_a_thousand_poses_are_recovered_with_errors_that_match_the_covariance(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(0)
    squares, chi_squares = [], []
    for _ in range(1000):
        # Away from the limits, and from the straight tool that leaves its roll open.
        pose = random_pose(forceps, rng, margin_deg=6.0)
        fit = fit_document(keypoint_document(forceps, noisy(pose, forceps, rng)), forceps)
        assert fit is not None
        assert (fit.parameters, fit.open_parameters, fit.degrees_of_freedom) == (ALL, (), 10)
        chi_squares.append(fit.chi_square)
        if not fit.alternatives:
            off = error(fit, pose)
            squares.append(off @ np.linalg.solve(fit.covariance, off))
            assert np.all(np.abs(off[:3]) < 300)
            assert np.all(np.abs(off[6:]) < 6)
    assert len(squares) > 980
    # Both would be found wrong by a factor of 1.05 in the standard deviations.
    assert kstest(squares, chi2(8).cdf).pvalue > 0.01
    assert kstest(chi_squares, chi2(10).cdf).pvalue > 0.01


def test_exact_points_give_the_exact_pose(
    forceps: ToolSpecification, random_pose: Draw, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        pose = random_pose(forceps, rng, margin_deg=1.0)
        fit = fit_document(keypoint_document(forceps, keypoints_um(pose, forceps)), forceps)
        assert fit is not None
        if any(fit.alternatives):
            # Within noise, the other sense fits as well, though not as exactly.
            assert abs(pose.angles_deg["theta2"]) < 8
        assert np.abs(error(fit, pose)).max() < 1e-3
        assert fit.rms_um < 1e-3
        assert fit.residuals_um.keys() == set(forceps.keypoint_names)


def test_the_fit_moves_with_the_tool(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        seen_um = noisy(random_pose(forceps, rng, margin_deg=10.0), forceps, rng)
        motion, shift_um = Rotation.random(random_state=rng), rng.uniform(-5000, 5000, 3)
        moved_um = {
            name: vector(motion.apply(position_um) + shift_um) for name, position_um in seen_um.items()
        }
        first, second = (
            fit_document(keypoint_document(forceps, positions_um), forceps)
            for positions_um in (seen_um, moved_um)
        )
        assert first is not None
        assert second is not None
        assert second.chi_square == pytest.approx(first.chi_square, rel=1e-6)
        assert second.pose.angles_deg == pytest.approx(first.pose.angles_deg, abs=1e-2)
        for name, position_um in first.keypoints_um.items():
            assert second.keypoints_um[name] == pytest.approx(motion.apply(position_um) + shift_um, abs=0.5)
        turn = np.zeros((8, 8))
        turn[:3, :3], turn[3:, 3:] = motion.as_matrix(), np.eye(5)
        np.testing.assert_allclose(second.covariance, turn @ first.covariance @ turn.T, rtol=1e-2, atol=1.0)


def test_no_fit_within_the_limits_is_better(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        seen_um = noisy(random_pose(forceps, rng), forceps, rng, sigma_um=1500.0)
        document = keypoint_document(forceps, seen_um)
        fit = fit_document(document, forceps)
        assert fit is not None
        for joint in forceps.joints:
            assert joint.limits_deg[0] <= fit.pose.angles_deg[joint.name] <= joint.limits_deg[1]
        for _ in range(5):
            other = fit_document(document, forceps, start=random_pose(forceps, rng))
            assert other is not None
            assert fit.chi_square <= other.chi_square * (1 + 1e-5) + 1e-3


def test_a_joint_that_would_go_beyond_its_limit_stays_there(
    forceps: ToolSpecification, keypoint_document: Write
) -> None:
    fit = fit_document(keypoint_document(forceps, keypoints_um(bent(100.0, 30.0), forceps)), forceps)
    assert fit is not None
    assert fit.pose.angles_deg["theta1"] == 90.0
    assert fit.limits_reached == ("theta1",)
    assert fit.chi_square > 100


def test_residuals_are_distances_from_the_fitted_tool(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    seen_um = noisy(bent(40.0, 50.0), forceps, np.random.default_rng(4))
    del seen_um["k2"]
    fit = fit_document(keypoint_document(forceps, seen_um), forceps)
    assert fit is not None
    assert fit.keypoints_um == keypoints_um(fit.pose, forceps)
    assert fit.residuals_um == pytest.approx(
        {name: math.dist(position_um, fit.keypoints_um[name]) for name, position_um in seen_um.items()}
    )
    assert fit.rms_um == pytest.approx(math.sqrt(np.mean(np.square(list(fit.residuals_um.values())))))


def test_boxes_give_roll_and_signed_angles(
    forceps: ToolSpecification,
    random_pose: Draw,
    noisy_boxes: Callable[..., dict[str, Box]],
    box_document: Write,
) -> None:
    rng = np.random.default_rng(5)
    for index in range(100):
        pose = random_pose(forceps, rng)
        if index % 2:
            pose = bent(float(rng.uniform(-90, 90)), 0.0)
        fit = fit_document(box_document(forceps, noisy_boxes(pose, forceps, rng)), forceps)
        assert fit is not None
        assert (fit.open_questions, fit.alternatives) == ((), ())
        assert np.abs(error(fit, pose)[3:]).max() < 6


def test_exact_boxes_give_the_exact_pose(
    forceps: ToolSpecification, random_pose: Draw, box_document: Write
) -> None:
    rng = np.random.default_rng(6)
    for _ in range(50):
        pose = random_pose(forceps, rng)
        fit = fit_document(box_document(forceps, link_boxes(pose, forceps)), forceps)
        assert fit is not None
        assert np.abs(error(fit, pose)).max() < 1e-3
        assert max(fit.residuals_um.values()) < 1e-3


def test_what_is_unsure_pulls_less(forceps: ToolSpecification, keypoint_document: Write) -> None:
    seen_um = keypoints_um(bent(40.0, 50.0), forceps)
    seen_um["k5"] = vector(np.add(seen_um["k5"], (0.0, 800.0, 0.0)))
    sure, unsure = (
        fit_document(keypoint_document(forceps, seen_um, {"k5": {"certainty": certainty}}), forceps)
        for certainty in ("sure", "unsure")
    )
    assert sure is not None
    assert unsure is not None
    assert unsure.residuals_um["k5"] > 1.2 * sure.residuals_um["k5"]
    assert unsure.standard_deviations["theta2_deg"] > sure.standard_deviations["theta2_deg"]


def test_a_straight_tool_leaves_its_roll_open(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(7)
    told = 0
    for _ in range(100):
        fit = fit_document(keypoint_document(forceps, noisy(bent(0.0, 0.0), forceps, rng)), forceps)
        assert fit is not None
        if kinds(fit) == [("roll", "")]:
            told += 1
            assert fit.open_parameters == ("rotation_x_deg",)
            assert "rotation_x_deg" not in fit.standard_deviations
    # Three standard deviations of bend happen by chance, in two joints and all ways to turn.
    assert told >= 85


def test_a_closed_link_2_leaves_the_sense_of_theta1_open(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(8)
    told = 0
    for theta1 in np.linspace(-85, 85, 50):
        pose = bent(float(theta1), 0.0)
        fit = fit_document(keypoint_document(forceps, noisy(pose, forceps, rng)), forceps)
        assert fit is not None
        if abs(theta1) < 5:
            continue
        told += kinds(fit) == [("sense", "theta1")]
        signs = {math.copysign(1, each.angles_deg["theta1"]) for each in (fit.pose, *fit.alternatives)}
        assert math.copysign(1, theta1) in signs
        for other in fit.alternatives:
            assert other.angles_deg["theta1"] == pytest.approx(-fit.pose.angles_deg["theta1"], abs=4)
            for name, position_um in keypoints_um(other, forceps).items():
                assert math.dist(position_um, fit.keypoints_um[name]) < 300
    assert told >= 44


def test_an_open_link_2_tells_the_sense_of_theta1(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(9)
    for theta1 in (-60.0, -10.0, 10.0, 60.0):
        pose = bent(theta1, 40.0)
        fit = fit_document(keypoint_document(forceps, noisy(pose, forceps, rng)), forceps)
        assert kinds(fit) == []
        assert fit is not None
        assert fit.pose.angles_deg["theta1"] == pytest.approx(theta1, abs=4)


def test_an_unseen_link_2_leaves_theta2_and_the_sense_open(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    seen_um = noisy(bent(40.0, 50.0), forceps, np.random.default_rng(10))
    document = keypoint_document(forceps, {name: seen_um[name] for name in ("k0", "k1", "k2", "k3")})
    fit = fit_document(document, forceps)
    assert kinds(fit) == [("angle", "theta2"), ("sense", "theta1")]
    assert fit is not None
    assert fit.open_parameters == ("theta2_deg",)
    assert fit.pose.angles_deg["theta2"] == 0.0
    turned_over = ToolPose((7000.0, 8000.0, 3000.0), (0.0, 1.0, 0.0, 0.0), {"theta1": -40.0, "theta2": 70.0})
    started = fit_document(document, forceps, start=turned_over)
    assert started is not None
    assert started.pose.angles_deg == pytest.approx({"theta1": -40.0, "theta2": 70.0}, abs=4)


def test_any_subset_gives_what_it_can(
    forceps: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(11)
    for count in (2, 3, 4, 5):
        for _ in range(40):
            pose = random_pose(forceps, rng, margin_deg=5.0)
            seen_um = noisy(pose, forceps, rng)
            names = [str(name) for name in rng.permutation(forceps.keypoint_names)[:count]]
            fit = fit_document(keypoint_document(forceps, {name: seen_um[name] for name in names}), forceps)
            if fit is None:
                assert all({link.base, link.tip} - set(names) for link in forceps.links)
                continue
            assert set(fit.residuals_um) == set(names)
            assert max(fit.residuals_um.values()) < 400
            assert set(fit.parameters) | set(fit.open_parameters) == set(ALL)
            asked = {kind for kind, _ in kinds(fit)}
            assert bool(fit.open_parameters) <= bool(asked & {"roll", "angle", "direction", "place"})
            variances = np.linalg.eigvalsh(fit.covariance)
            assert np.all(variances > 0)


def test_one_link_alone_leaves_the_rest_open(forceps: ToolSpecification, keypoint_document: Write) -> None:
    seen_um = keypoints_um(bent(20.0, 30.0), forceps)
    root = fit_document(keypoint_document(forceps, {name: seen_um[name] for name in ("k0", "k1")}), forceps)
    assert kinds(root) == [("roll", ""), ("angle", "theta1"), ("angle", "theta2")]
    middle = fit_document(keypoint_document(forceps, {name: seen_um[name] for name in ("k2", "k3")}), forceps)
    assert {kind for kind, _ in kinds(middle)} == {"place", "direction", "roll", "angle"}
    assert middle is not None
    assert max(middle.residuals_um.values()) < 1e-3


@pytest.mark.parametrize("names", [(), ("k0",), ("k1", "k2"), ("k0", "k5")])
def test_nothing_is_fitted_to_points_that_tell_no_direction(
    forceps: ToolSpecification, keypoint_document: Write, names: tuple[str, ...]
) -> None:
    seen_um = keypoints_um(bent(20.0, 30.0), forceps)
    assert fit_document(keypoint_document(forceps, {name: seen_um[name] for name in names}), forceps) is None


def test_two_keypoints_at_one_place_are_no_direction(
    forceps: ToolSpecification, keypoint_document: Write
) -> None:
    one = {"k0": (1.0, 2.0, 3.0), "k1": (1.0, 2.0, 3.0)}
    assert fit_document(keypoint_document(forceps, one), forceps) is None


def test_a_needle_is_fitted_but_for_its_roll(
    needle: ToolSpecification, random_pose: Draw, noisy: See, keypoint_document: Write
) -> None:
    rng = np.random.default_rng(12)
    for _ in range(20):
        pose = random_pose(needle, rng)
        fit = fit_document(keypoint_document(needle, noisy(pose, needle, rng)), needle)
        assert kinds(fit) == [("roll", "")]
        assert fit is not None
        direction, truth = (rotations.matrix(each.rotation_wxyz)[:, 0] for each in (fit.pose, pose))
        assert math.degrees(math.acos(min(1.0, direction @ truth))) < 10
        # Two ends with 50 µm each: the middle has 35 µm, and a direction over 2 mm has 2°.
        assert fit.standard_deviations == pytest.approx(
            {"x_um": 35.4, "y_um": 35.4, "z_um": 35.4, "rotation_y_deg": 2.03, "rotation_z_deg": 2.03},
            rel=0.01,
        )


def test_the_start_decides_between_equals(forceps: ToolSpecification, keypoint_document: Write) -> None:
    document = keypoint_document(forceps, keypoints_um(bent(40.0, 0.0), forceps))
    turned_over = ToolPose((7000.0, 8000.0, 3000.0), (0.0, 1.0, 0.0, 0.0), {"theta1": -40.0, "theta2": 0.0})
    for start, theta1 in ((bent(35.0, 2.0), 40.0), (turned_over, -40.0)):
        fit = fit_document(document, forceps, start=start)
        assert fit is not None
        assert fit.pose.angles_deg["theta1"] == pytest.approx(theta1, abs=1e-3)
        (other,) = fit.alternatives
        assert other.angles_deg["theta1"] == pytest.approx(-theta1, abs=1e-3)


def test_both_ends_of_a_whole_turn_are_one_pose(
    forceps: ToolSpecification, noisy: See, keypoint_document: Write
) -> None:
    fields = forceps.model_dump(mode="json")
    fields["joints"] = [fields["joints"][0] | {"limits_deg": [-180.0, 180.0]}]
    fields["links"], fields["targets"]["angles"] = fields["links"][:2], []
    folding = ToolSpecification.model_validate(fields)
    rng = np.random.default_rng(15)
    for angle_deg in (180.0, -179.8, 179.9):
        pose = ToolPose((7000.0, 8000.0, 3000.0), STRAIGHT, {"theta1": angle_deg})
        document = keypoint_document(folding, noisy(pose, folding, rng))
        assert kinds(fit_document(document, folding)) == [("roll", "")]
        assert likely_mistakes(document, folding) == ()


def test_a_tool_without_links_has_no_pose() -> None:
    bead = ToolSpecification.model_validate(
        {"schema": "oct-tool/1", "name": "bead", "keypoints": [{"name": "centre"}]}
    )
    assert fit_points([BodyPoint("shaft", (0.0, 0.0, 0.0), (1.0, 2.0, 3.0))] * 2, bead) is None


def test_hinges_may_lie_anywhere(forceps: ToolSpecification, keypoint_document: Write) -> None:
    fields = forceps.model_dump(mode="json")
    fields["joints"][0]["hinge_axis"] = [0.0, 0.6, 0.8]
    fields["joints"][1]["hinge_axis"] = [0.6, 0.0, 0.8]
    fields["joints"] = fields["joints"][::-1]
    odd = ToolSpecification.model_validate(fields)
    rng = np.random.default_rng(13)
    for _ in range(30):
        truth = ToolPose(
            vector(rng.uniform(0, 9000, 3)),
            rotations.quaternion(rng.normal(size=4)),
            {"theta1": float(rng.uniform(-85, 85)), "theta2": float(rng.uniform(5, 85))},
        )
        fit = fit_document(keypoint_document(odd, keypoints_um(truth, odd)), odd)
        assert fit is not None
        assert max(fit.residuals_um.values()) < 1e-3
