"""How far a network is from a tool's pose."""

import math

import numpy as np
import pytest

from tests.needs_torch import NEEDS_TORCH

torch = pytest.importorskip("torch", reason=NEEDS_TORCH)
pytestmark = pytest.mark.torch

from annotations.geometry.angles import angles_deg  # noqa: E402
from annotations.geometry.kinematics import ToolPose, keypoints_um  # noqa: E402
from annotations.geometry.rotations import quaternion  # noqa: E402
from annotations.geometry.targets import target_arrays  # noqa: E402
from annotations.geometry.tool_library import shipped_tools  # noqa: E402
from annotations.learning.losses.pose_losses import (  # noqa: E402
    PoseLoss,
    regression_loss,
    unsigned_angles_deg,
)

torch.set_num_threads(1)

FORCEPS = shipped_tools()["magnetic-forceps"]
NEEDLE = shipped_tools()["needle"]


def posed_mm(rng: np.random.Generator, count: int) -> np.ndarray:
    poses = [
        ToolPose(
            tuple(rng.uniform(0, 10_000, 3)),
            quaternion(rng.standard_normal(4)),
            {"theta1": float(rng.uniform(-80, 80)), "theta2": float(rng.uniform(5, 85))},
        )
        for _ in range(count)
    ]
    return np.array([list(keypoints_um(pose, FORCEPS).values()) for pose in poses]) / 1000


def tensor(values: object) -> "torch.Tensor":
    return torch.tensor(np.asarray(values), dtype=torch.float32)


def test_angles_are_those_of_the_library() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.standard_normal((2, 200, 3))
    found = unsigned_angles_deg(tensor(first), tensor(5 * second))
    np.testing.assert_allclose(found.numpy(), angles_deg(first, second), atol=2e-4)


@pytest.mark.parametrize("turn_deg", [0.01, 1.0, 90.0, 179.0, 179.99])
def test_an_angle_changes_by_one_degree_a_degree(turn_deg: float) -> None:
    turn = torch.tensor([math.radians(turn_deg)], requires_grad=True)
    second = torch.stack([turn.cos(), turn.sin(), torch.zeros(1)], dim=1)
    unsigned_angles_deg(tensor([[2.0, 0.0, 0.0]]), second).sum().backward()
    assert turn.grad is not None
    assert turn.grad.item() == pytest.approx(math.degrees(1), rel=2e-3)


@pytest.mark.parametrize(
    ("second", "expected_deg"),
    [
        ((1.0, 0.0, 0.0), 0.0),
        ((-3.0, 0.0, 0.0), 180.0),
        ((1.0, 1e-9, 0.0), 0.0),
        ((0.0, 0.0, 0.0), 0.0),
        ((1e-20, 0.0, 0.0), 0.0),
    ],
)
def test_angles_without_a_slope_have_finite_gradients(
    second: tuple[float, float, float], expected_deg: float
) -> None:
    vectors = [tensor([[1.0, 0.0, 0.0]]).requires_grad_(), tensor([second]).requires_grad_()]
    found = unsigned_angles_deg(*vectors)
    assert found.item() == pytest.approx(expected_deg, abs=1e-4)
    for gradient in torch.autograd.grad(found.sum(), vectors):
        assert gradient.abs().max() < 1e-3


def test_the_parts_are_the_published_errors() -> None:
    rng = np.random.default_rng(2)
    true_mm = posed_mm(rng, 5)
    found_mm = true_mm + rng.normal(0, 0.3, true_mm.shape)
    loss = PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)
    total, parts = loss(tensor(found_mm), tensor(true_mm), torch.ones(5, 6, dtype=torch.bool), torch.ones(5))
    found, true = target_arrays(found_mm, FORCEPS), target_arrays(true_mm, FORCEPS)
    assert found.position_um is not None
    assert true.position_um is not None
    assert found.orientation is not None
    assert true.orientation is not None
    expected = {
        "position_mm": np.linalg.norm(found.position_um - true.position_um, axis=1).mean(),
        "orientation_deg": angles_deg(found.orientation, true.orientation).mean(),
    } | {
        f"{name}_deg": np.abs(found.angles_deg[name] - true.angles_deg[name]).mean()
        for name in ("theta1", "theta2")
    }
    assert {name: part.item() for name, part in parts.items()} == pytest.approx(expected, abs=1e-3)
    assert total.item() == pytest.approx(
        expected["position_mm"]
        + 0.1 * sum(error for name, error in expected.items() if name.endswith("_deg")),
        abs=1e-3,
    )


def test_an_example_counts_for_the_targets_whose_keypoints_are_known() -> None:
    rng = np.random.default_rng(3)
    true_mm = posed_mm(rng, 2)
    found_mm = tensor(true_mm + 0.3).requires_grad_()
    is_known = torch.ones(2, 6, dtype=torch.bool)
    is_known[0, 5] = is_known[1, 0] = False
    loss = PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)
    total, parts = loss(found_mm, tensor(true_mm), is_known, torch.ones(2))
    assert parts["position_mm"].item() == pytest.approx(0.3 * math.sqrt(3), abs=1e-4)
    (gradient,) = torch.autograd.grad(total, found_mm)
    assert (gradient[0, 5] == 0).all()
    assert (gradient[1, :2] == 0).all()
    assert (gradient[0, :2] != 0).any()


def test_what_is_right_has_no_error_and_a_finite_gradient() -> None:
    true_mm = tensor(posed_mm(np.random.default_rng(4), 3))
    found_mm = true_mm.clone().requires_grad_()
    loss = PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)
    total, _ = loss(found_mm, true_mm, torch.ones(3, 6, dtype=torch.bool), torch.ones(3))
    assert total.item() == pytest.approx(0, abs=1e-3)
    (gradient,) = torch.autograd.grad(total, found_mm)
    assert torch.isfinite(gradient).all()


def test_a_straight_tool_has_a_finite_gradient() -> None:
    straight = ToolPose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    true_mm = tensor([list(keypoints_um(straight, FORCEPS).values())]) / 1000
    found_mm = true_mm.clone().requires_grad_()
    total, _ = PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)(
        found_mm, true_mm, torch.ones(1, 6, dtype=torch.bool), torch.ones(1)
    )
    (gradient,) = torch.autograd.grad(total, found_mm)
    assert torch.isfinite(gradient).all()


def test_links_that_are_found_far_too_short_say_nothing_of_directions() -> None:
    true_mm = tensor(posed_mm(np.random.default_rng(5), 2))
    for shrink in (0.0, 1e-9, 0.05):
        found_mm = (true_mm.mean(dim=1, keepdim=True) + shrink * true_mm).requires_grad_()
        total, parts = PoseLoss(FORCEPS, FORCEPS.keypoint_names, 0.1)(
            found_mm, true_mm, torch.ones(2, 6, dtype=torch.bool), torch.ones(2)
        )
        (gradient,) = torch.autograd.grad(total, found_mm)
        assert gradient.abs().max() < 1
        assert parts["orientation_deg"].item() == parts["theta1_deg"].item() == 0
        assert parts["position_mm"].item() > 0


def test_targets_that_the_tool_lacks_or_the_network_does_not_find_are_left_out() -> None:
    points = torch.rand(1, 2, 3)
    is_known = torch.ones(1, 2, dtype=torch.bool)
    for loss, names in (
        (PoseLoss(NEEDLE, NEEDLE.keypoint_names, 0.1), {"position_mm", "orientation_deg"}),
        (PoseLoss(NEEDLE, ("tip",), 0.1), {"position_mm"}),
        (PoseLoss(FORCEPS, ("k2", "k3"), 0.1), set()),
    ):
        _, parts = loss(points, points, is_known, torch.ones(1))
        assert set(parts) == names


def test_regressed_numbers_are_compared_where_they_are_known() -> None:
    output = torch.tensor([[0.5, 0.2], [0.1, 0.9]], requires_grad=True)
    scaled = torch.tensor([[0.4, float("nan")], [0.4, 0.8]])
    total = regression_loss(output, scaled)
    assert total.item() == pytest.approx((0.1 + 0.3 + 0.1) / 3)
    (gradient,) = torch.autograd.grad(total, output)
    torch.testing.assert_close(gradient, torch.tensor([[1.0, 0.0], [-1.0, 1.0]]) / 3)
    mixed = regression_loss(output, scaled, torch.tensor([0.25, 0.25]))
    assert mixed.item() == pytest.approx(0.25 * total.item())


def test_nothing_known_is_nothing_to_regress() -> None:
    output = torch.zeros(2, 8, requires_grad=True)
    total = regression_loss(output, torch.full((2, 8), float("nan")))
    total.backward()
    assert total.item() == 0
    assert output.grad is not None
    assert (output.grad == 0).all()
